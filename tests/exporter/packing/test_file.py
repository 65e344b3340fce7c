"""NAME.avatar: what is written is read, and the same input gives the same bytes."""

from __future__ import annotations

import gzip
from dataclasses import replace

import numpy as np
import pytest
import safetensors.numpy

from avatar_export.packing.steps import Fineness
from avatar_export.packing.write import pack
from avatar_runtime.packs import decode_pack
from tests.avatars import assert_same
from tests.exporter.packing.cases import AVATARS, COARSE, levels_of, opened

FILES = {name: pack([avatar], COARSE).file for name, avatar in AVATARS.items()}


@pytest.mark.parametrize("fine", [None, COARSE], ids=["exact", "small"])
@pytest.mark.parametrize("name", AVATARS)
def test_a_pack_holds_the_avatar_that_it_plays(name: str, fine: Fineness | None) -> None:
    made = pack([AVATARS[name]], fine, {"framing": {}}, b"webp")
    got = decode_pack(made.file, "x")
    without = {"clips": (), "packed": None, "enhancer": None}
    assert_same(replace(got.avatar, **without), replace(made.avatar, **without))
    assert got.preview == b"webp" and got.document["framing"] == {}


@pytest.mark.parametrize("name", AVATARS)
def test_an_exact_pack_changes_no_bit(name: str) -> None:
    got = decode_pack(pack([AVATARS[name]], None).file, "x").avatar
    assert_same(replace(got, packed=None, extras={}), replace(AVATARS[name], enhancer=None, extras={}))


def test_levels_share_the_rig_and_are_read_apart() -> None:
    for avatar in AVATARS.values():
        made = pack(levels_of(avatar), COARSE)
        got = decode_pack(made.file, "x").avatar
        assert got.packed is not None and got.packed.levels == 2
        coarse = got.packed.at(1)
        assert made.avatar.packed is not None
        want = made.avatar.packed.at(1)
        assert coarse.gaussians.count == want.gaussians.count < avatar.gaussians.count
        without = {"clips": (), "packed": None, "enhancer": None}
        assert_same(replace(coarse, **without), replace(want, **without))


def test_clips_are_within_half_a_step() -> None:
    for avatar in AVATARS.values():
        for clip, want in zip(
            decode_pack(FILES["joints"], "x").avatar.clips, AVATARS["joints"].clips, strict=True
        ):
            for name in ("expression_weights", "late_weights", "joint_delta", "world_from_avatar"):
                low, high = getattr(want, name).min(axis=0), getattr(want, name).max(axis=0)
                step = np.maximum((high - low) / 65535, 1 / 4096)
                assert (np.abs(getattr(clip, name) - getattr(want, name)) <= 0.51 * step + 1e-6).all()
        assert avatar.clips is not None


def test_the_same_input_gives_the_same_bytes() -> None:
    assert pack([AVATARS["joints"]], COARSE).file == FILES["joints"]


def test_the_body_is_a_safetensors_file() -> None:
    header, _, _ = opened(FILES["surface"])
    tensors = safetensors.numpy.load(gzip.decompress(FILES["surface"]))
    assert tensors.keys() == header.keys()


def test_equal_contents_are_stored_once() -> None:
    rigged = AVATARS["surface"]
    assert rigged.rig is not None and rigged.embedding is not None
    same = replace(rigged, embedding=replace(rigged.embedding, canonical_vertices=rigged.rig.vertices))
    sections = opened(pack([same], COARSE).file)[1]["program"]["buffers"]
    tensor = {(b["name"], s["name"]): s.get("tensor") for b in sections for s in b.get("sections", [])}
    assert tensor["MorphStatic.0", "template_position"] == tensor["SurfaceStatic", "canonical"]


def test_the_coarse_level_lies_before_the_fine_one() -> None:
    header, _, _ = opened(pack(levels_of(AVATARS["joints"]), COARSE).file)
    order = sorted(header, key=lambda name: header[name]["data_offsets"][0])
    coarse = [i for i, name in enumerate(order) if name.startswith("level1/")]
    fine = [i for i, name in enumerate(order) if name.startswith("BlendStatic.0/")]
    assert coarse and max(coarse) < min(fine)
