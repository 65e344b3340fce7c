"""What `avatar-train check` says."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from avatar_trainer.captures.describe import describe
from avatar_trainer.captures.load import load
from tests.trainer.captures import folders


def described(folder: Path, rows: list[list[float]]) -> str:
    def change(document: dict[str, Any]) -> None:
        for t, (entry, row) in enumerate(zip(document["frames"], rows, strict=True)):
            entry["expression"] = row
            entry["split"] = "train" if t < 4 else "test"
            entry["joints"] = {"jaw": [np.radians(10.0 * t), 0, 0]}

    return "\n".join(describe(load(folders.changed(folders.own(folder), change))))


def test_ranges_are_told_by_split(tmp_path: Path) -> None:
    rows = [[0, 0], [0.5, 0.01], [-0.25, 0], [0, 0], [0.75, 0.9], [0, 0]]
    text = described(tmp_path / "take", rows)
    lines = {line.split()[0]: " ".join(line.split()) for line in text.splitlines()}
    assert lines["frames"] == "frames 6 at 30 a second: 4 to train on, 2 held out (004 .. 005)"
    assert lines["expressions"] == "expressions 3, 1 seen in training (above 0.05)"
    assert lines["exp_002"] == "exp_002 train -0.25 .. +0.50 test +0.00 .. +0.75"
    assert lines["exp_000"] == "exp_000 train +0.00 .. +0.01 test +0.00 .. +0.90 only in frames held out"
    assert lines["never"] == "never seen in training: exp_000, exp_001"
    assert lines["joints"] == "joints jaw 50 degrees at most" and lines["licence"] == "licence CC0"
