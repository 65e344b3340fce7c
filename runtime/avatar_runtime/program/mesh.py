"""The buffers and passes of the mesh: stages morph and skin, and how its triangles and vertices turn."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from avatar_runtime.avatar import F32, Avatar, Rig, SparseRows
from avatar_runtime.program.chunks import Cost, runs, too_large
from avatar_runtime.program.codes import Coded
from avatar_runtime.program.fields import MORPH, SKIN, VERTEX_CORRECTIVE, VERTEX_LATE
from avatar_runtime.program.gaussians import picked
from avatar_runtime.program.model import WORD, Buffer, Constant, Pass, Run
from avatar_runtime.program.passes import make_pass
from avatar_runtime.program.sections import Building, part, sparse
from avatar_runtime.rules import RIGGED_ROTATIONS, code
from avatar_runtime.topology import vertex_triangles
from avatar_schema import constants

TRIANGLE_PLANES = 3  # of float4
MESH_PLANES, RIGGED_MESH_PLANES = 3, 5  # the latter for rules.RIGGED_ROTATIONS
FLOAT4 = 16


def bake_mesh(
    avatar: Avatar, coded: Coded, pose: Mapping[str, int], limit: int, buffers: dict[str, Buffer]
) -> tuple[Pass, ...]:
    """Stages morph and skin; without a rig, morph alone puts the canonical mesh into place."""
    rig, positions, path = avatar.rig, vertices_of(avatar), template_path(avatar)
    planes = RIGGED_MESH_PLANES if avatar.rules.rotation in RIGGED_ROTATIONS else MESH_PLANES
    size = FLOAT4 * planes * len(positions)
    if size > limit:
        raise too_large(f"the mesh of {len(positions)} vertices", size, limit)
    buffers["Mesh"] = Buffer("Mesh", size)
    morph: list[Pass] = []
    skin: list[Pass] = []
    for index, run in enumerate(vertex_runs(positions, rig, limit)):
        rows: dict[str, Constant] = {"first": run.first, "count": run.count}
        static = Building(f"MorphStatic.{index}")
        here = slice(run.first, run.first + run.count)
        codes = coded.get(path)
        template = None if codes is None else part(codes, here)
        static.coded("template_position", "linear", positions[here], template, by_plane=True)
        no_rows = SparseRows.empty(len(positions), 0, {"position": (3,)})
        for name, kinds in (("morph", MORPH), ("corrective", VERTEX_CORRECTIVE)):
            rows_of = no_rows if rig is None else getattr(rig, f"{name}s")
            sparse(static, name, rows_of, kinds, run, picked(coded, f"rig.{name}s"))
        own: dict[str, Constant] = {
            "vertices": len(positions),
            "weights": pose["weights"],
            "features": pose["features"],
        }
        morph.append(_pass("morph", "MorphStatic", static, run, {**rows, **own}, buffers))
        if rig is not None:
            static = Building(f"SkinStatic.{index}")
            sparse(static, "late", rig.late_morphs, VERTEX_LATE, run, picked(coded, "rig.late_morphs"))
            sparse(static, "skin", rig.skin, SKIN, run, picked(coded, "rig.skin"))
            own = {"late": pose["late"], "joints": pose["joints"]}
            skin.append(_pass("skin", "SkinStatic", static, run, {**rows, **own}, buffers))
    return (*morph, *skin)


def vertices_of(avatar: Avatar) -> F32:
    """[V, 3] the mesh that stage morph begins with: the rig's, else the embedding's."""
    if avatar.rig is not None:
        return avatar.rig.vertices
    assert avatar.embedding is not None
    return avatar.embedding.canonical_vertices


def template_path(avatar: Avatar) -> str:
    """Where `vertices_of` is found in the avatar."""
    return "embedding.canonical_vertices" if avatar.rig is None else "rig.vertices"


def vertex_runs(positions: F32, rig: Rig | None, limit: int) -> tuple[Run, ...]:
    """Chunks of vertices, for what morph and skin read, as if everything were float32."""
    morph, skin = Cost(WORD * 5, 4 * WORD), Cost(WORD * 2, 4 * WORD)
    if rig is not None:
        parts = ((rig.morphs, 4), (rig.correctives, 4), (rig.late_morphs, 4), (rig.skin, 2))
        sizes = [(rows.row_ptr, WORD * words) for rows, words in parts]
        morph = Cost(WORD * 5, 4 * WORD, tuple(sizes[:2]))
        skin = Cost(WORD * 2, 4 * WORD, tuple(sizes[2:]))
    return runs("vertex", len(positions), (morph, skin), limit)


def bake_surface(
    avatar: Avatar, coded: Coded, pose: Mapping[str, int], limit: int, buffers: dict[str, Buffer]
) -> tuple[Pass, ...]:
    """How triangles and vertices under the Gaussians have turned: the first steps of stage bind."""
    e, rules = avatar.embedding, avatar.rules
    assert e is not None
    faces, vertices = len(e.triangles), len(e.canonical_vertices)
    static = Building("SurfaceStatic")
    static.indices("corners", e.triangles.T, vertices)
    static.coded(
        "canonical",
        "linear",
        e.canonical_vertices,
        coded.get("embedding.canonical_vertices"),
        by_plane=True,
    )
    ptr, triangle = vertex_triangles(e.triangles, vertices)
    static.add("vertex_triangle_ptr", ptr, "incidence")
    static.indices("vertex_triangle", triangle, faces, "incidence")
    skin = SparseRows.empty(vertices, 0, {"weight": ()})
    if avatar.rig is not None and rules.rotation in RIGGED_ROTATIONS:
        skin = avatar.rig.skin
    sparse(static, "skin", skin, SKIN, Run(0, vertices), picked(coded, "rig.skin"))
    buffer, values = static.done()
    what = f"the surface of {faces} triangles"
    size = max(FLOAT4 * TRIANGLE_PLANES * faces, buffer.size)
    if size > limit:
        raise too_large(what, size, limit)
    buffers["SurfaceStatic"] = buffer
    buffers["Triangles"] = Buffer("Triangles", FLOAT4 * TRIANGLE_PLANES * faces)
    area = avatar.training_per_bundle**2
    own: dict[str, Constant] = {
        "triangles": faces,
        "vertices": vertices,
        "rotation_rule": code("rotation", rules.rotation),
        "quaternion_sign": code("quaternion_sign", rules.quaternion_sign),
        "normal_floor": float(np.float32(constants()["normal_floor"] / area)),
        "quaternion_floor": float(np.float32(constants()["quaternion_floor"] / area)),
        "joints": pose["joints"],
        **values,
    }
    bound = {name: name for name in ("SurfaceStatic", "Mesh", "Triangles", "Pose")}
    return (
        make_pass("bind_triangles", faces, bound, own),
        make_pass("bind_vertices", vertices, bound, own),
    )


def bake_casting(avatar: Avatar, limit: int, buffers: dict[str, Buffer]) -> tuple[Pass, ...]:
    """How the mesh casts shadows: no passes without triangles."""
    mesh, embedded = avatar.embedding or avatar.rig, avatar.embedding is not None
    assert mesh is not None
    faces, vertices = len(mesh.triangles), len(vertices_of(avatar))
    if not faces:
        return ()
    static = Building("SurfaceStatic" if embedded else "CornerStatic")
    static.indices("corners", mesh.triangles.T, vertices)
    buffer, values = static.done()
    if buffer.size > limit:
        raise too_large(f"the mesh of {faces} triangles", buffer.size, limit)
    if not embedded:
        buffers[buffer.name] = buffer
    bound = {"CornerStatic": buffer.name, "Mesh": "Mesh", "Shadow": "Shadow"}
    rows = {f"{name}_row{k}": f"{name}_row{k}" for name in ("world", "shadow") for k in range(4)}
    return (
        make_pass("shadow_mesh", faces, bound, {"triangles": faces, "vertices": vertices, **values, **rows}),
    )


def _pass(
    entry: str,
    kind: str,
    static: Building,
    run: Run,
    own: Mapping[str, Constant],
    buffers: dict[str, Buffer],
) -> Pass:
    buffer, values = static.done()
    buffers[buffer.name] = buffer
    bound = {kind: buffer.name, "Pose": "Pose", "Mesh": "Mesh"}
    return make_pass(entry, run.count, bound, {**own, **values})
