"""What the tests of backend `gl` share: contexts, avatars under every rule, golden inputs of every stage."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from typing import Any

import numpy as np

from avatar_runtime.avatar import Avatar, Rules
from avatar_runtime.backends.gl import GlBackend
from avatar_runtime.backends.reference import ReferenceBackend
from avatar_runtime.camera import Camera
from avatar_runtime.clips import frame_pose
from avatar_runtime.player import Player
from avatar_runtime.pose import Pose
from avatar_runtime.posed import Clock, Posed
from avatar_runtime.rules import QUATERNION_SIGNS, SH_DIRECTIONS, SKIN_ROTATIONS, SURFACE_RULES
from tests.avatars import full_avatar, surface_avatar
from tests.measured import Measure

Arrays = dict[str, Any]
BACKGROUND = np.array([0.25, 0.5, 1.0], np.float32)
SIZE = (200, 160)
STAGE_LIMIT, RASTER_LIMIT, IMAGE_LIMIT = 1e-5, 2e-6, 1 / 255
FLOORS = {"rgb": 0.5}  # the constant that SH colours are added to; a colour near 0 is what cancels with it


def camera(distance: float = 0.6) -> Camera:
    """Oblique, not square, with a skew and a principal point beside the centre."""
    seen = Camera.orbit(np.zeros(3), distance, 0.4, 0.2, 0.7, *SIZE)
    k = np.array([[250.0, 3.0, 90.0], [0.0, 240.0, 85.0], [0.0, 0.0, 1.0]])
    rotation = seen.camera_from_world[:3, :3].astype(np.float64)
    return Camera.from_opencv(rotation, seen.camera_from_world[:3, 3], k, *SIZE)


def avatars() -> dict[str, Avatar]:
    """One avatar for every rule that a kernel knows."""
    full = full_avatar(3)
    made = {"full": full}
    for rotation in SKIN_ROTATIONS:
        for direction in SH_DIRECTIONS:
            rules = replace(full.rules, rotation=rotation, rotation_joint="neck", sh_direction=direction)
            made[f"skin {rotation} {direction}"] = replace(full, rules=rules)
    for rotation, position, scale in SURFACE_RULES:
        by_code = (rotation, position) == ("vertex_quaternion", "normal")
        for sign in QUATERNION_SIGNS if by_code else QUATERNION_SIGNS[:1]:
            rules = Rules(rotation, position=position, scale=scale, quaternion_sign=sign)
            made[f"surface {rotation} {position} {scale} {sign}"] = surface_avatar(3, rules)
    seen = Rules("vertex_quaternion", scale="log_area", sh_direction="world")
    made["surface world"] = surface_avatar(3, seen)
    made["surface without a rig"] = surface_avatar(3, rigged=False)
    for degree in (0, 1, 3):
        made[f"sh degree {degree}"] = replace(full, sh_degree=degree)
    return made


def pose_of(avatar: Avatar) -> Pose:
    """A frame of its clip, or of a rigless avatar the place of one."""
    if avatar.clips:
        return frame_pose(avatar, avatar.clips[0], 2)
    other = full_avatar(3)
    return Pose(world_from_avatar=other.clips[0].world_from_avatar[2].astype(np.float64))


def stage_inputs(avatar: Avatar, seen: Camera, pose: Pose | None = None) -> dict[str, tuple[Arrays, Arrays]]:
    """{stage: (inputs, outputs)} of one frame on the reference."""
    player = Player(avatar, "reference")
    assert isinstance(player.backend, ReferenceBackend)
    posed = player.posed(pose or pose_of(avatar))
    found: dict[str, tuple[Arrays, Arrays]] = {}
    known: Arrays = {
        **{name: getattr(posed, name) for name in ("expression_weights", "late_weights", "pose_feature")},
        "skin_matrix": posed.skin_matrix,
        "group_matrix": posed.groups.matrix,
        "group_rotation": posed.groups.rotation,
        "world_from_avatar": posed.world_from_avatar,
        "background": BACKGROUND,
    }
    if avatar.embedding is not None:
        known["posed_vertices"] = avatar.embedding.canonical_vertices
    for stage in ("morph", "skin", "blend", "bind", "activate", "project", "sort", "raster"):
        if stage in ("morph", "skin") and avatar.rig is None:
            continue
        inputs = dict(known)
        outputs = player.backend.stage(stage, inputs, seen, "engine")
        found[stage] = inputs, outputs
        known |= outputs
        known.setdefault("sh", avatar.gaussians.sh)
    return found


def posed_of(backend: GlBackend) -> Posed:
    """`pose_of` its avatar as a backend takes it."""
    return Player(backend.avatar, "reference").posed(pose_of(backend.avatar))


def reference_image(avatar: Avatar, seen: Camera) -> Any:
    """The reference's image in profile engine."""
    reference = ReferenceBackend(avatar)
    posed = Player(avatar, "reference").posed(pose_of(avatar))
    return reference.frame(posed, seen, BACKGROUND, "engine", Clock())


@contextmanager
def backend(avatar: Avatar, **options: Any) -> Iterator[GlBackend]:
    """A backend that gives everything back."""
    made = GlBackend(avatar, **options)
    try:
        yield made
    finally:
        made.release()


def check_stage(stage: str, got: Arrays, want: Arrays, measured: Measure) -> None:
    """Outputs of one stage alone: 1e-5 relative, an image 2e-6 absolute, integers equal."""
    assert got.keys() == want.keys(), stage
    for array, expected in want.items():
        what, found = f"{stage} {array}", got[array]
        assert found.dtype == expected.dtype and found.shape == expected.shape, what
        if expected.dtype.kind == "i":
            np.testing.assert_array_equal(found, expected, what)
        elif stage == "raster":
            worst = float(np.abs(found - expected).max())
            measured("gl raster fed golden splats, absolute", worst, RASTER_LIMIT)
            assert worst <= RASTER_LIMIT, what
        else:
            worst = relative(found, expected, FLOORS.get(array, 0.0))
            measured(f"gl stage {stage}, relative", worst, STAGE_LIMIT)
            assert worst <= STAGE_LIMIT, what


def relative(got: Any, want: Any, floor: float = 0.0) -> float:
    """The largest difference, as a part of the largest value of its row, or of `floor` where that is larger."""
    a, b = np.asarray(got, np.float64), np.asarray(want, np.float64)
    assert a.shape == b.shape
    if a.size == 0:
        return 0.0
    rows = np.abs(b).reshape(len(b), -1).max(axis=1)
    scale = np.maximum(rows, floor).reshape(-1, *[1] * (b.ndim - 1))
    difference = np.abs(a - b)
    return float(np.max(np.divide(difference, scale, out=difference.copy(), where=scale > 0)))
