"""Avatars whose numbers overflow: packed and read again, or refused before a file is there."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from avatar_export.checks.pack import validate_pack
from avatar_export.packing.choices import Choices
from avatar_export.packing.make import make_pack
from avatar_runtime.avatar import Avatar
from avatar_runtime.bundle import load
from avatar_runtime.io.errors import AvatarError
from tests.avatars import full_avatar

QUICK = Choices(preview=False)


@pytest.fixture(autouse=True)
def small_images(monkeypatch: pytest.MonkeyPatch) -> None:
    """What packs are measured by, which is not what is tested here."""
    monkeypatch.setattr("avatar_export.packing.make.SIZE", 64)


def far() -> Avatar:
    avatar = full_avatar()
    assert avatar.rig is not None
    vertices = np.sign(avatar.rig.vertices) * np.float32(3.4e38)
    return replace(avatar, rig=replace(avatar.rig, vertices=vertices))


def wild_clip() -> Avatar:
    avatar = full_avatar()
    delta = avatar.clips[0].joint_delta.copy()
    delta[:, 1, :3, :3] *= np.float32(1e30)
    return replace(avatar, clips=(replace(avatar.clips[0], joint_delta=delta),))


def with_gaussians(**given: Any) -> Avatar:
    avatar = full_avatar()
    return replace(avatar, gaussians=replace(avatar.gaussians, **given))


def test_what_overflows_in_a_pose_is_packed(tmp_path: Path) -> None:
    make_pack(wild_clip(), tmp_path / "x.avatar", QUICK)
    assert load(tmp_path / "x.avatar").gaussians.count == 48
    assert [problem for problem in validate_pack(tmp_path / "x.avatar") if not problem.warning] == []


def test_what_no_reader_would_take_is_not_written(tmp_path: Path) -> None:
    sh = np.sign(full_avatar().gaussians.sh) * np.float32(1e38)
    with pytest.raises(AvatarError, match=r"^Full Ävatar: .*base_sh_scale: holds a float"):
        make_pack(with_gaussians(sh=sh), tmp_path / "x.avatar", QUICK)
    assert list(tmp_path.iterdir()) == []
    with pytest.raises(AvatarError, match=r"^Full Ävatar: .*template_position_scale: holds a float"):
        make_pack(far(), tmp_path / "x.avatar", QUICK)
    assert list(tmp_path.iterdir()) == []
    mean = full_avatar().gaussians.mean * np.float32(1e15)
    with pytest.raises(AvatarError, match=r"^reference: cannot be made"):
        make_pack(with_gaussians(mean=mean), tmp_path / "x.avatar", QUICK, reference=True)
    assert list(tmp_path.iterdir()) == []
