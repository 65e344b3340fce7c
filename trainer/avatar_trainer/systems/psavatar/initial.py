"""The first points of PSAvatar: on the body model's mesh, by area, and off it along its normals (Eqs. 7 to 9)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import torch

from avatar_runtime import F32, F64, I64, AvatarError, Rig
from avatar_trainer.normals import vertex_normals
from avatar_trainer.systems.common.first_points import sampled
from avatar_trainer.systems.psavatar.anchors import anchored
from avatar_trainer.systems.psavatar.steady import Motion

Mask = npt.NDArray[np.bool_]
Places = tuple[I64, F64, F64]  # triangle [M], barycentric [M, 3], displacement [M] metres
Shown = Callable[[I64, F32, F32], Mask]  # of places: triangle [M], barycentric [M, 3], displacement [M]
CANDIDATES = 30  # for each point off the mesh: places of which some are kept that images can show
ITS_OWN = 3e-3  # metres: what stands so near to a triangle moves with it, as a lip's edge does
APART = 4e-3  # metres between triangles that move and what another triangle holds
MOVES = 1e-3  # metres
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
    shown: Shown | None = None,
) -> Sampled:
    """`count` points, the share `off_mesh` of them off the mesh by U[0, r_max] metres.

    `density` [F]: of the points on each triangle (`detail`); those on the mesh are `stretched` [F] times as dense. With
    a `motion`, images can show the points off the mesh (`shown`), and each is on the triangle that holds it steadiest
    (`anchors`); all have a limit by it and `swing`, metres. region: one of REGIONS. Raises AvatarError for a region
    that the body model does not define, or without area.
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
    if motion is not None and away:
        at = triangle[off], barycentric[off], distance[off]
        held = _held_steadily(rig, inside, at, motion, away, shown)
        triangle, barycentric, distance = (
            np.concatenate([whole[~off], part])
            for whole, part in zip((triangle, barycentric, distance), held, strict=True)
        )
        off = off[:count]
    limit = np.full(count, np.inf) if motion is None else motion.limit(triangle, distance, swing)
    return Sampled(
        triangle, barycentric.astype(np.float32), distance.astype(np.float32), off, limit.astype(np.float32)
    )


def _held_steadily(
    rig: Rig, inside: I64, at: Places, motion: Motion, count: int, shown: Shown | None
) -> Places:
    """`count` of the places `at` that images can show, each by the triangle of `inside` that holds it steadiest.

    What stands within ITS_OWN of its triangle keeps it. Nothing else stands within APART of a triangle that moves by
    more than MOVES: it would be in the way of an eye that turns. If there are fewer, some others follow.
    """
    triangle, barycentric, distance = at
    vertices = rig.vertices.astype(np.float64)
    normals = vertex_normals(vertices, rig.triangles)
    corners = rig.triangles[triangle]
    place = np.einsum(
        "nc,ncx->nx", barycentric, vertices[corners] + distance[:, None, None] * normals[corners]
    )
    wanted = np.ones(len(triangle), bool)
    if shown is not None:
        wanted = shown(triangle, barycentric.astype(np.float32), distance.astype(np.float32))
    own = distance <= ITS_OWN
    moving = vertices[rig.triangles[motion.moved > MOVES]].mean(axis=1)
    others = np.flatnonzero(wanted & ~own)
    wanted[others] = _nearest(place[others], moving) > APART
    rows = np.argsort(~wanted, kind="stable")[:count]
    mesh = vertices, normals, rig.triangles[inside].astype(np.int64)
    found = anchored(place[rows], *mesh, motion.moved[inside], motion.turned[inside])
    other = (found.triangle >= 0) & ~own[rows]
    return (
        np.where(other, inside[found.triangle], triangle[rows]),
        np.where(other[:, None], found.barycentric, barycentric[rows]),
        np.where(other, found.distance, distance[rows]),
    )


def _nearest(place: F64, to: F64) -> F64:
    """[M] distances of places [M, 3] to the nearest of some points [K, 3]; infinite without any."""
    if not len(to):
        return np.full(len(place), np.inf)
    parts = torch.split(torch.from_numpy(place), 4096)
    found: F64 = torch.cat([torch.cdist(part, torch.from_numpy(to)).amin(1) for part in parts]).numpy()
    return found


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
