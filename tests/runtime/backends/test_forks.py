"""Processes that are forked from one that played: `gl` refuses to play, instead of hanging; the others play on."""

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
options = {"threads": 2} if backend == "cpu" else {}
player = Player(full_avatar(), backend, **options)
player.frame(Pose(), camera)
child = os.fork()
if not child:
    try:
        (Player(full_avatar(), backend, **options) if again == "new" else player).frame(Pose(), camera)
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
def test_a_forked_process_plays_or_is_refused(backend: str, again: str) -> None:
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM, backend, again],
        capture_output=True,
        text=True,
        timeout=120,
        check=True,
    )
    child, parent = done.stdout.splitlines()
    assert parent == "ended 0", done.stderr
    if backend == "gl":
        assert child.startswith("backend gl: this process was forked from one ")
        assert "'spawn' or 'forkserver'" in child
    else:
        assert child == "played"
