"""Every misfit of the table is found, in the words that the documents print; what fits raises no doubt."""

from __future__ import annotations

import re
import shutil
from pathlib import Path
from typing import Any

import pytest

from avatar_export import ReadOptions, read
from avatar_export.notes.text import DOUBTFUL
from avatar_runtime.avatar import Avatar
from tests.exporter.fit.misfits import MISFITS, SOUND, Bases, blendshapes
from tests.exporter.fit.table import said, stored
from tests.exporter.refusals import refused
from tests.golden import BlendshapesGolden

ALWAYS = {  # one of each kind of check; `make test-more` makes all misfits
    "FLAME in millimetres", "FLAME with z up", "FLAME mirrored", "`--body-scale 1000`", "a negated identity",
    "a shape of two coefficients", "expressions in reverse order", "skin weights in another order of joints",
    "left and right eyelid exchanged", "anchor faces on the chin", "upper teeth in millimetres",
    "SplattingAvatar: `--units 1` for a head times 4 (650 mm off)", "SplattingAvatar: poses of another identity",
    "SplattingAvatar: the newest iteration lacks embedding.json", "LAM: offsets in millimetres",
}  # fmt: skip


def without_estimates(text: str) -> str:
    """`text` without an estimated identity and what it would leave: the last digits of the fit follow the processor."""
    return re.sub(
        r"[\d.]+ mm with another identity of this body model \([^)]*\)", "# mm with another identity", text
    )


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=() if name in ALWAYS else pytest.mark.more) for name in MISFITS]
)
def test_it_is_found_as_the_table_says(name: str, bases: Bases, tmp_path: Path) -> None:
    found = said(MISFITS[name](bases, tmp_path))
    assert found.startswith(("refused: ", "warning: "))
    assert without_estimates(found) == without_estimates(stored()[name][1])


def test_the_table_has_these_misfits_and_no_other() -> None:
    assert list(stored()) == list(MISFITS)


def doubts(avatar: Avatar) -> list[str]:
    return [note for note in avatar.provenance["notes"] if note.startswith(DOUBTFUL)]


@pytest.mark.parametrize("name", SOUND)
def test_sound_samples_raise_no_doubt(name: str, bases: Bases) -> None:
    source, options = SOUND[name](bases)
    assert doubts(read(source, ReadOptions(**options))) == []


@pytest.mark.parametrize("form", ["raw", "viewer"])
def test_golden_checkpoints(form: str, blendshapes_golden: BlendshapesGolden, tmp_path: Path) -> None:
    golden = blendshapes_golden
    given: dict[str, Any] = {"body_model": golden.body / "body_model.npz", "eyelids": golden.body}
    given |= {"anchor_faces": golden.body / "back_of_head.txt", "dataset": golden.folder / "dataset"}
    avatar = read(getattr(golden, form), ReadOptions(**given))
    assert doubts(avatar) == []


def test_a_misfit_that_is_accepted_is_read_with_a_warning(bases: Bases, tmp_path: Path) -> None:
    source, options = MISFITS["FLAME in millimetres"](bases, tmp_path)
    refused("--accept-misfit converts it all the same", read, source, ReadOptions(**options))
    found = doubts(read(source, ReadOptions(**options, accept_misfit=True)))
    assert any("body_model.npz were in metres: its lengths seem to be millimetres" in text for text in found)


def test_identities_of_the_data_set_are_tried(bases: Bases, tmp_path: Path) -> None:
    source, options = blendshapes(bases)
    shutil.copytree(bases.blendshapes / "dataset", tmp_path / "dataset")
    given = options | {"shape": Path("zero"), "dataset": tmp_path / "dataset"}
    (found,) = doubts(read(source, ReadOptions(**given)))
    assert "with --shape 00000.frame in place of --shape zero" in found and str(tmp_path) not in found
