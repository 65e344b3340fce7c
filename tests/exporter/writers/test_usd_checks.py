"""Each of our checks of a stage, by breaking one thing that UsdValidation lets pass."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from pxr import Gf, Sdf, Usd, UsdGeom, UsdSkel, UsdVol

from avatar_export.writers.usd.checks import usd_problems
from avatar_export.writers.usd.layer import layer_bytes, open_layer
from avatar_export.writers.usd.stage import CLIPS, MESH, ROOT, SKELETON, SPLATS, rig_usdc
from avatar_runtime.io.errors import AvatarError
from tests.avatars import full_avatar

Break = Callable[[Any], object]
GOOD = rig_usdc(full_avatar())
SHAPE = f"{MESH}/jawOpen"
NOD = f"{CLIPS}/nod"
JOINTS, WEIGHTS = "primvars:skel:jointIndices", "primvars:skel:jointWeights"
SH = "radiance:sphericalHarmonicsCoefficients"


def mesh(stage: Any) -> Any:
    return UsdGeom.Mesh.Get(stage, MESH)


def prim(stage: Any, path: str) -> Any:
    return stage.GetPrimAtPath(path)


def skin(stage: Any, path: str = MESH) -> Any:
    return UsdSkel.BindingAPI(prim(stage, path))


def splats(stage: Any) -> Any:
    return UsdVol.ParticleField3DGaussianSplat.Get(stage, SPLATS)


def change(path: str, name: str, edit: Callable[[Any], object], time: float | None = None) -> Break:

    def apply(stage: Any) -> None:
        attribute = stage.GetPrimAtPath(path).GetAttribute(name)
        code = Usd.TimeCode.Default() if time is None else time
        values = list(attribute.Get(code))
        edit(values)
        attribute.Set(type(attribute.Get(code))(values), code)

    return apply


def drop(values: list[Any]) -> None:
    values.pop()


def put(index: int, value: Any) -> Callable[[list[Any]], None]:
    def edit(values: list[Any]) -> None:
        values[index] = value

    return edit


def append(value: Any) -> Callable[[list[Any]], None]:
    return lambda values: values.append(value)


BROKEN: dict[str, tuple[Break, str]] = {
    "default prim": (lambda s: s.ClearDefaultPrim(), "/: has no default prim"),
    "extent": (change(MESH, "extent", lambda v: v.reverse()), f"{MESH}: extent is not a box"),
    "no extent": (lambda s: mesh(s).GetExtentAttr().Clear(), f"{MESH}: extent is not a box"),
    "splats' extent": (lambda s: splats(s).GetExtentAttr().Clear(), f"{SPLATS}: extent is not a box"),
    "face counts": (change(MESH, "faceVertexCounts", drop), "faceVertexCounts do not add up"),
    "corner": (change(MESH, "faceVertexIndices", put(5, 20)), "faceVertexIndices has 20"),
    "negative corner": (change(MESH, "faceVertexIndices", put(5, -1)), "faceVertexIndices has -1"),
    "normals": (change(MESH, "normals", drop), "normals: 19 values for 20"),
    "vertex ids": (change(MESH, "primvars:avatar:vertexId", drop), "vertexId: 19 values for 20"),
    "colours": (change(MESH, "primvars:displayColor", drop), "displayColor: 19 values for 20"),
    "point": (change(MESH, "points", put(2, Gf.Vec3f(np.nan))), "points are not finite"),
    "skeleton": (lambda s: skin(s).GetSkeletonRel().SetTargets(["/gone"]), "a Skeleton"),
    "element size": (lambda s: skin(s).GetJointWeightsPrimvar().SetElementSize(4), "size 4"),
    "joint count": (change(MESH, JOINTS, drop), "jointIndices: 99 values for 100"),
    "weight count": (change(MESH, WEIGHTS, drop), "jointWeights: 99 values for 100"),
    "joint": (change(MESH, JOINTS, put(3, 5)), "jointIndices has 5"),
    "weight sum": (change(MESH, WEIGHTS, put(25, 1.5)), "jointWeights of point 5"),
    "weight nan": (change(MESH, WEIGHTS, put(25, np.nan)), "jointWeights of point 5"),
    "shapes": (change(MESH, "skel:blendShapes", drop), "23 blendShapes, 24 blendShapeTargets"),
    "shape names": (change(MESH, "skel:blendShapes", put(1, "jawOpen")), "duplicate"),
    "dangling": (lambda s: s.RemovePrim(SHAPE), f"refers to {SHAPE}, which is not a BlendShape"),
    "offsets": (change(SHAPE, "offsets", drop), "jawOpen offsets: "),
    "dense": (lambda s: prim(s, SHAPE).RemoveProperty("pointIndices"), "values for 20 (points)"),
    "offset's point": (change(SHAPE, "pointIndices", put(0, 20)), "jawOpen pointIndices has 20"),
    "twice a point": (change(SHAPE, "pointIndices", lambda v: put(0, v[1])(v)), "duplicates"),
    "bind": (change(SKELETON, "bindTransforms", drop), "bindTransforms: 4 values for 5"),
    "rest": (change(SKELETON, "restTransforms", drop), "restTransforms: 4 values for 5"),
    "joint names": (change(SKELETON, "jointNames", drop), "jointNames: 4 values for 5"),
    "joint order": (change(SKELETON, "joints", lambda v: v.reverse()), "before its parent"),
    "source": (lambda s: skin(s, SKELETON).GetAnimationSourceRel().SetTargets([MESH]), "a SkelAnimation"),
    "gone source": (lambda s: s.RemovePrim(NOD), f"refers to {NOD}"),
    "animated joint": (change(NOD, "joints", put(0, "hip")), f"{NOD}: joints has 'hip'"),
    "animated shape": (change(NOD, "blendShapes", put(0, "brow")), f"{NOD}: blendShapes has 'brow'"),
    "translations": (change(NOD, "translations", drop, 2), "translations at 2.0: 4 values for 5 (joints)"),
    "rotations": (change(NOD, "rotations", drop, 2), "rotations at 2.0: 4 values"),
    "scales": (change(NOD, "scales", append(Gf.Vec3h(1))), "6 values for 5"),
    "weights": (change(NOD, "blendShapeWeights", drop, 4), "blendShapeWeights at 4.0: 23 values for 24"),
    "turn": (change(NOD, "rotations", put(0, Gf.Quatf(2, 0, 0, 0)), 1), "rotations at 1.0 has a quaternion"),
    "weight": (change(NOD, "blendShapeWeights", put(0, np.inf), 1), "at 1.0 are not finite"),
    "orientations": (change(SPLATS, "orientations", drop), "orientations: 47 values for 48"),
    "orientation": (change(SPLATS, "orientations", put(0, Gf.Quatf(0, 0, 0, 0))), "a quaternion"),
    "splat scales": (change(SPLATS, "scales", append(Gf.Vec3f(1))), "scales: 49 values for 48"),
    "scale": (change(SPLATS, "scales", put(0, Gf.Vec3f(-1))), "scales are negative"),
    "opacities": (change(SPLATS, "opacities", drop), "opacities: 47 values for 48"),
    "opacity": (change(SPLATS, "opacities", put(0, 1.5)), "opacities are outside"),
    "degree": (lambda s: splats(s).GetRadianceSphericalHarmonicsDegreeAttr().Set(3), "432 values for 768"),
    "position": (change(SPLATS, "positions", put(0, Gf.Vec3f(np.inf))), "positions are not finite"),
    "coefficient": (change(SPLATS, SH, put(0, Gf.Vec3f(np.nan))), "not finite"),
    "reference": (lambda s: prim(s, ROOT).GetReferences().AddReference("./a.usda"), f"{ROOT}: references"),
    "picture": (
        lambda s: prim(s, MESH).CreateAttribute("a", Sdf.ValueTypeNames.Asset).Set("a.png"),
        "something outside",
    ),
}


@pytest.mark.parametrize("name", BROKEN)
def test_each_check_notices_what_it_is_for(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    breaks, said = BROKEN[name]
    stage = Usd.Stage.Open(open_layer(GOOD))
    breaks(stage)
    data = layer_bytes(stage.GetRootLayer())
    if name == "reference":
        monkeypatch.setattr(Usd.Stage, "Open", lambda *_: pytest.fail("composed"))
    problems = usd_problems(data)
    assert any(said in problem for problem in problems), problems


@pytest.mark.parametrize("data", [b"", b"PXR-USDC", GOOD[:2000], b"#usda 1.0\n"])
def test_what_is_no_crate_file_is_said_to_be_none(data: bytes) -> None:
    with pytest.raises(AvatarError, match="not a sound USD crate file"):
        usd_problems(data)
