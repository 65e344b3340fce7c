"""Notes: each kind has one text, each text is used, and what files call themselves is never taken for a template."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from avatar_export.notes.note import Note, Setting, doubt, fact
from avatar_export.notes.text import TABLES, TEXTS, from_stored, stored, text

ROOT = Path(__file__).parents[2]
SOURCES = (ROOT / "exporter" / "avatar_export", ROOT / "trainer" / "avatar_trainer")
MADE = re.compile(r'\b_?(?:fact|doubt|judged|too_far|Note)\(\s*"([a-z_]+)"')


def test_every_kind_has_one_text_and_every_text_is_used() -> None:
    kinds = [kind for table in TABLES for kind in table.TEXTS]
    files = [path for source in SOURCES for path in source.rglob("*.py")]
    made = {kind for path in files for kind in MADE.findall(path.read_text("utf-8"))}
    assert len(kinds) == len(set(kinds)) and made == set(TEXTS)


@pytest.mark.parametrize(
    "note, wanted",
    [
        (fact("vertices_found", file="{how}.npz", how="{}"), "vertices of {how}.npz found by {}"),
        (fact("rig_differs", mm=3.14, cause="truncation_mm", influences=4, more=None), "4 joints a vertex"),
        (fact("settings", settings=[Setting("units", 4.0, None)]), "4 training units a metre (assumed, nothing"),
        (fact("taken", what="x", others=list("abcdefg")), "x is read; passed over: a, b, c, d, e and 2 more"),
        (fact("floor", parts={"Clips": 2000}, bytes=5000), "clips 2.0 kB; at least 5000 bytes in all"),
        (doubt("other_positions", cloud="x", apart=0.002), "lie 2 mm (median)"),
        (doubt("moves_otherwise", what="eyelids", own="a", goal="b", correlation=0.1, gain=1,
               cause=fact("eyelid_files")), "correlation 0.10; look at --eyelids"),
    ],
)  # fmt: skip
def test_values_stand_in_the_text(note: Note, wanted: str) -> None:
    assert wanted in text(note)


def test_a_manifest_keeps_texts_and_gives_them_back() -> None:
    notes = [doubt("one_camera"), fact("no_rig"), Note("taken", {"what": "x", "others": []}, passing=True)]
    found = from_stored([*stored(notes), 5])
    assert [(note.kind, note.severity) for note in found] == [("said", "doubt"), ("said", "fact")]
    assert stored(found) == stored(notes) and from_stored("x") == from_stored(None) == []
