"""NAME.avatar: what is written is read."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from avatar_export.checks.pack import validate_pack
from avatar_export.packing.choices import Choices
from avatar_export.packing.make import make_pack
from avatar_export.packing.steps import Fineness
from avatar_export.packing.write import pack
from avatar_runtime.bundle import load
from avatar_runtime.codec.clips import ARRAYS as CLIP_ARRAYS
from avatar_runtime.io.errors import AvatarError
from avatar_runtime.packs import decode_pack
from tests.avatars import assert_same, full_avatar
from tests.exporter.packing.cases import AVATARS, COARSE, closed, levels_of, opened
from tests.rigs import rig_of, with_rig

FILES = {name: pack([avatar], COARSE).file for name, avatar in AVATARS.items()}


@pytest.mark.parametrize("fine", [None, COARSE], ids=["exact", "small"])
@pytest.mark.parametrize("name", AVATARS)
def test_a_pack_holds_the_avatar_that_it_plays(name: str, fine: Fineness | None) -> None:
    framing = {"up": [0, 1, 0], "front": [0, 0, 1]}
    made = pack([AVATARS[name]], fine, {"framing": framing}, b"webp")
    got = decode_pack(made.file, "x")
    assert_same(replace(got.avatar, **WITHOUT), replace(made.avatar, **WITHOUT))
    assert got.preview == b"webp" and got.document["framing"] == framing


@pytest.mark.parametrize("name", AVATARS)
def test_an_exact_pack_changes_no_bit(name: str) -> None:
    got = decode_pack(pack([AVATARS[name]], None).file, "x").avatar
    assert_same(replace(got, packed=None, extras={}), replace(AVATARS[name], enhancer=None, extras={}))


WITHOUT = {"clips": (), "packed": None, "enhancer": None}


@pytest.mark.parametrize("name", AVATARS)
def test_levels_share_the_rig_and_are_read_apart(name: str) -> None:
    made = pack(levels_of(AVATARS[name]), COARSE)
    got = decode_pack(made.file, "x").avatar
    assert got.packed is not None and made.avatar.packed is not None and got.packed.levels == 2
    coarse, want = got.packed.at(1), made.avatar.packed.at(1)
    assert coarse.gaussians.count == want.gaussians.count < AVATARS[name].gaussians.count
    assert_same(replace(coarse, **WITHOUT), replace(want, **WITHOUT))


def test_joints_of_coarser_groups_are_those_of_the_finest() -> None:
    header, document, tensors = opened(pack(levels_of(AVATARS["joints"]), COARSE).file)
    document["levels"][1]["groups"][2]["joint_mix"] = {"no joint": 1.0}  # players do not read it
    got = decode_pack(closed(header, document, tensors), "x").avatar
    assert got.packed is not None and got.packed.at(1).groups[2].joint_mix == got.groups[2].joint_mix


def test_clips_are_within_half_a_step() -> None:
    found = decode_pack(FILES["joints"], "x").avatar.clips
    for clip, want in zip(found, AVATARS["joints"].clips, strict=True):
        for name in ("expression_weights", "late_weights", "joint_delta", "world_from_avatar"):
            low, high = getattr(want, name).min(axis=0), getattr(want, name).max(axis=0)
            step = np.maximum((high - low) / 65535, 1 / 4096)
            assert (np.abs(getattr(clip, name) - getattr(want, name)) <= 0.51 * step + 1e-6).all()


QUICK = Choices(preview=False)


@pytest.fixture(autouse=True)
def small_images(monkeypatch: pytest.MonkeyPatch) -> None:
    """What packs are measured by, which is not what is tested here."""
    monkeypatch.setattr("avatar_export.packing.make.SIZE", 64)


def test_what_overflows_in_a_pose_is_packed(tmp_path: Path) -> None:
    avatar = full_avatar()
    delta = avatar.clips[0].joint_delta.copy()
    delta[:, 1, :3, :3] *= np.float32(1e30)
    wild = replace(avatar, clips=(replace(avatar.clips[0], joint_delta=delta),))
    make_pack(wild, tmp_path / "x.avatar", QUICK)
    assert load(tmp_path / "x.avatar").gaussians.count == 48
    assert [problem for problem in validate_pack(tmp_path / "x.avatar") if not problem.warning] == []


def test_what_no_reader_would_take_is_not_written(tmp_path: Path) -> None:
    avatar = full_avatar()
    g, vertices = avatar.gaussians, rig_of(avatar).vertices
    bright = replace(avatar, gaussians=replace(g, sh=np.sign(g.sh) * np.float32(1e38)))
    away = replace(avatar, gaussians=replace(g, mean=g.mean * np.float32(1e15)))
    far = with_rig(avatar, vertices=np.sign(vertices) * np.float32(3.4e38))
    for odd, message in (
        (bright, "^Full Ävatar: .*base_sh_scale"),
        (far, "^Full Ävatar: .*template_position_scale"),
        (away, "^reference: cannot be made"),
    ):
        with pytest.raises(AvatarError, match=message):
            make_pack(odd, tmp_path / "x.avatar", QUICK, reference=odd is away)
        assert list(tmp_path.iterdir()) == []


def test_readers_take_what_is_odd_and_validate_names_it(tmp_path: Path) -> None:
    header, document, tensors = opened(FILES["joints"])
    document["levels"][0]["groups"][1]["name"] = document["levels"][0]["groups"][0]["name"]
    (tmp_path / "odd.avatar").write_bytes(closed(header, document, tensors))
    assert any("duplicate" in problem.message for problem in validate_pack(tmp_path / "odd.avatar"))


def test_nothing_is_written_that_readers_refuse(tmp_path: Path) -> None:
    avatar = AVATARS["joints"]
    (clip, *_) = avatar.clips
    still = {name: np.repeat(getattr(clip, name)[:1], 30_000, axis=0) for name in CLIP_ARRAYS}
    avatar = replace(avatar, clips=(replace(clip, **still),))  # 12 MB of some kilobytes
    with pytest.raises(AvatarError, match="the clips decode to"):
        make_pack(avatar, tmp_path / "a.avatar", QUICK)
    assert not (tmp_path / "a.avatar").exists()
