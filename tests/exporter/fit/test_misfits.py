"""Every misfit of the table is found, in the words that the documents print; what fits raises no doubt."""

from __future__ import annotations

import re
import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from avatar_export import AvatarError, ReadOptions, read
from avatar_export.fit.embedded import own_mesh_fit
from avatar_export.fit.judge import Sides
from avatar_export.fit.motion import Under, expressions, eyelids, features, joints_shared
from avatar_export.fit.skeleton import joint_faults
from avatar_export.fit.surface import Mesh, explained, opaque_rows, size_of
from avatar_export.notes.text import DOUBTFUL
from avatar_runtime.avatar import Avatar
from tests.exporter.fit.misfits import MISFITS, SOUND, Bases, blendshapes
from tests.exporter.fit.table import said, stored
from tests.golden import BlendshapesGolden
from tests.shared_data import shared

TRAINED = sorted(p for p in (Path(__file__).parents[3] / "samples" / "trained").iterdir() if p.is_dir())
ALWAYS = (  # one of each kind of check; `make test-more` makes all misfits
    *(
        "FLAME in millimetres",
        "FLAME with z up",
        "FLAME mirrored",
        "`--body-scale 1000`",
        "a negated identity",
    ),
    *(
        "a shape of two coefficients",
        "expressions in reverse order",
        "skin weights in another order of joints",
    ),
    *("left and right eyelid exchanged", "anchor faces on the chin", "upper teeth in millimetres"),
    *(
        "SplattingAvatar: `--units 1` for a head times 4 (650 mm off)",
        "SplattingAvatar: poses of another identity",
    ),
    *("SplattingAvatar: the newest iteration lacks embedding.json", "LAM: offsets in millimetres"),
)


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
def test_the_golden_checkpoint_raises_no_doubt(
    form: str, blendshapes_golden: BlendshapesGolden, tmp_path: Path
) -> None:
    golden = blendshapes_golden
    given: dict[str, Any] = {"body_model": golden.body / "body_model.npz", "eyelids": golden.body}
    given |= {"anchor_faces": golden.body / "back_of_head.txt", "dataset": golden.folder / "dataset"}
    avatar = read(getattr(golden, form), ReadOptions(**given))
    assert doubts(avatar) == []


def test_a_real_lam_avatar_raises_no_doubt() -> None:
    assert doubts(read(shared("lam/p2-1.zip"))) == []


@pytest.mark.parametrize("folder", TRAINED, ids=lambda folder: folder.name)
def test_trained_samples_raise_no_doubt(folder: Path) -> None:
    """Their checkpoints are not stored, so what their bundles hold is judged."""
    avatar = read(folder)
    rig, embedding = avatar.rig, avatar.embedding
    assert rig is not None
    mesh = Mesh.of(rig.vertices, rig.triangles)
    if embedding is not None:
        mesh = Mesh.of(embedding.canonical_vertices, embedding.triangles)
    assert own_mesh_fit(avatar, mesh, Sides("the Gaussians", "the mesh", "test", None)) == []
    group = avatar.groups[0]
    rows = opaque_rows(avatar, group)
    points = avatar.gaussians.mean[rows].astype("f8")
    assert explained(points, mesh, 0.05 * size_of(mesh.used), pairs=True) is None
    if group.binding == "skin":
        under = Under.of(rows, mesh, mesh.nearest(points))
        assert expressions(avatar, under)[0].alike and features(avatar, under).alike
        assert eyelids(avatar, group, mesh).alike and joints_shared(avatar, under) < 0.1
        assert joint_faults(rig, mesh) == []


def test_long_edges_excuse_no_gaussians_that_are_not_embedded() -> None:
    """Gaussians in metres beside one triangle of kilometres, 200 m away: only an embedding gives both one unit."""
    avatar = replace(read(TRAINED[1]), embedding=None)
    far = np.array([[0, 0, 200], [3000, 0, 200], [0, 3000, 200]], np.float64)
    with pytest.raises(AvatarError, match="the Gaussians lie 200 m"):
        own_mesh_fit(
            avatar, Mesh(far, np.array([[0, 1, 2]], np.uint32)), Sides("the Gaussians", "x", "test", None)
        )


def test_a_misfit_that_is_accepted_is_read_with_a_warning(bases: Bases, tmp_path: Path) -> None:
    source, options = MISFITS["FLAME in millimetres"](bases, tmp_path)
    with pytest.raises(AvatarError, match="--accept-misfit converts it all the same"):
        read(source, ReadOptions(**options))
    found = doubts(read(source, ReadOptions(**options, accept_misfit=True)))
    assert any("body_model.npz were in metres: its lengths seem to be millimetres" in text for text in found)


def test_teeth_that_are_missing_may_be_accepted(bases: Bases, tmp_path: Path) -> None:
    source, options = MISFITS["a face of iteration 40000, mouths of 30000"](bases, tmp_path)
    avatar = read(source, ReadOptions(**options, accept_misfit=True))
    assert [group.name for group in avatar.groups] == ["face"]


def test_other_identities_of_the_data_set_are_tried_and_named_without_their_folder(
    bases: Bases, tmp_path: Path
) -> None:
    source, options = blendshapes(bases)
    shutil.copytree(bases.blendshapes / "dataset", tmp_path / "dataset")
    given = options | {"shape": Path("zero"), "dataset": tmp_path / "dataset"}
    (found,) = doubts(read(source, ReadOptions(**given)))
    assert "with --shape 00000.frame in place of --shape zero" in found and str(tmp_path) not in found
