"""rig.usdc at rest: its schema and values against the avatar's own arrays."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pxr import Sdf, Usd, UsdGeom, UsdSkel, UsdValidation, UsdVol

from avatar_export.ops.vertex_colour import linear_from_display, vertex_colours
from avatar_export.writers.usd.checks import usd_problems
from avatar_export.writers.usd.layer import leads_outside, open_layer
from avatar_export.writers.usd.stage import MESH, ROOT, SKELETON, SPLATS, WORLD, rig_usdc
from avatar_runtime.avatar import Avatar
from avatar_runtime.engine_pose import target_names
from avatar_runtime.io.errors import AvatarError
from tests.avatars import full_avatar, surface_avatar
from tests.exporter.writers.stages import ends, unit, written
from tests.oracles.usd_pose import vertex_ids
from tests.rigs import rig_of, with_rig


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
    below = [f"root/neck/{name}" for name in ("jaw", "leftEye", "rightEye")]
    assert list(skeleton.GetJointsAttr().Get()) == ["root", "root/neck", *below]
    assert tuple(skeleton.GetJointNamesAttr().Get()) == rig.joint_names
    assert UsdGeom.GetStageUpAxis(stage) == "Y" and UsdGeom.GetStageMetersPerUnit(stage) == 1
    assert stage.GetDefaultPrim().GetCustomData()["avatar"].keys() == {"generator", "formatVersion"}
    assert stage.GetDefaultPrim().GetDisplayName() == avatar.name


@pytest.mark.parametrize("name", ["a\0b", "\ud800"])
def test_a_name_that_usd_cannot_hold_is_refused(name: str) -> None:
    with pytest.raises(AvatarError, match="rename it"):
        rig_usdc(with_rig(full_avatar(), joint_names=(name, *rig_of(full_avatar()).joint_names[1:])))


def test_without_joints_or_triangles() -> None:
    bare = surface_avatar(rigged=False)
    stage = written(bare)
    assert [str(prim.GetPath()) for prim in stage.Traverse()] == [ROOT, WORLD, SPLATS]
    flat = with_rig(full_avatar(), triangles=rig_of(full_avatar()).triangles[:0])
    stage = written(flat)
    assert stage.GetPrimAtPath(SKELETON) and not stage.GetPrimAtPath(MESH)
    for avatar in (bare, flat):
        assert usd_problems(rig_usdc(avatar)) == []


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
