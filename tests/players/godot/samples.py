"""The trained samples, and LAM's own avatar where it is: packs, poses and cameras for Godot's pictures."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from bench.pack_avatars import AVATARS

from avatar_export import read
from avatar_export.measure.poses import poses
from avatar_export.measure.views import views
from avatar_export.ops.active_sh import with_active_sh
from avatar_export.packing.steps import Fineness
from avatar_export.packing.write import pack
from avatar_runtime.avatar import Avatar
from avatar_runtime.camera import Camera
from avatar_runtime.packs import decode_pack
from avatar_runtime.pose import Pose
from tests.shared_data import shared

LAM = "lam"
SAMPLES = ("head_blendshapes", "head_splatting", "body_splatting", "head_points", "asm_face", LAM)


@dataclass(frozen=True)
class Sample:
    """An avatar as its pack holds it."""

    file: Path
    avatar: Avatar
    poses: list[Pose]
    cameras: list[Camera]


def write_pack(name: str, folder: Path) -> Path:
    """A pack of a sample. Skips the test where LAM's avatar is not."""
    source = read(shared("lam/p2-1.zip")) if name == LAM else AVATARS[name].load(folder)
    file = folder / f"{name}.avatar"
    file.write_bytes(pack([with_active_sh(source)], Fineness()).file)
    return file


def there(names: tuple[str, ...] = SAMPLES) -> list[str]:
    """The samples that this machine has."""
    try:
        shared("lam/p2-1.zip")
    except pytest.skip.Exception:
        return [name for name in names if name != LAM]
    return list(names)


@cache
def sample(file: Path, count: int, size: int) -> Sample:
    """The avatar of a pack with `count` poses, and three cameras of square images."""
    avatar = decode_pack(file.read_bytes(), file.name).avatar
    shown = poses(avatar, count)
    cameras = [view.camera for view in views(avatar, size, shown)]
    return Sample(file, avatar, [rounded(named.pose) for named in shown], cameras)


def rounded(pose: Pose) -> Pose:
    """The pose as Godot can hold it: its matrices have float32."""
    return replace(pose, joints={name: delta.astype(np.float32) for name, delta in pose.joints.items()})
