"""The packs of the Unity samples are those that `python -m samples.unity` makes of the trained avatars."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from samples.unity import FOLDER, PACKS, main

from avatar_runtime.bundle import load
from avatar_runtime.packs import read_pack
from tests.avatars import bits, leaves

ROOT = Path(__file__).parents[2]
TRAINED = ROOT / "samples" / "trained"
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
