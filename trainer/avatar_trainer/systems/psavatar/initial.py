"""The first points of PSAvatar: on the body model's mesh, by area, and off it along its normals (Eqs. 7 to 9)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from avatar_runtime.avatar import F32, F64, I64, Rig
from avatar_runtime.io.errors import AvatarError
from avatar_trainer.normals import vertex_normals
from avatar_trainer.systems.common.first_points import sampled
from avatar_trainer.systems.psavatar.steady import Motion, steadiest

Mask = npt.NDArray[np.bool_]
CANDIDATES = 10  # for each point off the mesh, of which the steadiest are taken
MOST_OF_A_VERTEX = 0.5  # skin weight


@dataclass(frozen=True)
class Sampled:
    """N points of a mesh."""

    triangle: I64  # [N]
    barycentric: F32  # [N, 3]
    displacement: F32  # [N] metres along the interpolated normal
    off_mesh: Mask  # [N]
    limit: F32  # [N] metres off the mesh that it may stand


def sample_points(
    rig: Rig,
    region: str,
    count: int,
    off_mesh: float,
    r_max: float,
    density: F64,
    stretched: F64,
    rng: np.random.Generator,
    motion: Motion | None = None,
    swing: float = 0.0,
) -> Sampled:
    """`count` points, the share `off_mesh` of them off the mesh by U[0, r_max] metres.

    `density` [F]: of the points on each triangle (`detail`); those on the mesh are `stretched` [F] times as dense. With
    a `motion`, points off the mesh are the steadiest of CANDIDATES times as many (`steady.steadiest`), all with a limit
    by it and `swing`, metres. region: one of REGIONS. Raises AvatarError for a region that the body model does not
    define, or without area.
    """
    inside = np.flatnonzero(REGIONS[region](rig))
    away = round(off_mesh * count)
    drawn = count if motion is None else count + (CANDIDATES - 1) * away
    mesh, weight = (rig.triangles[inside], rig.vertices), density[inside]
    try:
        parts = [
            sampled(*mesh, some, "area", one, rng)
            for some, one in ((count - away, weight * stretched[inside]), (drawn - (count - away), weight))
        ]
    except ValueError as error:
        raise AvatarError(f"{error} in region {region!r}", field="region") from None
    rows, barycentric = (np.concatenate(part) for part in zip(*parts, strict=True))
    off = np.arange(drawn) >= count - away
    distance = np.where(off, rng.uniform(0, r_max, drawn), 0.0)
    triangle = inside[rows]
    if motion is not None and drawn > count:
        normal = vertex_normals(rig.vertices.astype(np.float64), rig.triangles)
        corners = rig.triangles[triangle[off]]
        carried = rig.vertices[corners] + distance[off, None, None] * normal[corners]
        place = np.einsum("nc,ncx->nx", barycentric[off], carried)
        steady = steadiest(place, motion.swing(triangle[off], distance[off]), 1 / CANDIDATES)
        first = np.argsort(~steady, kind="stable")[:away]  # the steady ones; if they are too few, some more
        kept = np.concatenate([np.arange(count - away), count - away + first])
        triangle, barycentric, distance, off = triangle[kept], barycentric[kept], distance[kept], off[kept]
    limit = np.full(count, np.inf) if motion is None else motion.limit(triangle, distance, swing)
    return Sampled(
        triangle, barycentric.astype(np.float32), distance.astype(np.float32), off, limit.astype(np.float32)
    )


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
