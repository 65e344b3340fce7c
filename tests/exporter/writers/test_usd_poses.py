"""rig.usdc in motion: what UsdSkel makes of poses and clips, against float64 NumPy."""

from __future__ import annotations

from dataclasses import fields, replace
from typing import Any

import numpy as np
import pytest
from pxr import Sdf, UsdGeom, UsdSkel

from avatar_export.writers.table import Export
from avatar_export.writers.usd.stage import CLIPS, ROOT, SKELETON, SPLATS, WORLD, rig_usdc
from avatar_runtime.avatar import Avatar
from avatar_runtime.engine_pose import EnginePose, engine_clip, engine_pose
from avatar_runtime.io.errors import AvatarError
from avatar_runtime.pose import Pose, joint_rotation
from tests.avatars import full_avatar, surface_avatar
from tests.exporter.writers.stages import ends, written
from tests.measured import Measure
from tests.oracles.usd_pose import baked_by_usd, posed_by_formula, posed_by_usd, set_pose, vertex_ids
from tests.rigs import rig_of, with_rig

AGREE = 1e-5  # of the mesh's height


def error(avatar: Avatar, stage: Any, got: Any, pose: EnginePose) -> float:
    """Largest distance along an axis, as part of the mesh's height."""
    expected = posed_by_formula(avatar, pose)[vertex_ids(stage)]
    return float(np.abs(got - expected).max() / np.ptp(rig_of(avatar).vertices[:, 1]))


def random_pose(avatar: Avatar, rng: np.random.Generator) -> Pose:
    def turn() -> Any:
        axis = rng.standard_normal(3)
        return joint_rotation(axis / np.linalg.norm(axis) * np.radians(rng.uniform(0, 40)))

    world = turn()
    world[:3, 3] = rng.normal(0, 0.1, 3)
    return Pose(
        {name: rng.uniform(-0.3, 1.2) for name in avatar.expression_names},
        {name: turn() for name in rig_of(avatar).joint_names},
        {name: rng.uniform(-0.3, 1.2) for name in avatar.eyelids},
        world,
    )


@pytest.mark.parametrize(
    "avatar", [full_avatar(), full_avatar(3), surface_avatar()], ids=["0", "3", "surface"]
)
def test_usd_skel_poses_the_mesh_as_engine_pose_says(avatar: Avatar, measured: Measure) -> None:
    stage, rng = written(avatar), np.random.default_rng(11)
    assert np.diff(rig_of(avatar).skin.row_ptr.astype(int)).max() == 5
    for _ in range(12):
        pose = engine_pose(avatar, random_pose(avatar, rng))
        set_pose(stage, pose)
        worst = error(avatar, stage, posed_by_usd(stage, 0), pose)
        measured("rig.usdc posed by UsdSkel against engine_pose, of height", worst, AGREE)
        assert worst <= AGREE
    assert error(avatar, stage, baked_by_usd(stage, 0), pose) <= AGREE


def test_clips_play_in_the_first_one_s_time(measured: Measure) -> None:
    avatar = full_avatar()
    stage = written(avatar)
    first, second = avatar.clips
    assert stage.GetTimeCodesPerSecond() == stage.GetFramesPerSecond() == first.fps == 24
    assert (stage.GetStartTimeCode(), stage.GetEndTimeCode()) == (0, first.frames - 1)
    world = UsdGeom.Xformable(stage.GetPrimAtPath(WORLD))
    for clip in (first, second):
        source = UsdSkel.BindingAPI(stage.GetPrimAtPath(SKELETON)).GetAnimationSourceRel()
        if clip is second:  # as the stage's documentation says
            source.SetTargets([Sdf.Path(f"{CLIPS}/{clip.name}")])
            names = [f"xformOp:translate:{clip.name}", f"xformOp:orient:{clip.name}"]
            world.SetXformOpOrder([UsdGeom.XformOp(world.GetPrim().GetAttribute(name)) for name in names])
        poses = engine_clip(avatar, clip)
        for frame in range(clip.frames):
            time = frame * first.fps / clip.fps
            worst = error(
                avatar,
                stage,
                posed_by_usd(stage, time),
                EnginePose(*(getattr(poses, field.name)[frame] for field in fields(EnginePose))),
            )
            measured("rig.usdc clip frames against engine_clip, of height", worst, AGREE)
            assert worst <= AGREE


def test_scales_are_half_floats(measured: Measure) -> None:
    avatar, limit = full_avatar(), 2.0**-11
    stage = written(avatar)
    pose = engine_pose(avatar, Pose(joints={"jaw": np.diag([1.1003, 0.9, 1.0, 1.0])}))
    set_pose(stage, pose)
    worst = error(avatar, stage, posed_by_usd(stage, 0), pose)
    name = "rig.usdc with a joint scaled by a tenth (USD's scales are half floats), of height"
    measured(name, worst, limit)
    assert worst <= limit
    large = np.float32([1e5, 1e5, 1e5, 1])
    clips = tuple(replace(clip, joint_delta=clip.joint_delta * large) for clip in avatar.clips)
    with pytest.raises(AvatarError, match=r"rig\.usdc: joint scale: .* half floats"):
        _ = Export(replace(avatar, clips=clips)).usdc


@pytest.mark.parametrize("moving", ["joints", "shapes", "whole"])
def test_the_box_of_the_stage_holds_all_that_it_shows(moving: str) -> None:
    clip = full_avatar().clips[0]
    world = np.tile(np.eye(4, dtype=np.float32), (clip.frames, 1, 1))
    world[:, 2, 3] = np.linspace(0, 3, clip.frames)
    turning, still = clip.joint_delta.copy(), np.zeros_like(clip.joint_delta) + np.eye(4, dtype=np.float32)
    turning[:, 0] = [joint_rotation((0, 0, angle)) for angle in np.linspace(0, 2, clip.frames)]
    wide = np.full_like(clip.expression_weights, 40)
    clip = {
        "joints": replace(clip, joint_delta=turning),
        "shapes": replace(clip, expression_weights=wide, joint_delta=still),
        "whole": replace(clip, world_from_avatar=world),
    }[moving]
    away = rig_of(full_avatar()).vertices + np.float32([1, 0, 0])  # of the joints
    avatar = replace(with_rig(full_avatar(), vertices=away), clips=(clip,))
    stage = written(avatar)
    low, high = np.array(UsdGeom.Boundable.Get(stage, ROOT).GetExtentAttr().Get(), np.float64)
    shown = []
    for time in range(clip.frames):
        moved = np.array(UsdGeom.XformCache(time).GetLocalToWorldTransform(stage.GetPrimAtPath(SPLATS)))
        shown += [posed_by_usd(stage, time), ends(avatar) @ moved[:3, :3] + moved[3, :3]]
    points = np.concatenate(shown)
    assert (low <= points.min(axis=0)).all() and (points.max(axis=0) <= high).all()
    assert (high - low < 2 * np.ptp(points, axis=0)).all()


def test_rates_that_leave_no_time_codes_are_refused() -> None:
    avatar = full_avatar()
    clips = (replace(avatar.clips[0], fps=1e300), replace(avatar.clips[1], fps=1e-300))
    with pytest.raises(AvatarError, match="resample"):
        rig_usdc(replace(avatar, clips=clips))
