"""The rig's mesh with its skin and blend shapes."""

from __future__ import annotations

from typing import Any

import numpy as np
from pxr import Gf, Sdf, UsdGeom, UsdSkel, Vt

from avatar_export.writers.engine_mesh import EngineMesh, entry_rows, vertex_id_uv
from avatar_export.writers.usd.values import Array, box_of, floats, ints, prim_names, tokens, vec3f
from avatar_runtime.avatar import F32, U16, SparseRows

VERTEX_ID = "avatar:vertexId"  # primvar: the vertex's row in rig.safetensors


def author_mesh(stage: Any, path: str, mesh: EngineMesh, colour: Array, skeleton: str) -> Any:
    """The Mesh prim, bound to the Skeleton prim at `skeleton`, with one BlendShape prim per target below it.

    `colour`: [V, 3] linear light, of every row of the rig.
    """
    prim = UsdGeom.Mesh.Define(stage, path)
    prim.CreatePurposeAttr(UsdGeom.Tokens.proxy)
    prim.CreateSubdivisionSchemeAttr(UsdGeom.Tokens.none)
    prim.CreatePointsAttr(vec3f(mesh.vertices))
    prim.CreateNormalsAttr(vec3f(mesh.normals))
    prim.SetNormalsInterpolation(UsdGeom.Tokens.vertex)
    prim.CreateFaceVertexCountsAttr(ints(np.full(len(mesh.triangles), 3)))
    prim.CreateFaceVertexIndicesAttr(ints(mesh.triangles))
    prim.CreateExtentAttr(vec3f(box_of(mesh.vertices)))
    primvars = UsdGeom.PrimvarsAPI(prim)
    vertex_id = primvars.CreatePrimvar(VERTEX_ID, Sdf.ValueTypeNames.IntArray, UsdGeom.Tokens.vertex)
    vertex_id.Set(ints(mesh.vertex_id))
    uv = primvars.CreatePrimvar("st", Sdf.ValueTypeNames.TexCoord2fArray, UsdGeom.Tokens.vertex)
    uv.Set(Vt.Vec2fArray.FromNumpy(vertex_id_uv(mesh.vertex_id)))
    prim.CreateDisplayColorPrimvar(UsdGeom.Tokens.vertex).Set(vec3f(colour[mesh.vertex_id]))
    binding = UsdSkel.BindingAPI.Apply(prim.GetPrim())
    binding.CreateSkeletonRel().SetTargets([Sdf.Path(skeleton)])
    binding.CreateGeomBindTransformAttr(Gf.Matrix4d(1))
    joints, weights = influences(mesh.skin)
    binding.CreateJointIndicesPrimvar(False, joints.shape[1]).Set(ints(joints))
    binding.CreateJointWeightsPrimvar(False, joints.shape[1]).Set(floats(weights))
    _author_blend_shapes(stage, path, mesh, binding)
    return prim.GetPrim()


def influences(skin: SparseRows) -> tuple[U16, F32]:
    """(joints, weights) [v, n]: all influences of each vertex; n is the largest number of them.

    Strongest first, ties by joint; a row adds up to 1, and unused places are joint 0 with weight 0. As in rig.glb
    a negative weight counts as 0, and a vertex without a positive one gets joint 0.
    """
    row = entry_rows(skin)
    weight = np.maximum(skin.values["weight"].astype(np.float64), 0)
    order = np.lexsort((skin.column, -weight, row))
    rank = np.arange(len(row)) - skin.row_ptr[row].astype(np.int64)
    most = max(int(rank[weight[order] > 0].max(initial=0)) + 1, 1)
    kept = rank < most
    joints, weights = np.zeros((skin.rows, most), np.uint16), np.zeros((skin.rows, most))
    joints[row[kept], rank[kept]], weights[row[kept], rank[kept]] = (
        skin.column[order][kept],
        weight[order][kept],
    )
    total = weights.sum(axis=1, keepdims=True)
    scaled = (weights / np.where(total > 0, total, 1)).astype(np.float32)
    joints[scaled == 0] = 0
    scaled[total[:, 0] <= 0, 0] = 1
    return joints, scaled


def _author_blend_shapes(stage: Any, path: str, mesh: EngineMesh, binding: Any) -> None:
    """Adds the BlendShape prims; a target without motion gets one zero offset, since no indices mean every point."""
    if not mesh.targets:
        return
    paths = []
    for name, target in zip(prim_names(t.name for t in mesh.targets), mesh.targets, strict=True):
        shape = UsdSkel.BlendShape.Define(stage, f"{path}/{name}")
        empty = not len(target.rows)
        shape.CreateOffsetsAttr(vec3f(np.zeros(3) if empty else target.offsets))
        shape.CreatePointIndicesAttr(ints(np.zeros(1) if empty else target.rows))
        paths.append(shape.GetPath())
    binding.CreateBlendShapesAttr(tokens(target.name for target in mesh.targets))
    binding.CreateBlendShapeTargetsRel().SetTargets(paths)
