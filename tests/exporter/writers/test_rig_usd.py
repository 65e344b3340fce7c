"""rig.usdc: what UsdSkel and the schema say of it, against the avatar's own arrays."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pxr import Sdf, Usd, UsdGeom, UsdSkel, UsdValidation, UsdVol

from avatar_export.writers.usd.checks import usd_problems
from avatar_export.writers.usd.layer import leads_outside, open_layer
from avatar_export.writers.usd.mesh import influences
from avatar_export.writers.usd.stage import CLIPS, MESH, ROOT, SKELETON, SPLATS, WORLD, rig_usdc
from avatar_export.writers.usd.values import prim_names
from avatar_runtime.avatar import Avatar, Clip, Rig, SparseRows
from avatar_runtime.engine_pose import EnginePose, engine_clip, engine_pose, target_names
from avatar_runtime.errors import AvatarError
from avatar_runtime.pose import Pose, joint_rotation
from tests.avatars import full_avatar, surface_avatar
from tests.measured import Measure
from tests.oracles.usd_pose import (
    baked_by_usd,
    posed_by_formula,
    posed_by_usd,
    set_pose,
    stage_of,
    vertex_ids,
)

AGREE = 1e-5  # of the mesh's height
FRAME = ("root_translation", "root_rotation_xyzw", "translation", "rotation_xyzw", "scale", "weights")
Written = Callable[[Avatar], Any]


@pytest.fixture
def written(tmp_path: Path) -> Written:
    """A stage that may be edited, of what is written for an avatar."""

    def write(avatar: Avatar) -> Any:
        file = tmp_path / "rig.usdc"
        file.write_bytes(rig_usdc(avatar))
        return stage_of(str(file))

    return write


def rig_of(avatar: Avatar) -> Rig:
    assert avatar.rig is not None
    return avatar.rig


def with_rig(avatar: Avatar, **fields: Any) -> Avatar:
    return replace(avatar, rig=replace(rig_of(avatar), **fields))


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
        {name: rng.uniform(-0.3, 1.2) for name in avatar.late_morph_names},
        world,
    )


def frame_of(clip: EnginePose, frame: int) -> EnginePose:
    return EnginePose(**{name: getattr(clip, name)[frame] for name in FRAME})


@pytest.mark.parametrize(
    "avatar", [full_avatar(), full_avatar(3), surface_avatar()], ids=["0", "3", "surface"]
)
def test_usd_skel_poses_the_mesh_as_engine_pose_says(
    avatar: Avatar, written: Written, measured: Measure
) -> None:
    stage, rng = written(avatar), np.random.default_rng(11)
    assert np.diff(rig_of(avatar).skin.row_ptr.astype(int)).max() == 5
    for _ in range(12):
        pose = engine_pose(avatar, random_pose(avatar, rng))
        set_pose(stage, pose)
        worst = error(avatar, stage, posed_by_usd(stage, 0), pose)
        measured("rig.usdc posed by UsdSkel against engine_pose, of height", worst)
        assert worst <= AGREE
    assert error(avatar, stage, baked_by_usd(stage, 0), pose) <= AGREE


def test_at_rest_nothing_moves(written: Written) -> None:
    avatar = replace(full_avatar(), clips=())
    stage = written(avatar)
    still = rig_of(avatar).vertices[vertex_ids(stage)]
    np.testing.assert_allclose(posed_by_usd(stage, 0), still, rtol=0, atol=1e-7)
    animation = UsdSkel.Animation.Get(stage, f"{CLIPS}/rest")
    assert not any(attribute.GetTimeSamples() for attribute in animation.GetPrim().GetAttributes())
    assert not UsdGeom.Xformable(stage.GetPrimAtPath(WORLD)).GetOrderedXformOps()


def test_clips_play_in_the_first_one_s_time(written: Written, measured: Measure) -> None:
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
            worst = error(avatar, stage, posed_by_usd(stage, time), frame_of(poses, frame))
            measured("rig.usdc clip frames against engine_clip, of height", worst)
            assert worst <= AGREE


def test_rotations_do_not_jump_and_what_stands_still_has_no_samples(written: Written) -> None:
    avatar = full_avatar()
    spin = np.stack([joint_rotation((0, angle, 0)) for angle in np.linspace(0, 2 * np.pi, 9)])
    delta = np.tile(np.eye(4), (9, rig_of(avatar).joint_count, 1, 1))
    delta[:, 0] = spin
    clip = Clip(
        "spin",
        30.0,
        np.zeros((9, len(avatar.expressions)), np.float32),
        np.zeros((9, len(avatar.late_morph_names)), np.float32),
        delta.astype(np.float32),
        spin.astype(np.float32),
    )
    stage = written(replace(avatar, clips=(clip,)))
    animation = UsdSkel.Animation.Get(stage, f"{CLIPS}/spin")
    rotations = animation.GetRotationsAttr()
    turns = [np.array(rotations.Get(time)) for time in rotations.GetTimeSamples()]
    assert len(turns) == 9
    assert all((np.sum(a * b, axis=1) > 0).all() for a, b in pairwise(turns))
    world = stage.GetPrimAtPath(WORLD).GetAttribute("xformOp:orient:spin")
    whole = [world.Get(time) for time in world.GetTimeSamples()]
    assert all(
        a.GetReal() * b.GetReal() + a.GetImaginary() * b.GetImaginary() > 0 for a, b in pairwise(whole)
    )
    assert not animation.GetBlendShapeWeightsAttr().GetTimeSamples()
    assert len(animation.GetBlendShapeWeightsAttr().Get()) == len(target_names(avatar))
    assert not stage.GetPrimAtPath(WORLD).GetAttribute("xformOp:translate:spin").GetTimeSamples()


def test_rest_transforms_are_local_and_bind_transforms_of_the_mesh(written: Written) -> None:
    rig = rig_of(full_avatar())
    stage = written(full_avatar())
    skeleton = UsdSkel.Skeleton.Get(stage, SKELETON)
    rest, bind = (
        [np.array(matrix).T for matrix in attribute.Get()]
        for attribute in (skeleton.GetRestTransformsAttr(), skeleton.GetBindTransformsAttr())
    )
    for joint, parent in enumerate(rig.parents):
        expected = rest[joint] if parent < 0 else bind[parent] @ rest[joint]
        np.testing.assert_allclose(bind[joint], expected, rtol=0, atol=1e-12)
        np.testing.assert_allclose(
            bind[joint], np.linalg.inv(rig.inverse_bind_matrix[joint]), rtol=0, atol=1e-6
        )


@pytest.mark.parametrize("moving", ["joints", "shapes", "whole"])
def test_the_box_of_the_stage_holds_all_that_it_shows(moving: str, written: Written) -> None:
    clip = full_avatar().clips[0]
    frames, identity = clip.frames, np.eye(4, dtype=np.float32)
    world = np.tile(identity, (frames, 1, 1))
    world[:, 2, 3] = np.linspace(0, 3, frames)
    clip = {
        "joints": clip,
        "shapes": replace(
            clip,
            expression_weights=np.full_like(clip.expression_weights, 40),
            joint_delta=np.broadcast_to(identity, clip.joint_delta.shape).copy(),
        ),
        "whole": replace(clip, world_from_avatar=world),
    }[moving]
    avatar = replace(full_avatar(), clips=(clip,))
    stage = written(avatar)
    low, high = np.array(UsdGeom.Boundable.Get(stage, ROOT).GetExtentAttr().Get(), np.float64)
    shown = []
    for time in range(frames):
        shown.append(posed_by_usd(stage, time))
        moved = UsdGeom.XformCache(time).GetLocalToWorldTransform(stage.GetPrimAtPath(SPLATS))
        shown.append(ends(avatar) @ np.array(moved)[:3, :3] + np.array(moved)[3, :3])
    points = np.concatenate(shown)
    assert (low <= points.min(axis=0)).all() and (points.max(axis=0) <= high).all()
    assert (high - low < 2 * np.ptp(points, axis=0)).all()


def ends(avatar: Avatar) -> Any:
    """Both ends of every Gaussian's axes at three standard deviations."""
    g, found = avatar.gaussians, []
    for mean, log_scale, (w, x, y, z) in zip(g.mean, g.log_scale, unit(g.quat_wxyz), strict=True):
        axes = np.array(
            [
                [1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)],
                [2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x)],
                [2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)],
            ]
        )
        reach = 3 * np.exp(log_scale.astype(np.float64))[:, None] * axes
        found += [mean + reach, mean - reach]
    return np.concatenate(found)


def unit(quat: Any) -> Any:
    return quat / np.linalg.norm(quat.astype(np.float64), axis=1, keepdims=True)


def test_splats_are_the_gaussians(written: Written) -> None:
    avatar = full_avatar()
    stage, g = written(avatar), avatar.gaussians
    splats = UsdVol.ParticleField3DGaussianSplat.Get(stage, SPLATS)
    assert np.array_equal(splats.GetPositionsAttr().Get(), g.mean)
    np.testing.assert_allclose(
        splats.GetScalesAttr().Get(), np.exp(g.log_scale.astype(np.float64)), rtol=1e-6
    )
    np.testing.assert_allclose(
        splats.GetOpacitiesAttr().Get(), 1 / (1 + np.exp(-g.opacity_logit.astype(np.float64))), rtol=1e-6
    )
    turns = [[q.GetReal(), *q.GetImaginary()] for q in splats.GetOrientationsAttr().Get()]
    np.testing.assert_allclose(turns, unit(g.quat_wxyz), rtol=0, atol=1e-7)
    assert avatar.sh_degree == splats.GetRadianceSphericalHarmonicsDegreeAttr().Get() == 2
    harmonics = np.array(splats.GetRadianceSphericalHarmonicsCoefficientsAttr().Get())
    assert np.array_equal(harmonics.reshape(-1, 9, 3), g.sh[:, :9])
    low, high = splats.GetExtentAttr().Get()
    points = ends(avatar)
    assert (points >= np.array(low) - 1e-7).all() and (points <= np.array(high) + 1e-7).all()
    assert splats.GetPurposeAttr().Get() == "render"
    assert "skel:animationSource" in splats.GetPrim().GetDocumentation()
    assert [str(path) for path in UsdGeom.Imageable(splats).GetProxyPrimRel().GetTargets()] == [MESH]


def test_absurd_gaussians_stay_finite(written: Written) -> None:
    g = full_avatar().gaussians
    log_scale, quat = g.log_scale.copy(), g.quat_wxyz.copy()
    log_scale[3], quat[4] = 200, 0
    avatar = replace(full_avatar(), gaussians=replace(g, log_scale=log_scale, quat_wxyz=quat))
    stage = written(avatar)
    splats = UsdVol.ParticleField3DGaussianSplat.Get(stage, SPLATS)
    assert np.isfinite(splats.GetScalesAttr().Get()).all() and np.isfinite(splats.GetExtentAttr().Get()).all()
    assert splats.GetOrientationsAttr().Get()[4].GetReal() == 1
    assert usd_problems(rig_usdc(avatar)) == []


def test_the_mesh_keeps_numbers_and_names(written: Written) -> None:
    avatar = full_avatar()
    rig = rig_of(avatar)
    loose = with_rig(avatar, triangles=rig.triangles[(rig.triangles != 6).all(axis=1)])
    stage = written(loose)
    mesh = UsdGeom.Mesh.Get(stage, MESH)
    ids = vertex_ids(stage)
    assert 6 not in ids and len(ids) == len(rig.vertices) - 1
    assert np.array_equal(mesh.GetPointsAttr().Get(), rig.vertices[ids])
    assert np.array_equal(
        ids[np.array(mesh.GetFaceVertexIndicesAttr().Get())], rig_of(loose).triangles.ravel()
    )
    assert mesh.GetSubdivisionSchemeAttr().Get() == "none" and mesh.GetPurposeAttr().Get() == "proxy"
    assert UsdGeom.PrimvarsAPI(mesh).GetPrimvar("avatar:vertexId").GetInterpolation() == "vertex"
    binding = UsdSkel.BindingAPI(mesh)
    assert tuple(binding.GetBlendShapesAttr().Get()) == target_names(avatar)
    assert binding.GetJointIndicesPrimvar().GetElementSize() == 5
    skeleton = UsdSkel.Skeleton.Get(stage, SKELETON)
    assert tuple(skeleton.GetJointsAttr().Get()) == (
        "root",
        "root/neck",
        "root/neck/jaw",
        "root/neck/leftEye",
        "root/neck/rightEye",
    )
    assert tuple(skeleton.GetJointNamesAttr().Get()) == rig.joint_names
    assert UsdGeom.GetStageUpAxis(stage) == "Y" and UsdGeom.GetStageMetersPerUnit(stage) == 1
    assert stage.GetDefaultPrim().GetCustomData()["avatar"].keys() == {"generator", "formatVersion"}
    assert stage.GetDefaultPrim().GetDisplayName() == avatar.name


def test_strange_names_become_identifiers_and_stay_known(written: Written) -> None:
    avatar = full_avatar()
    names = ("rööt", "jaw.L", "jaw_L", "3", "a/b c")
    clips = tuple(replace(clip, name=name) for clip, name in zip(avatar.clips, ("1 ä", "1_ä"), strict=True))
    stage = written(
        replace(
            with_rig(avatar, joint_names=names),
            expressions=tuple(
                replace(e, name=name)
                for e, name in zip(avatar.expressions, ("a b", "a_b", "日", "é"), strict=True)
            ),
            clips=clips,
            rules=replace(avatar.rules, rotation_joint=None),
        )
    )
    skeleton = UsdSkel.Skeleton.Get(stage, SKELETON)
    assert tuple(skeleton.GetJointNamesAttr().Get()) == names
    assert [joint.rpartition("/")[2] for joint in skeleton.GetJointsAttr().Get()] == [
        "r__t",
        "jaw_L",
        "jaw_L_2",
        "_3",
        "a_b_c",
    ]
    binding = UsdSkel.BindingAPI(stage.GetPrimAtPath(MESH))
    assert list(binding.GetBlendShapesAttr().Get())[:4] == ["a b", "a_b", "日", "é"]
    targets = [path.name for path in binding.GetBlendShapeTargetsRel().GetTargets()]
    assert targets[:4] == ["a_b", "a_b_2", "_", "__2"]
    assert [prim.GetName() for prim in stage.GetPrimAtPath(CLIPS).GetChildren()] == ["_1__", "_1___2"]
    assert [prim.GetDisplayName() for prim in stage.GetPrimAtPath(CLIPS).GetChildren()] == ["1 ä", "1_ä"]
    assert prim_names(["", "_"]) == ("_", "__2")


@pytest.mark.parametrize("name", ["a\0b", "\ud800"])
def test_a_name_that_usd_cannot_hold_is_refused(name: str) -> None:
    with pytest.raises(AvatarError, match="rename it"):
        rig_usdc(with_rig(full_avatar(), joint_names=(name, *rig_of(full_avatar()).joint_names[1:])))


def test_scales_are_half_floats(written: Written, measured: Measure) -> None:
    avatar = full_avatar()
    delta = np.diag([1.1003, 0.9, 1.0, 1.0])
    stage = written(avatar)
    pose = engine_pose(avatar, Pose(joints={"jaw": delta}))
    set_pose(stage, pose)
    worst = error(avatar, stage, posed_by_usd(stage, 0), pose)
    measured("rig.usdc with a joint scaled by a tenth (USD's scales are half floats), of height", worst)
    assert worst <= 2.0**-11
    clips = tuple(
        replace(clip, joint_delta=(clip.joint_delta * [1e5, 1e5, 1e5, 1]).astype(np.float32))
        for clip in avatar.clips
    )
    with pytest.raises(AvatarError, match="half floats"):
        rig_usdc(replace(avatar, clips=clips))


def test_rates_that_leave_no_time_codes_are_refused() -> None:
    avatar = full_avatar()
    clips = (replace(avatar.clips[0], fps=1e300), replace(avatar.clips[1], fps=1e-300))
    with pytest.raises(AvatarError, match="resample"):
        rig_usdc(replace(avatar, clips=clips))


def test_without_joints_or_triangles(written: Written) -> None:
    bare = surface_avatar(rigged=False)
    stage = written(bare)
    assert [str(prim.GetPath()) for prim in stage.Traverse()] == [ROOT, WORLD, SPLATS]
    rig = rig_of(full_avatar())
    flat = with_rig(full_avatar(), triangles=rig.triangles[:0])
    stage = written(flat)
    assert stage.GetPrimAtPath(SKELETON) and not stage.GetPrimAtPath(MESH)
    for avatar in (bare, flat):
        assert usd_problems(rig_usdc(avatar)) == []


def test_weights_are_strongest_first_and_sum_to_one() -> None:
    skin = SparseRows(
        np.array([0, 3, 3, 5], np.uint32),
        np.array([0, 2, 4, 1, 3], np.uint16),
        {"weight": np.array([0.1, 0.7, 0.3, -0.5, 0.0], np.float32)},
        5,
    )
    joints, weights = influences(skin)
    assert joints.tolist() == [[2, 4, 0], [0, 0, 0], [0, 0, 0]]
    np.testing.assert_allclose(weights, [[7 / 11, 3 / 11, 1 / 11], [1, 0, 0], [1, 0, 0]], atol=1e-7)


@pytest.mark.parametrize("avatar", [full_avatar(), surface_avatar(rigged=False)], ids=["full", "splats"])
def test_pixar_s_validators_and_ours_are_content(avatar: Avatar, tmp_path: Path) -> None:
    file = tmp_path / "rig.usdc"
    file.write_bytes(rig_usdc(avatar))
    validators = UsdValidation.ValidationRegistry().GetOrLoadAllValidators()
    assert len(validators) >= 20
    errors = UsdValidation.ValidationContext(validators).Validate(Usd.Stage.Open(str(file)))
    assert [found.GetMessage() for found in errors] == []
    assert usd_problems(file.read_bytes()) == []


def test_it_leads_nowhere_and_what_would_is_noticed() -> None:
    data = rig_usdc(full_avatar())
    assert leads_outside(open_layer(data)) == []
    ways: tuple[tuple[str, Callable[[Any, Any], object]], ...] = (
        ("sublayer", lambda layer, root: layer.subLayerPaths.append("./a.usda")),
        ("references", lambda layer, root: root.referenceList.Prepend(Sdf.Reference("a.usda", "/a"))),
        ("payload", lambda layer, root: root.payloadList.Prepend(Sdf.Payload("a.usda", "/a"))),
        ("is an asset", lambda layer, root: Sdf.AttributeSpec(root, "a", Sdf.ValueTypeNames.Asset)),
        ("is an asset", lambda layer, root: Sdf.AttributeSpec(root, "a", Sdf.ValueTypeNames.AssetArray)),
        ("customData", lambda layer, root: root.SetInfo("customData", {"a": {"b": Sdf.AssetPath("a.png")}})),
        ("assetInfo", lambda layer, root: root.SetInfo("assetInfo", {"identifier": Sdf.AssetPath("a.usd")})),
    )
    for name, lead in ways:
        layer = open_layer(data)
        lead(layer, layer.GetPrimAtPath(ROOT))
        assert any(name in where for where in leads_outside(layer)), name


def test_same_bytes_in_every_process(tmp_path: Path) -> None:
    program = (
        "import hashlib, random, sys; from pxr import Sdf; from tests.avatars import full_avatar\n"
        "from avatar_export.writers.usd.stage import rig_usdc\n"
        "before = [Sdf.Path(f'/avatar/x{random.random()}'.replace('.', '_')) for _ in range(int(sys.argv[1]))]\n"
        "print(*{hashlib.sha256(rig_usdc(full_avatar())).hexdigest() for _ in range(3)})"
    )
    digests = set()
    for seed, paths, threads in (("0", "0", "1"), ("77", "4000", "2")):
        environment = {**os.environ, "PYTHONHASHSEED": seed, "PXR_WORK_THREAD_LIMIT": threads}
        command = [sys.executable, "-c", program, paths]
        digests.add(
            subprocess.run(command, env=environment, capture_output=True, check=True, text=True).stdout
        )
    assert len(digests) == 1 and len(digests.pop().split()) == 1
