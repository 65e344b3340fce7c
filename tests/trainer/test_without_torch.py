"""The command where the libraries of training are not installed."""

from __future__ import annotations

import subprocess
import sys

PROGRAM = """
import importlib.util, sys
find = importlib.util.find_spec
importlib.util.find_spec = lambda name, *rest: None if name in {hidden!r} else find(name, *rest)
from avatar_trainer.__main__ import main
sys.argv = ["avatar-train", "--help"]
main()
"""


def test_without_torch_it_says_what_to_install() -> None:
    program = PROGRAM.format(hidden=("torch", "tensorboard"))
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True)
    assert done.returncode == 2 and done.stdout == ""
    assert done.stderr == 'avatar-train: needs torch, tensorboard: pip install -e ".[train]"\n'
