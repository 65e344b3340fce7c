"""The samples that are shipped: sound, small, with their notices, and drawn as their trainer drew them."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from samples.trained import RECIPES
from samples.unity import FOLDER, PACKS, main

from avatar_export.checks.bundle import validate
from avatar_export.checks.reference import read_reference
from avatar_runtime.bundle import load, opener, read_manifest
from avatar_runtime.conformance import conform
from avatar_runtime.packs import read_pack
from tests.avatars import bits, leaves

TRAINED = Path(__file__).parents[2] / "samples" / "trained"
NORMATIVE_MB, ALL_MB = 12, 36


def megabytes(folder: Path, *, derived: bool) -> float:
    files = json.loads((folder / "avatar.json").read_text("utf-8"))["files"]
    return sum(entry["bytes"] for entry in files if derived or not entry["derived"]) / 1e6


def test_every_recipe_is_shipped_and_small() -> None:
    assert {path.name for path in TRAINED.iterdir() if path.is_dir()} == set(RECIPES)
    for name in RECIPES:
        assert megabytes(TRAINED / name, derived=False) < NORMATIVE_MB
    assert sum(megabytes(TRAINED / name, derived=True) for name in RECIPES) < ALL_MB


@pytest.mark.parametrize("name", RECIPES)
def test_is_sound_and_says_whence_it_comes(name: str) -> None:
    assert [str(problem) for problem in validate(TRAINED / name) if not problem.warning] == []
    provenance = load(TRAINED / name).provenance
    assert provenance["licence"]
    assert provenance["trained"]["capture"].startswith("synthetic")


@pytest.mark.parametrize("backend", ["cpu", "gl"])  # `validate` asks backend `reference`
@pytest.mark.parametrize("name", RECIPES)
def test_every_backend_repeats_the_trainers_reference(name: str, backend: str) -> None:
    read = opener(TRAINED / name)
    reference = read_reference(read_manifest(read), read)
    assert reference.made_by == "trainer"
    report = conform(load(TRAINED / name), reference, backend)
    assert [row for row in report.rows if not row.passed] == []
    assert [row for row in report.images if not row.passed] == []


STEPS = 1.0 / (1 << 14)  # of the box: codes of 16 bits, which a pack need not use up
CODE = 1.0 / 127  # of an array's range: one code of eight bits, the coarsest


@pytest.mark.parametrize("bundle", sorted(set(PACKS.values())))
def test_a_pack_is_its_avatar(bundle: str) -> None:
    names = [name for name, source in PACKS.items() if source == bundle]
    assert len({(FOLDER / name).read_bytes() for name in names}) == 1
    document, played = read_pack(FOLDER / names[0]).document, load(FOLDER / names[0])
    source = load(TRAINED / bundle)
    assert document["avatar"]["frame"]["handedness"] == "left"
    assert document["packing"]["levels"] == [1.0]
    for field in ("expressions", "eyelids", "joint_names", "groups", "rules"):
        assert getattr(played, field, None) == getattr(source, field, None), field
    for field in ("licence", "consent", "author"):
        assert played.provenance[field] == source.provenance[field]
    assert [clip.name for clip in played.clips] == [clip.name for clip in source.clips]
    assert played.rig is not None and source.rig is not None
    assert played.rig.joint_names == source.rig.joint_names
    size = np.ptp(source.rig.vertices, axis=0).max()
    assert np.abs(played.rig.vertices - source.rig.vertices).max() <= STEPS * size
    box = np.ptp(source.gaussians.mean, axis=0).max()
    if source.embedding is None:
        assert np.abs(played.gaussians.mean - source.gaussians.mean).max() <= STEPS * box
    assert [clip.fps for clip in played.clips] == [clip.fps for clip in source.clips]


@pytest.mark.more
def test_they_are_made_again(tmp_path: Path) -> None:
    """Another CPU may round a value to the next code, and no further."""
    main(tmp_path)
    for name in PACKS:
        made, shipped = (leaves(replace(load(folder / name), packed=None)) for folder in (tmp_path, FOLDER))
        assert list(made) == list(shipped)
        for path, value in made.items():
            if isinstance(value, np.ndarray) and value.dtype.kind == "f" and value.size:
                step = CODE * max(np.ptp(shipped[path]), np.abs(shipped[path]).max())
                assert value.shape == shipped[path].shape, path
                assert np.abs(value - shipped[path]).max() <= step, path
            else:
                assert bits(value) == bits(shipped[path]), path


def test_size_and_notices() -> None:
    files = [p for folder in ("data", "drive") for p in (TRAINED.parent / folder).iterdir()]
    assert sum(p.stat().st_size for p in files) < 7e6
    for who, name in (("USC Institute", "ict-facekit"), ("Lee Perry-Smith", "lee-perry-smith")):
        assert who in (TRAINED.parent / f"data/LICENSE.{name}.txt").read_text()
    assert {p.name for p in files} >= {"LICENSE.live_link_face_rom.txt", "LICENSE.llv.txt"}
