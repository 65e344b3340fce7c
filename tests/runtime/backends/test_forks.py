"""Processes that are forked from one that played: they refuse to play, instead of hanging or being ended."""

from __future__ import annotations

import subprocess
import sys

import pytest

PROGRAM = """
import os, sys
import numpy as np
from avatar_runtime import AvatarError, Camera, Player, Pose
from tests.avatars import full_avatar
backend, again = sys.argv[1:]
camera = Camera.orbit(np.zeros(3), 2.0, 0.0, 0.0, 0.5, 16, 16)
player = Player(full_avatar(), backend)
player.frame(Pose(), camera)
child = os.fork()
if not child:
    try:
        (Player(full_avatar(), backend) if again == "new" else player).frame(Pose(), camera)
        print("played")
    except AvatarError as error:
        print(error)
    player.close()
    sys.exit(0)
print("ended", os.waitpid(child, 0)[1])
player.frame(Pose(), camera)
"""


@pytest.mark.parametrize("again", ["same", "new"])
@pytest.mark.parametrize("backend", ["reference", "cpu", "gl"])
def test_a_forked_process_is_refused_where_it_could_not_play(backend: str, again: str) -> None:
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM, backend, again],
        capture_output=True,
        text=True,
        timeout=120,
        check=True,
    )
    child, parent = done.stdout.splitlines()
    assert parent == "ended 0", done.stderr
    if backend == "reference":
        assert child == "played"
    elif child != "played":  # numba's other pools survive a fork
        assert child.startswith(f"backend {backend}: this process was forked from one ")
        assert "'spawn' or 'forkserver'" in child
    assert backend != "gl" or child != "played"
