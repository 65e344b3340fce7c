"""NAME.avatar: what is written is read, the same input gives the same bytes, and hostile files get one line."""

from __future__ import annotations

import gzip
import json
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import safetensors.numpy

from avatar_export.packing.steps import Fineness
from avatar_export.packing.write import pack
from avatar_runtime.io.errors import AvatarError
from avatar_runtime.packs import decode_pack
from tests.avatars import assert_same
from tests.exporter.packing.cases import AVATARS, COARSE, closed, levels_of, opened

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


def spoiled(change: Callable[[dict[str, Any], dict[str, Any]], None]) -> bytes:
    header, document, tensors = opened(FILES["surface"])
    change(header, document)
    return closed(header, document, tensors)


def set_first(document: dict[str, Any], key: str, value: Any) -> None:
    next(b for b in document["program"]["buffers"] if "sections" in b)["sections"][0][key] = value


def set_incidence(document: dict[str, Any], count: int) -> None:
    """Gives the triangles around each vertex that many vertices; the section itself comes later."""
    listed = next(
        b["sections"]
        for b in document["program"]["buffers"]
        if any(s["name"] == "vertex_triangle" for s in b.get("sections", []))
    )
    ptr = next(s for s in listed if s["name"] == "vertex_triangle_ptr")
    ptr["count"] = count
    listed.remove(ptr)
    listed.append(ptr)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda h, d: d["asset"].update(version="2.0", minVersion="2.0"), r"\$\.asset\.version: is 2\.0"),
        (lambda h, d: d.update(shaders=2), r"\$\.shaders: needs kernels of version 2"),
        (lambda h, d: d.pop("levels"), "'levels' is a required property"),
        (lambda h, d: set_first(d, "codec", "zstd"), "'zstd' is unknown to this reader"),
        (lambda h, d: set_first(d, "tensor", "nowhere"), "tensor 'nowhere' is missing"),
        (lambda h, d: set_first(d, "count", 4_000_000_000), "takes more than|elements of"),
        (lambda h, d: d["program"]["mesh"][0].update(entry="explode"), "explode"),
        (lambda h, d: d["program"]["mesh"][0].update(rows=10**9), "mesh"),
        (lambda h, d: d["program"]["mesh"][0]["buffers"].update(Pose="Nothing"), "Nothing"),
        (lambda h, d: d["program"]["levels"][0]["view"][0]["constants"].update(eye="ear"), "ear"),
        (lambda h, d: d["program"]["levels"][0]["view"][0]["constants"].update(count=49), "count"),
        (lambda h, d: h[min(h)].update(data_offsets=[0, 1 << 40]), "claims 1099511627776 bytes"),
        (lambda h, d: h[min(h)].update(dtype="F32"), "does not fit the file"),
        (lambda h, d: d["avatar"]["rules"].update(rotation="twist"), "'twist' is unknown to this reader"),
        (lambda h, d: d["avatar"].update(joints=[]), "joint"),
        (lambda h, d: d["avatar"]["clips"][0].update(frames=10**9), "the clips decode to [0-9]+ bytes"),
        (lambda h, d: set_incidence(d, 1 << 30), "is for 1073741823 vertices"),
    ],
)
def test_a_hostile_document_gets_one_line(change: Callable[..., None], message: str) -> None:
    with pytest.raises(AvatarError, match=message) as caught:
        decode_pack(spoiled(change), "some.avatar")
    assert str(caught.value).startswith("some.avatar: ") and "\n" not in str(caught.value)


def test_a_cut_or_longer_file_is_refused() -> None:
    file = FILES["joints"]
    for data, message in (
        (file[: len(file) // 2], "ends .* too early"),
        (file[:-4], "ends|goes on|damaged"),
        (file + b"x", "goes on after"),
        (b"PK" + file, "does not begin as a gzip file"),
        (file[:200] + bytes(8) + file[208:], "damaged|JSON|ends|not"),
    ):
        with pytest.raises(AvatarError, match=message):
            decode_pack(data, "x")


def test_a_gzip_bomb_is_refused_before_memory_is_taken() -> None:
    size = 900 << 20
    text = json.dumps({"t": {"dtype": "U8", "shape": [size], "data_offsets": [0, size]}}).encode()
    bomb = gzip.compress(len(text).to_bytes(8, "little") + text + bytes(1 << 20))
    with pytest.raises(AvatarError, match="claims 943718400 bytes in a file of"):
        decode_pack(bomb, "x")
    with pytest.raises(AvatarError, match="claims a header of"):
        decode_pack(gzip.compress((1 << 40).to_bytes(8, "little")), "x")
