"""Bounds hold what they say they hold, and are not endless."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import numpy.typing as npt
import pytest

from avatar_export.ops.bounds import bounds
from avatar_runtime.avatar import Avatar, Blendshapes, Group, Rules, SparseRows
from avatar_runtime.checks.avatar import check_avatar
from avatar_runtime.clips import frame_pose
from avatar_runtime.player import Player
from avatar_runtime.pose import Pose, joint_rotation
from avatar_runtime.stages.activate import Splats
from tests.avatars import COUNT, GROUPS, JOINTS, LATE_MORPHS, full_avatar, surface_avatar

PARTS = ("joints", "geometry", "correctives", "late_morphs", "joint_basis")
SURFACES = {
    "splatting_avatar": Rules("vertex_quaternion", scale="none"),  # log_area's growth is an estimate
    "gaussian_avatars": Rules("triangle_frame", position="triangle_frame", scale="triangle_linear"),
    "psavatar": Rules("bary_vertex_lbs", position="interpolated_normal"),
}
SLACK = 1e-6  # metres; float32 of positions and of the stored box


def corners(splats: Splats) -> npt.NDArray[np.float64]:
    """[N, 3] half-sizes of the boxes around three standard deviations, by quaternion sandwich."""
    w, v = splats.quat_wxyz[:, :1].astype(np.float64), splats.quat_wxyz[:, 1:].astype(np.float64)
    squares = np.zeros((len(w), 3))
    for axis in range(3):
        e = np.eye(3)[axis] * splats.scale[:, axis, None]
        t = 2 * np.cross(v, e)
        squares += (e + w * t + np.cross(v, t)) ** 2
    return 3 * np.sqrt(squares)


def overhang(splats: Splats, box: dict[str, list[float]]) -> float:
    """How far the splats reach out of the box, metres; negative inside."""
    half = corners(splats)
    out = np.maximum(np.array(box["min"]) - (splats.mean - half), splats.mean + half - np.array(box["max"]))
    return float(out.max())


def assert_inside(avatar: Avatar, poses: list[Pose]) -> None:
    box, player = bounds(avatar)["swept"], Player(avatar)
    for pose in poses:
        assert overhang(player.animate(pose), box) <= SLACK, pose


def scaled(sparse: SparseRows, factor: float) -> SparseRows:
    return replace(sparse, values={k: v * np.float32(factor) for k, v in sparse.values.items()})


def lean(part: str, group: Group) -> Avatar:
    """The full avatar as one group of tiny splats, moved by joints and, thirtyfold, by one part only.

    Slack of one part or group then cannot hide that another was forgotten.
    """
    avatar = full_avatar()
    assert avatar.rig is not None
    b, rig = avatar.blendshapes, avatar.rig
    on = {name: 30.0 * (name == part) for name in (*PARTS, "appearance")}
    parts = ("geometry", "appearance", "correctives", "late_morphs")
    moves = {"morphs": "geometry", "correctives": "correctives", "late_morphs": "late_morphs"}
    moved = {name: scaled(getattr(rig, name), on[by]) for name, by in moves.items()}
    made = replace(
        avatar,
        gaussians=replace(avatar.gaussians, log_scale=avatar.gaussians.log_scale - 5),
        clips=(),
        groups=(replace(group, first=0, count=COUNT),),
        blendshapes=Blendshapes(**{name: scaled(getattr(b, name), on[name]) for name in parts}),
        rig=replace(rig, **moved, joint_basis=rig.joint_basis * np.float32(on["joint_basis"])),
    )
    return check_avatar(made)


def poses(avatar: Avatar, seed: int, alone: bool, count: int = 60) -> list[Pose]:
    """Random weights up to the ends of their ranges, one joint turned by up to 30 degrees about any axis."""
    rng = np.random.default_rng(seed)
    found = []
    for _ in range(count):
        ranges = {e.name: e.range for e in avatar.expressions}
        weights = {name: float(rng.choice([*r, rng.uniform(*sorted(r))])) for name, r in ranges.items()}
        if alone:
            name = str(rng.choice(list(weights)))
            weights = {name: weights[name]}
        axis = rng.normal(size=3)
        angle = np.radians(30) * rng.choice([1, rng.uniform()])
        turn = joint_rotation(axis / np.linalg.norm(axis) * angle)
        lids = {name: float(rng.choice([0, 1, rng.uniform()])) for name in LATE_MORPHS}
        found.append(Pose(weights, {str(rng.choice(JOINTS)): turn}, lids))
    return found


@pytest.mark.parametrize("seed", range(3))
def test_the_avatar_at_rest_fills_its_box_at_rest(seed: int) -> None:
    avatar = full_avatar(seed)
    box, splats = bounds(avatar)["rest"], Player(avatar).animate(Pose())
    half = corners(splats)
    assert np.allclose(box["min"], (splats.mean - half).min(axis=0), rtol=0, atol=SLACK)
    assert np.allclose(box["max"], (splats.mean + half).max(axis=0), rtol=0, atol=SLACK)


@pytest.mark.parametrize("group", GROUPS, ids=lambda group: group.binding)
@pytest.mark.parametrize("part", PARTS)
def test_any_pose_stays_inside_the_swept_box(part: str, group: Group) -> None:
    avatar = lean(part, group)
    assert_inside(avatar, poses(avatar, len(part), alone=False))


def test_splats_that_grow_stay_inside() -> None:
    avatar = lean("appearance", GROUPS[-1])
    assert_inside(avatar, [replace(pose, joints={}) for pose in poses(avatar, 1, alone=True)])


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("system", [None, *SURFACES])
def test_everything_on_stays_inside(seed: int, system: str | None) -> None:
    avatar = replace(surface_avatar(seed, SURFACES[system]), clips=()) if system else full_avatar(seed)
    assert_inside(avatar, poses(avatar, seed, alone=system is None))


@pytest.mark.parametrize("avatar", [full_avatar(), surface_avatar()], ids=["skin", "surface"])
def test_every_frame_of_a_short_clip_is_inside(avatar: Avatar) -> None:
    clip = avatar.clips[0]
    moved = clip.joint_delta.copy()
    moved[-1, 0, 0, 3] += 1.0
    avatar = replace(avatar, clips=(replace(clip, joint_delta=moved),))
    box = bounds(avatar)["swept"]
    assert max(box["max"]) > 0.5 or min(box["min"]) < -0.5
    frames = [frame_pose(avatar, avatar.clips[0], frame) for frame in range(clip.frames)]
    assert_inside(avatar, [replace(pose, world_from_avatar=np.eye(4)) for pose in frames])


def test_without_a_rig_nobody_knows_how_the_mesh_moves() -> None:
    assert_inside(surface_avatar(rigged=False), [Pose()])
