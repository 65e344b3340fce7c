"""A short trial of what `python -m tests.trainer.loop.kill` does at length."""

from __future__ import annotations

from pathlib import Path

from tests.trainer import toy
from tests.trainer.loop.kill import trial


def test_training_that_is_killed_goes_on_and_ends_in_the_same_bytes(tmp_path: Path) -> None:
    arguments = ["toy", str(toy.capture_folder(tmp_path / "capture")), "--iterations", "30", "--threads", "1"]
    arguments += ["--checkpoint-every", "1", "--set", f"ballast={16 << 20}"]
    report = trial(arguments, tmp_path, times=3, seed=2, iterations=30)
    assert report.kills >= 2  # one more, unless this process slept through the end of the run
