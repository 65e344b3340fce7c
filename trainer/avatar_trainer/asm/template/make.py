"""A head mesh made into an ASM template: unwrapped, with 84 bones and their first weights and mixtures.

Source: ASM (arXiv 2304.09423) section 3.3: any topology serves. Bones and names are the same for all.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from avatar_export.asm import Binding, Template
from avatar_runtime import F32, F64, AvatarError
from avatar_trainer.asm.gmm import fit, polish
from avatar_trainer.asm.template.place import LANDMARKS, place, skeleton
from avatar_trainer.asm.template.unwrap import unwrap
from avatar_trainer.asm.template.weights import initial_weights

NOSE_TIP = 30  # of iBUG's landmarks, in the middle of the unwrap

Array = npt.NDArray[Any]


def make_template(
    vertices: Array, triangles: Array, uv: Array | None, landmarks: Array, colour: Array | None = None
) -> tuple[Template, F32]:
    """(template, first weights [V, 84]) of a head [V, 3] metres, +Y up, face +Z, subject's left +X; triangles [F, 3].

    uv [V, 2], or None to compute an unwrap without overlaps; landmarks [68] vertices, iBUG's order; colour
    [V, 3] 0..1. Raises AvatarError for meshes that cannot be unwrapped and landmarks that do not form an upright face.
    """
    _check(vertices, triangles, landmarks)
    bones = skeleton()
    placed = place(vertices, triangles, landmarks)
    plane = unwrap(vertices, triangles, int(landmarks[NOSE_TIP])) if uv is None else uv
    template = Template(
        vertices=vertices.astype(np.float32),
        triangles=triangles.astype(np.uint32),
        uv=plane.astype(np.float32),
        bone_names=bones.names,
        parents=bones.parents,
        rest_position=placed.rest_position.astype(np.float32),
        rest_linear=np.tile(np.eye(3, dtype=np.float32), (len(bones.names), 1, 1)),
        anchor_vertex=placed.anchor_vertex.astype(np.uint32),
        colour=None if colour is None else colour.astype(np.float32),
        landmarks={f"ibug_{k}": int(v) for k, v in enumerate(landmarks)},
    )
    return template, initial_weights(vertices, triangles, placed.rest_position).astype(np.float32)


def initial_binding(template: Template, weights: Array, components: int = 2) -> Binding:
    """Bones where they were placed (Eq. 5) and mixtures fitted to `weights` [V, J]."""
    zeta = template.uv[template.anchor_vertex].astype(np.float64)
    area = plane_areas(template)
    return polish(fit(template.uv, area, weights, zeta, components), template.uv, area, weights)


def plane_areas(template: Template) -> F64:
    """[V] the area of the uv plane per vertex: a third of its triangles."""
    a, b, c = template.uv.astype(np.float64)[template.triangles].transpose(1, 0, 2)
    x, y = b - a, c - a
    third = np.abs(x[:, 0] * y[:, 1] - x[:, 1] * y[:, 0]) / 6
    return np.bincount(template.triangles.reshape(-1), np.repeat(third, 3), len(template.uv)).astype(
        np.float64
    )


def landmark_rows(template: Template) -> npt.NDArray[np.int64]:
    """[68] vertices of iBUG's landmarks."""
    return np.array([template.landmarks[f"ibug_{k}"] for k in range(LANDMARKS)], np.int64)


def _check(vertices: Array, triangles: Array, landmarks: Array) -> None:
    if vertices.ndim != 2 or vertices.shape[1] != 3 or not np.isfinite(vertices).all():
        raise AvatarError(
            f"vertices {list(vertices.shape)}: finite [V, 3] in metres are needed", field="vertices"
        )
    if triangles.ndim != 2 or triangles.shape[1] != 3 or not len(triangles):
        raise AvatarError(f"triangles {list(triangles.shape)}: [F, 3] are needed", field="triangles")
    if not 0 <= triangles.min() <= triangles.max() < len(vertices):
        raise AvatarError(f"name vertices beyond the {len(vertices)} there are", field="triangles")
    if landmarks.shape != (LANDMARKS,) or not 0 <= landmarks.min() <= landmarks.max() < len(vertices):
        raise AvatarError(f"{LANDMARKS} vertices of the mesh are needed, iBUG's order", field="landmarks")
