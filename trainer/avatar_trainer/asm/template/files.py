"""A topology's mesh and landmarks from files, for `make.make_template`."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

from avatar_export.asm import NEUTRAL, AsmFace, Binding, Take, Template, check_names
from avatar_runtime import F64, I64, AvatarError
from avatar_runtime.io import of_file, read_bytes
from avatar_trainer.asm.mesh_files import FURTHEST, read_topology
from avatar_trainer.asm.scan_files import expect_eyes
from avatar_trainer.asm.template.make import initial_binding, make_template
from avatar_trainer.asm.template.place import LANDMARKS

MAX_LANDMARK_BYTES = 1 << 20
EYE_RIGHT, EYE_LEFT = 36, 45  # of iBUG's landmarks, the outer corners
SHAPE = f"a list of {LANDMARKS}, iBUG's order, each a vertex or [x, y, z]"


def template_of(mesh: Path, landmarks: Path, units: float, components: int) -> AsmFace:
    """A face at rest on the topology of `mesh`, whose coordinates are `units` to a metre.

    Raises AvatarError for invalid files, and as `make_template`.
    """
    with of_file(mesh):
        check_names(mesh.stem, [NEUTRAL])
    points, triangles = read_topology(mesh)
    if triangles is None or not len(triangles):
        raise AvatarError("has no triangles; a mesh is needed", file=mesh)
    rows = read_landmarks(landmarks, points)
    right, left = points[rows[[EYE_RIGHT, EYE_LEFT]]] / units
    expect_eyes(right, left, mesh)
    try:
        template, weights = make_template(points / units, triangles, None, rows)
    except AvatarError as error:
        whose = landmarks if (error.field or "").startswith("landmarks") else mesh
        raise AvatarError(error.message, file=whose, field=error.field) from None
    return at_rest(mesh.stem, template, initial_binding(template, weights, components))


def at_rest(name: str, template: Template, binding: Binding) -> AsmFace:
    """A face in its first shape, with only the take `neutral`."""
    still = np.zeros((1, len(template.bone_names), 3))
    return AsmFace(name, template, binding, (Take(NEUTRAL, 30.0, still, still.copy(), still + 1),))


def read_landmarks(path: Path, points: F64) -> I64:
    """[68] vertices of a JSON list of vertices or positions; for a position the nearest of `points` [V, 3].

    Raises AvatarError for any other file, and vertices beyond the mesh.
    """
    try:
        given = json.loads(read_bytes(path, MAX_LANDMARK_BYTES))
    except (ValueError, RecursionError):
        raise AvatarError(f"is not JSON; {SHAPE}, is needed", file=path) from None
    if not isinstance(given, list) or len(given) != LANDMARKS:
        raise AvatarError(f"is not {SHAPE}", file=path)
    return np.array([_vertex(value, points, path, k) for k, value in enumerate(given)], np.int64)


def _vertex(value: object, points: F64, path: Path, k: int) -> int:
    if type(value) is int:
        if not 0 <= value < len(points):
            raise AvatarError(f"is vertex {value}, but the mesh has {len(points)}", file=path, field=f"[{k}]")
        return value
    numbers = value if isinstance(value, list) else []
    if len(numbers) != 3 or not all(type(n) in (int, float) and abs(n) <= FURTHEST for n in numbers):
        raise AvatarError("is neither a vertex nor three finite numbers", file=path, field=f"[{k}]")
    return int(np.square(points - np.array(numbers, np.float64)).sum(axis=1).argmin())
