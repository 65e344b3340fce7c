"""The four readers say the same of packs changed by chance: a small part of `python -m tools.fuzz.readers`."""

from __future__ import annotations

from pathlib import Path

from tools.fuzz.readers import compare

from tests.players.hostile.judges import GUARDED


def test_all_readers_give_one_answer(tmp_path: Path) -> None:
    tally = compare(400, 9, list(GUARDED), tmp_path / "kept", 5)
    assert tally["refused"] > 100 and tally["taken"] > 50 and not tally["differ"], tally
