"""GaussianAvatars (ShenhanQian/GaussianAvatars 30cc4bd): Gaussians in the frames of the triangles of a head mesh.

point_cloud.ply holds them local to the triangle that `binding_0` names: offset and scale in multiples of the
triangle's size, rotation in its frame. The mesh is not stored; the release makes it from FLAME by adding teeth.
"""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np

from avatar_export.bodies.body_model import read_body_model
from avatar_export.formats.archive import Archive
from avatar_export.formats.casts import as_float64
from avatar_export.formats.mesh_files import MAX_ARRAY_BYTES, read_mesh
from avatar_export.formats.npy import parse_npy
from avatar_export.formats.obj import TriangleMesh
from avatar_export.formats.point_cloud import (
    NAME,
    PointCloud,
    has_property,
    locate,
    read_ply,
    taken_iteration,
)
from avatar_export.notes.note import Setting, fact
from avatar_export.options import ReadOptions
from avatar_export.provenance import provenance
from avatar_export.readers import surface
from avatar_export.rigs.embedded_rig import embedded_rig, no_rig, rest_vertices
from avatar_export.rigs.rig_file import read_rig_file
from avatar_runtime.avatar import F32, U32, Avatar, Embedding, Gaussians, Rules
from avatar_runtime.codec import ply
from avatar_runtime.io.errors import AvatarError
from avatar_runtime.io.ownership import owned
from avatar_runtime.io.whole_files import read_bytes
from avatar_runtime.stages.surface import triangle_shape

SYSTEM = "gaussian_avatars"
COMMIT = "ShenhanQian/GaussianAvatars 30cc4bd"
BINDING = "binding_0"
POSES = "flame_param.npz"
UNITS = 1.0  # FLAME is in metres
CONFIG = "cfg_args"
MAX_CONFIG_BYTES = 100_000
FILES = (
    f"point_cloud/iteration_N/{NAME} with the property {BINDING} (the newest N is read)",
    f"{POSES} beside it (optional: identity, tracked poses)",
    "beside it, one of: --mesh (.obj, .npz), --rig (.glb, .fbx, ASM face .npz), --body-model, of FLAME with the "
    "release's teeth",
)
WITHOUT_RIG = ReadOptions(no_rig=True)
USED_OPTIONS = (
    *("body_model", "shape", "dataset", "rig", "poses", "no_rig"),
    *("mesh", "units", "sh_degree"),
    *("exact", "name", "accept_misfit"),  # exact: there are no deltas to drop
)
RULES = Rules(
    position="triangle_frame", rotation="triangle_frame", scale="triangle_linear", sh_direction="world"
)
TOPOLOGY = (
    "its mesh is FLAME with 120 vertices and 168 triangles of teeth that the release adds (5143 and 10144 in all), "
    "not plain FLAME"
)


def detect(path: Path) -> bool:
    """Whether `path` is a run, an iteration's folder or a .ply whose Gaussians have triangle ids; never raises."""
    cloud = locate(path)
    return cloud is not None and has_property(cloud, BINDING)


def read(path: Path, options: ReadOptions) -> Avatar:
    """The avatar, in metres. Raises AvatarError if no mesh is given, and for unsound data."""
    with owned(SYSTEM):
        options.refuse_others(USED_OPTIONS, SYSTEM, "this system has no such input or choice")
        options.refuse_beside_no_rig(_only_of_a_rig(options), SYSTEM)
        cloud = locate(path)
        if cloud is None:
            raise AvatarError(f"has no {NAME}", file=path)
        taken = taken_iteration(path, cloud, NAME)
        rows = read_ply(cloud)
        splats = ply.gaussians(rows, cloud.file)
        poses = cloud.find(POSES)
        if options.body_model is not None and options.poses is None:
            options = replace(options, poses=poses)
        units = surface.units_of(UNITS if options.units is None else options.units)
        metres, mesh_file = _mesh(options, units)
        triangle = surface.triangle_rows(
            _binding(rows, cloud), metres, cloud.file, BINDING, f" of {mesh_file.name}; {TOPOLOGY}"
        )
        _check_static_offset(poses, len(metres.vertices), mesh_file)
        rig = no_rig() if options.no_rig else embedded_rig(
            metres.vertices, metres.triangles, options, SYSTEM, units
        )  # fmt: skip
        surface.check_areas(metres, triangle, mesh_file)
        embedding = _embedding(metres, triangle, splats)
        avatar = surface.surface_avatar(
            name=options.name or cloud.name,
            gaussians=replace(splats, log_scale=_log_scale(metres, triangle, splats)),
            embedding=embedding,
            rules=RULES,
            rig=rig,
            sh_degree=surface.degree_of(options.sh_degree, splats, cloud.file, "--sh-degree"),
            background=_background(cloud),
            units=units,
        )
        notes = [
            fact("settings", settings=[_units(options, units)]),
            *surface.fit_notes(avatar, options, mesh_file, SYSTEM),
            *rig.notes,
            *taken,
        ]
        own = {NAME: cloud.file, f"mesh/{mesh_file.name}": mesh_file, **({POSES: poses} if poses else {})}
        files = {name: file for name, file in own.items() if file not in rig.files.values()} | dict(rig.files)
        return replace(avatar, provenance=provenance(SYSTEM, files, notes, commit=COMMIT))


def _only_of_a_rig(options: ReadOptions) -> list[str]:
    """The inputs that give a rig and not the mesh: `_mesh` takes the mesh from the first of these that is given."""
    meshes = [name for name in ("mesh", "rig", "body_model") if getattr(options, name) is not None]
    return [*meshes[1:], "shape", "poses"]


def _mesh(options: ReadOptions, units: float) -> tuple[TriangleMesh, Path]:
    """The mesh whose triangles binding_0 numbers, in metres, and its file."""
    if options.mesh is not None:
        mesh = read_mesh(options.mesh)
        return TriangleMesh(surface.in_metres(mesh.vertices, units), mesh.triangles), options.mesh
    if options.rig is not None:
        rig = read_rig_file(options.rig).rig
        return TriangleMesh(rest_vertices(rig), rig.triangles), options.rig
    if options.body_model is not None:
        body = read_body_model(options.body_model)
        unmeasured = replace(options, accept_misfit=True)  # the mean shape is not the subject's mesh
        shaped = (
            None if options.no_rig else embedded_rig(body.v_template, body.triangles, unmeasured, SYSTEM).rig
        )
        vertices = body.v_template if shaped is None else shaped.vertices  # with the subject's identity
        return TriangleMesh(vertices, body.triangles), options.body_model
    raise AvatarError(
        "a checkpoint of this system does not contain its mesh; pass it with --mesh MESH.obj|.npz, --rig or "
        f"--body-model: {TOPOLOGY}"
    )


def _binding(rows: ply.Ply, cloud: PointCloud) -> surface.Floats:
    if BINDING not in rows.properties:
        raise AvatarError(
            "is missing; it holds the triangle of each Gaussian", file=cloud.file, field=f"property {BINDING}"
        )
    return as_float64(rows.properties[BINDING])


def _check_static_offset(poses: Path | None, vertices: int, mesh_file: Path) -> None:
    """Raise AvatarError if the run's per-vertex offsets belong to another mesh."""
    if poses is None:
        return
    with Archive(poses) as archive:
        if "static_offset.npy" not in archive.names:
            return
        shape = parse_npy(archive.read("static_offset.npy", MAX_ARRAY_BYTES), poses, "static_offset").shape
    if len(shape) < 2 or shape[-2] != vertices:
        raise AvatarError(
            f"has shape {list(shape)}, but {mesh_file.name} has {vertices} vertices; {TOPOLOGY}",
            file=poses,
            field="static_offset",
        )


def _embedding(mesh: TriangleMesh, triangle: U32, splats: Gaussians) -> Embedding:
    n = splats.count
    return Embedding(
        canonical_vertices=mesh.vertices,
        triangles=mesh.triangles,
        triangle=triangle,
        barycentric=np.full((n, 3), 1 / 3, np.float32),
        displacement=np.zeros(0, np.float32),
        local_offset=splats.mean,
        local_quat_wxyz=splats.quat_wxyz,
    )


def _log_scale(mesh: TriangleMesh, triangle: U32, splats: Gaussians) -> F32:
    """Log scale in the binding pose; the stored one is in multiples of the triangle's size."""
    with np.errstate(all="ignore"):  # an overflow becomes infinite, which the check of the avatar refuses
        size = triangle_shape(mesh.vertices, mesh.triangles, RULES).size[triangle]
        result: F32 = (splats.log_scale + np.log(size.astype(np.float64))[:, None]).astype(np.float32)
    return result


def _units(options: ReadOptions, units: float) -> Setting:
    return Setting("units", units, "assumed, FLAME is in metres" if options.units is None else "--units")


def _background(cloud: PointCloud) -> tuple[float, float, float]:
    """White, as in the release's scripts, unless cfg_args says otherwise (its text is searched, never evaluated)."""
    path = cloud.find(CONFIG)
    text = b"" if path is None else read_bytes(path, MAX_CONFIG_BYTES)
    black = re.search(rb"\bwhite_background=False\b", text) is not None
    return (0.0, 0.0, 0.0) if black else (1.0, 1.0, 1.0)
