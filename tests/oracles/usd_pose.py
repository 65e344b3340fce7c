"""What UsdSkel makes of a stage, and what it should: linear blend skinning of an avatar's rig by engine nodes.

The first half asks Pixar's UsdSkel through its public queries. The second is float64 NumPy from the textbook
formula; it reads the rig's own arrays and shares no code with the writer or the runtime.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
from pxr import Gf, Sdf, Usd, UsdGeom, UsdSkel, Vt

from avatar_runtime.avatar import Avatar
from avatar_runtime.engine_pose import EnginePose

Array = npt.NDArray[Any]


def stage_of(path: str) -> Any:
    """A stage on an anonymous copy of the file, which may be edited: Sdf shares layers by path."""
    layer = Sdf.Layer.CreateAnonymous(".usda")
    layer.TransferContent(Sdf.Layer.FindOrOpen(path))
    return Usd.Stage.Open(layer)


def posed_by_usd(stage: Any, time: float) -> Array:
    """World-space points [v, 3] of the stage's one skinned mesh: blend shapes, skeleton, transforms above."""
    root = UsdSkel.Root(stage.GetDefaultPrim())
    cache, within = UsdSkel.Cache(), Usd.TraverseInstanceProxies()
    cache.Populate(root, within)
    (binding,) = cache.ComputeSkelBindings(root, within)
    (target,) = binding.GetSkinningTargets()
    skeleton = cache.GetSkelQuery(binding.GetSkeleton())
    mesh = target.GetPrim()
    points = Vt.Vec3fArray(UsdGeom.Mesh(mesh).GetPointsAttr().Get(time))
    if target.HasBlendShapes():
        weights = skeleton.GetAnimQuery().ComputeBlendShapeWeights(time)
        weights = target.GetBlendShapeMapper().Remap(weights, Vt.FloatArray())
        shapes = UsdSkel.BlendShapeQuery(UsdSkel.BindingAPI(mesh))
        sub_weights, shape_index, sub_shape_index = shapes.ComputeSubShapeWeights(weights)
        assert shapes.ComputeDeformedPoints(
            sub_weights,
            shape_index,
            sub_shape_index,
            shapes.ComputeBlendShapePointIndices(),
            shapes.ComputeSubShapePointOffsets(),
            points,
        )
    assert target.ComputeSkinnedPoints(skeleton.ComputeSkinningTransforms(time), points, time)
    above = np.array(UsdGeom.XformCache(time).GetLocalToWorldTransform(binding.GetSkeleton().GetPrim()))
    return np.c_[np.array(points, np.float64), np.ones(len(points))] @ above[:, :3]


def baked_by_usd(stage: Any, time: float) -> Array:
    """The same from UsdSkel's own BakeSkinning; it edits the stage."""
    (mesh,) = [prim for prim in stage.Traverse() if prim.IsA(UsdGeom.Mesh)]
    assert UsdSkel.BakeSkinning(UsdSkel.Root(stage.GetDefaultPrim()), Gf.Interval(time, time))
    points = np.array(UsdGeom.Mesh(mesh).GetPointsAttr().Get(time), np.float64)
    above = np.array(UsdGeom.XformCache(time).GetLocalToWorldTransform(mesh))
    return np.c_[points, np.ones(len(points))] @ above[:, :3]


def vertex_ids(stage: Any) -> Array:
    """[v] the rig's row of every point."""
    (mesh,) = [prim for prim in stage.Traverse() if prim.IsA(UsdGeom.Mesh)]
    return np.array(UsdGeom.PrimvarsAPI(mesh).GetPrimvar("avatar:vertexId").Get())


def set_pose(stage: Any, pose: EnginePose) -> None:
    """Put one pose on the animation and on the node above the skeleton, as somebody would in a USD tool."""
    (skeleton,) = [prim for prim in stage.Traverse() if prim.IsA(UsdSkel.Skeleton)]
    (source,) = UsdSkel.BindingAPI(skeleton).GetAnimationSourceRel().GetTargets()
    animation = UsdSkel.Animation.Get(stage, source)
    for attribute, value in (
        (animation.GetTranslationsAttr(), [Gf.Vec3f(*v) for v in pose.translation.tolist()]),
        (animation.GetRotationsAttr(), [Gf.Quatf(w, x, y, z) for x, y, z, w in pose.rotation_xyzw.tolist()]),
        (animation.GetScalesAttr(), [Gf.Vec3h(*v) for v in pose.scale.tolist()]),
        (animation.GetBlendShapeWeightsAttr(), pose.weights.tolist()),
    ):
        attribute.Clear()
        attribute.Set(value)
    world = UsdGeom.Xformable(skeleton.GetParent())
    world.ClearXformOpOrder()
    x, y, z, w = pose.root_rotation_xyzw.tolist()
    world.AddTranslateOp(UsdGeom.XformOp.PrecisionDouble, "set").Set(
        Gf.Vec3d(*pose.root_translation.tolist())
    )
    world.AddOrientOp(UsdGeom.XformOp.PrecisionDouble, "set").Set(Gf.Quatd(w, x, y, z))


def posed_by_formula(avatar: Avatar, pose: EnginePose) -> Array:
    """[V, 3] float64: world of the sum over joints of weight * node * rest node^-1 * (template + weighted targets)."""
    rig = avatar.rig
    assert rig is not None
    rest, node = [], []
    world = _matrix(pose.root_translation, pose.root_rotation_xyzw, np.ones(3))
    scaled: list[Array] = []
    for j, parent in enumerate(rig.parents.tolist()):
        local = rig.rest_local[j].astype(np.float64)
        scaled.append(local if parent < 0 else scaled[parent] @ local)
        rest.append(_rigid(scaled[j]))
        own = _matrix(pose.translation[j], pose.rotation_xyzw[j], pose.scale[j])
        node.append((world if parent < 0 else node[parent]) @ own)
    skin = np.stack([n @ np.linalg.inv(r) for n, r in zip(node, rest, strict=True)])
    points = rig.vertices.astype(np.float64) + _weighted(avatar, pose.weights.astype(np.float64))
    blended = np.einsum("vj,jab->vab", _dense(rig.skin, "weight"), skin)
    return np.einsum("vab,vb->va", blended[:, :3], np.c_[points, np.ones(len(points))])


def _weighted(avatar: Avatar, weights: Array) -> Array:
    rig = avatar.rig
    assert rig is not None
    targets = np.concatenate(
        [_dense(m, "position") for m in (rig.morphs, rig.correctives, rig.late_morphs)], axis=1
    )
    return np.einsum("m,vmx->vx", weights, targets)


def _dense(sparse: Any, name: str) -> Array:
    value = sparse.values[name].astype(np.float64)
    table = np.zeros((len(sparse.row_ptr) - 1, sparse.columns, *value.shape[1:]))
    for row, (start, end) in enumerate(
        zip(sparse.row_ptr[:-1].tolist(), sparse.row_ptr[1:].tolist(), strict=True)
    ):
        table[row, sparse.column[start:end]] = value[start:end]
    return table


def _matrix(translation: Array, quat_xyzw: Array, scale: Array) -> Array:
    x, y, z, w = np.asarray(quat_xyzw, np.float64)
    m = np.eye(4)
    m[:3, 0] = 1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)
    m[:3, 1] = 2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x)
    m[:3, 2] = 2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)
    m[:3, :3] *= np.asarray(scale)
    m[:3, 3] = translation
    return m


def _rigid(m: Array) -> Array:
    """The same place and the nearest rotation."""
    u, _, vt = np.linalg.svd(m[:3, :3])
    result = m.copy()
    result[:3, :3] = u @ np.diag([1, 1, np.linalg.det(u @ vt)]) @ vt
    return result
