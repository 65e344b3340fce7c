"""Problems of a stage that UsdValidation does not find: inconsistent lengths, indices and weights."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from typing import Any

import numpy as np
from pxr import Usd, UsdGeom, UsdSkel, UsdVol

from avatar_export.writers.usd.layer import leads_outside, open_layer
from avatar_export.writers.usd.mesh import VERTEX_ID
from avatar_export.writers.usd.values import Array

WEIGHT_SUM = 1e-5  # of a vertex's joint weights, from 1
UNIT = 1e-4  # of a quaternion's length, from 1


def usd_problems(data: bytes) -> list[str]:
    """One line for each problem of a USD crate file that this program made; [] for a sound one.

    Each line begins with the path of a prim. A layer that refers to other files is not composed. Raises AvatarError
    if the library cannot read `data`, which it does in this process: a stored file is compared with `same_usd`
    instead.
    """
    layer = open_layer(data)
    outside = [f"{where}: refers to something outside of the file" for where in leads_outside(layer)]
    if outside:
        return outside
    stage = Usd.Stage.Open(layer)
    found = [] if stage.GetDefaultPrim() else ["/: has no default prim"]
    for prim in stage.Traverse():
        for schema, check in CHECKS:
            if prim.IsA(schema):
                found += [f"{prim.GetPath()}: {problem}" for problem in check(prim)]
    return found


def _extent(prim: Any) -> Iterator[str]:
    extent = UsdGeom.Boundable(prim).GetExtentAttr().Get()
    if extent is None or len(extent) != 2 or not (np.array(extent)[0] <= np.array(extent)[1]).all():
        yield "extent is not a box of a smallest and a largest corner"


def _mesh(prim: Any) -> Iterator[str]:
    mesh = UsdGeom.Mesh(prim)
    points = _array(mesh.GetPointsAttr())
    corners = _array(mesh.GetFaceVertexIndicesAttr())
    vertex_id = UsdGeom.PrimvarsAPI(prim).GetPrimvar(VERTEX_ID)
    if int(_array(mesh.GetFaceVertexCountsAttr()).sum()) != len(corners):
        yield "faceVertexCounts do not add up to the length of faceVertexIndices"
    yield from _inside("faceVertexIndices", corners, len(points), "points")
    yield from _length("normals", _array(mesh.GetNormalsAttr()), len(points), "points")
    yield from _length(f"primvars:{VERTEX_ID}", _array(vertex_id.GetAttr()), len(points), "points")
    yield from _length("displayColor", _array(mesh.GetDisplayColorAttr()), len(points), "points")
    yield from _finite("points", points)


def _skin(prim: Any) -> Iterator[str]:
    binding = UsdSkel.BindingAPI(prim)
    skeleton = UsdSkel.Skeleton(binding.GetSkeleton())
    if not skeleton:
        yield "skel:skeleton does not refer to a Skeleton"
        return
    points = len(_array(UsdGeom.Mesh(prim).GetPointsAttr()))
    indices, weights = binding.GetJointIndicesPrimvar(), binding.GetJointWeightsPrimvar()
    width = indices.GetElementSize()
    joint, weight = _array(indices.GetAttr()), _array(weights.GetAttr())
    if weights.GetElementSize() != width:
        yield f"jointWeights have element size {weights.GetElementSize()}, jointIndices {width}"
    yield from _length("jointIndices", joint, points * width, f"points times {width} influences")
    yield from _length("jointWeights", weight, points * width, f"points times {width} influences")
    yield from _inside("jointIndices", joint, len(skeleton.GetJointsAttr().Get() or ()), "joints")
    if len(weight) == points * width:
        rows = weight.astype(np.float64).reshape(points, width)
        bad = ~((rows >= 0).all(axis=1) & (np.abs(rows.sum(axis=1) - 1) <= WEIGHT_SUM))
        if bad.any():
            yield f"jointWeights of point {int(np.argmax(bad))} are negative or do not add up to 1"
    yield from _blend_shapes(prim, binding, points)


def _blend_shapes(prim: Any, binding: Any, points: int) -> Iterator[str]:
    names = list(binding.GetBlendShapesAttr().Get() or ())
    targets = binding.GetBlendShapeTargetsRel().GetTargets()
    if len(names) != len(targets):
        yield f"{len(names)} blendShapes, {len(targets)} blendShapeTargets"
    if len(set(names)) != len(names):
        yield "blendShapes has duplicate names"
    for path in targets:
        shape = UsdSkel.BlendShape.Get(prim.GetStage(), path)
        if not shape:
            yield f"blendShapeTargets refers to {path}, which is not a BlendShape"
            continue
        offsets, rows = _array(shape.GetOffsetsAttr()), shape.GetPointIndicesAttr().Get()
        if rows is None:
            yield from _length(f"{path.name} offsets", offsets, points, "points")
            continue
        yield from _length(f"{path.name} offsets", offsets, len(rows), "pointIndices")
        yield from _inside(f"{path.name} pointIndices", np.array(rows), points, "points")
        if len(set(rows)) != len(rows):
            yield f"{path.name} pointIndices has duplicates"


def _skeleton(prim: Any) -> Iterator[str]:
    skeleton = UsdSkel.Skeleton(prim)
    joints = list(skeleton.GetJointsAttr().Get() or ())
    for name in ("jointNames", "bindTransforms", "restTransforms"):
        yield from _length(name, _array(prim.GetAttribute(name)), len(joints), "joints")
    for index, joint in enumerate(joints):
        parent = joint.rpartition("/")[0]
        if joint in joints[:index] or (parent and parent not in joints[:index]):
            yield f"joint {joint} is a duplicate, or before its parent"
    for path in UsdSkel.BindingAPI(prim).GetAnimationSourceRel().GetTargets():
        if not UsdSkel.Animation.Get(prim.GetStage(), path):
            yield f"skel:animationSource refers to {path}, which is not a SkelAnimation"


def _animation(prim: Any) -> Iterator[str]:
    animation = UsdSkel.Animation(prim)
    stage = prim.GetStage()
    joints, shapes = animation.GetJointsAttr().Get() or (), animation.GetBlendShapesAttr().Get() or ()
    yield from _known("joints", joints, _all(stage, UsdSkel.Skeleton, "joints"))
    yield from _known("blendShapes", shapes, _all(stage, UsdGeom.Mesh, "skel:blendShapes"))
    for name, count, of in (
        ("translations", len(joints), "joints"),
        ("rotations", len(joints), "joints"),
        ("scales", len(joints), "joints"),
        ("blendShapeWeights", len(shapes), "blendShapes"),
    ):
        attribute = prim.GetAttribute(name)
        for time in attribute.GetTimeSamples() or [Usd.TimeCode.Default()]:
            values = _array(attribute, time)
            yield from _length(f"{name} at {time}", values, count, of)
            yield from _finite(f"{name} at {time}", values)
            if name == "rotations":
                yield from _unit(f"{name} at {time}", values)


def _splats(prim: Any) -> Iterator[str]:
    splats = UsdVol.ParticleField3DGaussianSplat(prim)
    count = len(_array(splats.GetPositionsAttr()))
    degree = splats.GetRadianceSphericalHarmonicsDegreeAttr().Get()
    harmonics = splats.GetRadianceSphericalHarmonicsCoefficientsAttr()
    scales, opacities = _array(splats.GetScalesAttr()), _array(splats.GetOpacitiesAttr())
    orientations = _array(splats.GetOrientationsAttr())
    for attribute in (splats.GetOrientationsAttr(), splats.GetScalesAttr(), splats.GetOpacitiesAttr()):
        yield from _length(attribute.GetName(), _array(attribute), count, "positions")
    yield from _length(
        "coefficients", _array(harmonics), count * (degree + 1) ** 2, f"positions at degree {degree}"
    )
    for values, name in (
        (_array(splats.GetPositionsAttr()), "positions"),
        (_array(harmonics), "coefficients"),
    ):
        yield from _finite(name, values)
    yield from _unit("orientations", orientations)
    if not ((scales >= 0) & np.isfinite(scales)).all():
        yield "scales are negative or not finite"
    if not ((opacities >= 0) & (opacities <= 1)).all():
        yield "opacities are outside of 0..1"


def _array(attribute: Any, time: Any = None) -> Array:
    """The attribute's values; empty if it has no value."""
    value = attribute.Get(Usd.TimeCode.Default() if time is None else time) if attribute else None
    return np.zeros(0) if value is None else np.array(value)


def _length(name: str, values: Array, count: int, of: str) -> Iterator[str]:
    if len(values) != count:
        yield f"{name}: {len(values)} values for {count} ({of})"


def _inside(name: str, values: Array, count: int, of: str) -> Iterator[str]:
    bad = (values < 0) | (values >= count)
    if bad.any():
        yield f"{name} has {int(values[np.argmax(bad)])}, but there are {count} {of}"


def _finite(name: str, values: Array) -> Iterator[str]:
    if not np.isfinite(values).all():
        yield f"{name} are not finite"


def _unit(name: str, values: Array) -> Iterator[str]:
    if len(values) and not (np.abs(np.linalg.norm(values.astype(np.float64), axis=1) - 1) <= UNIT).all():
        yield f"{name} has a quaternion that is not of length 1"


def _known(name: str, given: Iterable[str], known: set[str]) -> Iterator[str]:
    for item in given:
        if item not in known:
            yield f"{name} has {item!r}, which does not exist in the stage"


def _all(stage: Any, schema: Any, attribute: str) -> set[str]:
    prims = [prim for prim in stage.Traverse() if prim.IsA(schema)]
    return {item for prim in prims for item in prim.GetAttribute(attribute).Get() or ()}


CHECKS: tuple[tuple[Any, Callable[[Any], Iterator[str]]], ...] = (
    (UsdGeom.Boundable, _extent),
    (UsdGeom.Mesh, _mesh),
    (UsdGeom.Mesh, _skin),
    (UsdSkel.Skeleton, _skeleton),
    (UsdSkel.Animation, _animation),
    (UsdVol.ParticleField3DGaussianSplat, _splats),
)
