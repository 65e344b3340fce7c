"""rig.usdc at rest: its schema and values against the avatar's own arrays."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pxr import Sdf, Usd, UsdGeom, UsdSkel, UsdValidation, UsdVol

from avatar_export.ops.vertex_colour import linear_from_display, vertex_colours
from avatar_export.writers.usd.checks import usd_problems
from avatar_export.writers.usd.layer import leads_outside, open_layer
from avatar_export.writers.usd.mesh import influences
from avatar_export.writers.usd.stage import CLIPS, MESH, ROOT, SKELETON, SPLATS, WORLD, rig_usdc
from avatar_export.writers.usd.values import prim_names
from avatar_runtime.avatar import Avatar, SparseRows
from avatar_runtime.engine_pose import target_names
from avatar_runtime.io.errors import AvatarError
from tests.avatars import full_avatar, surface_avatar
from tests.exporter.writers.stages import ends, unit, written
from tests.oracles.usd_pose import (
    vertex_ids,
)
from tests.rigs import rig_of, with_rig


def test_rest_transforms_are_local_and_bind_transforms_of_the_mesh() -> None:
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


def test_splats_are_the_gaussians() -> None:
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


def test_absurd_gaussians_stay_finite() -> None:
    g = full_avatar().gaussians
    log_scale, quat = g.log_scale.copy(), g.quat_wxyz.copy()
    log_scale[3], quat[4] = 200, 0
    avatar = replace(full_avatar(), gaussians=replace(g, log_scale=log_scale, quat_wxyz=quat))
    stage = written(avatar)
    splats = UsdVol.ParticleField3DGaussianSplat.Get(stage, SPLATS)
    assert np.isfinite(splats.GetScalesAttr().Get()).all() and np.isfinite(splats.GetExtentAttr().Get()).all()
    assert splats.GetOrientationsAttr().Get()[4].GetReal() == 1
    assert usd_problems(rig_usdc(avatar)) == []


def test_the_mesh_keeps_numbers_and_names() -> None:
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
    u, v = np.array(UsdGeom.PrimvarsAPI(mesh).GetPrimvar("st").Get()).T
    assert np.array_equal(u + 256 * (v - 2), ids)
    colour = linear_from_display(vertex_colours(loose, rig_of(loose)))[ids]
    np.testing.assert_allclose(mesh.GetDisplayColorAttr().Get(), colour, rtol=1e-6)
    assert mesh.GetDisplayColorPrimvar().GetInterpolation() == "vertex"
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


def test_strange_names_become_identifiers_and_stay_known() -> None:
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


def test_without_joints_or_triangles() -> None:
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
