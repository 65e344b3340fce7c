"""Points and triangles of a scan or of a topology, from files that anybody may have made.

The numbering of a scan does not matter: trimesh reads it, in any of the common mesh formats. trimesh gets bytes and a
format, never a path, a folder or an address, so it opens no other file: no materials, no textures, no external buffers.
What a file claims to hold is compared with its length first. The exporter's own code reads `.npz`, and the `.obj` of a
topology, whose vertices keep their numbers.
"""

from __future__ import annotations

import io
import logging
import re
import warnings
from pathlib import Path
from typing import Any

import numpy as np

from avatar_export.formats import mesh_files
from avatar_runtime import F64, I64, AvatarError
from avatar_runtime.codec import glb
from avatar_runtime.io import read_bytes
from avatar_schema import extras

FORMATS = (".obj", ".ply", ".stl", ".off", ".glb")  # by trimesh
NUMBERED = (".obj", ".npz")  # by the exporter, as they are numbered in the file
MAX_BYTES = 512 << 20
MAX_POINTS = 50_000_000
MAX_HEADER_BYTES = 1 << 16  # of a .ply
FURTHEST = 1e9  # a coordinate beyond is a mistake

Mesh = tuple[F64, I64 | None]  # points [N, 3], triangles [F, 3]


def read_points(path: Path) -> Mesh:
    """(points [N, 3], triangles [F, 3] or None) of a scan, in the file's frame and unit.

    `.npz` with `vertices` and `faces`, and FORMATS; polygons are cut into triangles, the meshes of a scene become one.
    Raises AvatarError for any other file, for one that is unsound, for points that are not finite, and where trimesh is
    not installed.
    """
    suffix = path.suffix.lower()
    if suffix == ".npz":
        return _sound(*_numbered(path), path)
    if suffix not in FORMATS:
        raise AvatarError(f"is not a scan format; use one of {', '.join((*FORMATS, '.npz'))}", file=path)
    data = read_bytes(path, MAX_BYTES)
    _expect_claims(data, suffix, path)
    return _sound(*_by_trimesh(data, suffix, path), path)


def read_topology(path: Path) -> Mesh:
    """As `read_points`, with the vertices numbered as in the file: NUMBERED, and FORMATS that hold one mesh."""
    return _sound(*_numbered(path), path) if path.suffix.lower() in NUMBERED else read_points(path)


def _numbered(path: Path) -> Mesh:
    mesh = mesh_files.read_mesh(path)
    return mesh.vertices.astype(np.float64), mesh.triangles.astype(np.int64)


def _sound(points: F64, triangles: I64 | None, path: Path) -> Mesh:
    if not len(points):
        raise AvatarError("has no points", file=path)
    sound = (np.abs(points) <= FURTHEST).all(axis=1)
    if not sound.all():
        raise AvatarError("is not a finite place", file=path, field=f"point {int(np.argmin(sound))}")
    if triangles is not None and not 0 <= triangles.min(initial=0) <= triangles.max(initial=0) < len(points):
        raise AvatarError(f"names points beyond the {len(points)} there are", file=path, field="triangles")
    return points, triangles


def _expect_claims(data: bytes, suffix: str, path: Path) -> None:
    """Raise AvatarError where a file claims more elements than it has bytes: memory would be made for them."""
    claims: list[Any] = []
    if suffix == ".glb":
        accessors = glb.decode(data, path).document.get("accessors", [])
        claims = (
            [a.get("count") for a in accessors if isinstance(a, dict)] if isinstance(accessors, list) else []
        )
    elif suffix == ".ply":
        header = data[:MAX_HEADER_BYTES].partition(b"end_header")[0]
        claims = [int(count[:20]) for count in re.findall(rb"^element\s+\S+\s+(\d+)", header, re.MULTILINE)]
    elif suffix == ".off":
        claims = [int(count[:20]) for count in re.findall(rb"\d+", data[:200])[:3]]
    for claim in claims:
        if type(claim) is not int or not 0 <= claim <= len(data):
            raise AvatarError(f"claims {str(claim)[:20]} elements in {len(data)} bytes", file=path)


def _by_trimesh(data: bytes, suffix: str, path: Path) -> Mesh:
    """Every mesh and point cloud of the file, in the scene's frame."""
    try:
        import trimesh
    except ImportError:
        raise AvatarError(
            f"reading {suffix} needs trimesh: {extras.how_to_install('train')}", file=path
        ) from None
    logging.getLogger("trimesh").setLevel(logging.CRITICAL)  # the error below says it in one line
    try:
        with warnings.catch_warnings(), np.errstate(all="ignore"):
            warnings.simplefilter("ignore")
            scene = trimesh.load_scene(
                io.BytesIO(data),
                file_type=suffix[1:],
                resolver=None,
                allow_remote=False,
                process=False,
                maintain_order=True,
                skip_materials=True,
            )
            return _joined(scene, path)
    except AvatarError:
        raise
    except Exception as error:  # trimesh raises anything on a damaged file
        raise AvatarError(
            f"cannot be read as {suffix} ({type(error).__name__}); is it whole?", file=path
        ) from None


def _joined(scene: Any, path: Path) -> Mesh:
    """The geometries of a trimesh scene as one; of several, points that no triangle names are left out."""
    points: list[F64] = []
    triangles: list[I64] = []
    nodes = list(scene.graph.nodes_geometry)
    count = 0
    for node in nodes:
        transform, name = scene.graph[node]
        own = scene.geometry[name]
        place = np.asarray(own.vertices, np.float64).reshape(-1, 3)
        faces = np.asarray(getattr(own, "faces", np.zeros((0, 3))), np.int64).reshape(-1, 3)
        if len(nodes) > 1 and len(faces):
            used, row = np.unique(faces, return_inverse=True)
            place, faces = place[used], row.reshape(-1, 3)
        if not np.array_equal(transform, np.eye(4)):
            place = place @ transform[:3, :3].T + transform[:3, 3]
        points.append(place)
        triangles.append(faces + count)
        count += len(place)
        if count > MAX_POINTS:
            raise AvatarError(f"holds more than {MAX_POINTS} points", file=path)
    if not points:
        return np.zeros((0, 3)), None
    joined = np.concatenate(triangles)
    return np.concatenate(points), joined if len(joined) else None
