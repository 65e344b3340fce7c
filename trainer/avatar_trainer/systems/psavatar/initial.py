"""The first points of PSAvatar: on the body model's mesh, by area, and off it along its normals (Eqs. 7 to 9)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from avatar_runtime.avatar import F32, F64, I64, Rig
from avatar_runtime.io.errors import AvatarError
from avatar_trainer.systems.common.first_points import sampled

Mask = npt.NDArray[np.bool_]
MOST_OF_A_VERTEX = 0.5  # skin weight


@dataclass(frozen=True)
class Sampled:
    """N points of a mesh."""

    triangle: I64  # [N]
    barycentric: F32  # [N, 3]
    displacement: F32  # [N] metres along the interpolated normal
    off_mesh: Mask  # [N]


def sample_points(
    rig: Rig, region: str, count: int, off_mesh: float, r_max: float, rng: np.random.Generator
) -> Sampled:
    """`count` points, the share `off_mesh` of them off the mesh by U[0, r_max] metres.

    region: one of REGIONS. Raises AvatarError for a region that the body model does not define, or without area.
    """
    inside = REGIONS[region](rig)
    try:
        rows, barycentric = sampled(rig.triangles[inside], rig.vertices, count, "area", rng)
    except ValueError as error:
        raise AvatarError(f"{error} in region {region!r}", field="region") from None
    off = np.arange(count) >= count - round(off_mesh * count)
    distance = np.where(off, rng.uniform(0, r_max, count), 0.0)
    triangle = np.flatnonzero(inside)[rows]
    return Sampled(triangle, barycentric.astype(np.float32), distance.astype(np.float32), off)


def _everywhere(rig: Rig) -> Mask:
    return np.ones(len(rig.triangles), bool)


def _head(rig: Rig) -> Mask:
    """Triangles that no root joint moves: in FLAME the root moves the shoulders."""
    by_root = np.zeros(len(rig.vertices))
    ptr: I64 = rig.skin.row_ptr.astype(np.int64)
    row = np.repeat(np.arange(rig.skin.rows), ptr[1:] - ptr[:-1])
    of_root = rig.parents[rig.skin.column.astype(np.int64)] < 0
    np.add.at(by_root, row[of_root], rig.skin.values["weight"][of_root].astype(np.float64))
    of_head = np.asarray(by_root <= MOST_OF_A_VERTEX)
    result: Mask = np.asarray(of_head[rig.triangles].all(axis=1))
    return result


def _face(rig: Rig) -> Mask:
    """The head without the triangles that the capture's body model lists as its back."""
    if not len(rig.anchor_vertices):
        raise AvatarError(
            "needs the body model's list of faces at the back of the head, which this capture does not name",
            field="region",
        )
    back = np.zeros(len(rig.vertices), bool)
    back[rig.anchor_vertices] = True
    return _head(rig) & ~back[rig.triangles].all(axis=1)


REGIONS: dict[str, Callable[[Rig], Mask]] = {"all": _everywhere, "head": _head, "face": _face}


def mean_spacing(rig: Rig, region: str, on_mesh: int) -> float:
    """Metres between neighbours if `on_mesh` points were evenly spread over the region."""
    corner: F64 = rig.vertices.astype(np.float64)[rig.triangles[REGIONS[region](rig)]]
    across = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    return float(np.sqrt(np.linalg.norm(across, axis=1).sum() / 2 / max(on_mesh, 1)))
