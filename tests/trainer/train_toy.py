"""`python -m tests.trainer.train_toy` is `avatar-train` with the toy beside the other systems, guards included."""

from __future__ import annotations

from avatar_export.commands.memory import TRAIN
from avatar_export.commands.process import start

if __name__ == "__main__":
    start("avatar-train", "tests.trainer.toy", TRAIN)
