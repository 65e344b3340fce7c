"""A coarser head for tracking, like FLAME: its vertices are vertices of the full head.

    python -m samples.capture.tracking_mesh      how data/tracking_mesh.npz was made; run by hand, not part of any build

Edges collapse into one of their ends, the cheapest first, by quadric errors (Garland and Heckbert 1997) summed over
the face at rest and in six expressions, so that moving parts keep their vertices. Edges of parts collapse only along
themselves. No collapse folds a triangle over in any of these poses, or makes more than two triangles meet at an edge.
"""

from __future__ import annotations

import heapq
from dataclasses import replace
from typing import Any

import numpy as np
import numpy.typing as npt

from samples.subjects.body_model import BodyModel, back_of_head, regressor
from samples.subjects.head import DATA, Head, load_head, unit
from samples.systems.gaussian_blendshapes import FEATURE, FINE, face_regions

Array = npt.NDArray[Any]

PATH = DATA / "tracking_mesh.npz"
VERTICES = 6000
POSES: tuple[tuple[str, ...], ...] = (
    (),
    ("jawOpen",),
    ("eyeBlinkLeft", "eyeBlinkRight"),
    ("mouthSmileLeft", "mouthSmileRight"),
    ("mouthPucker",),
    ("browInnerUp", "browOuterUpLeft", "browOuterUpRight"),
    ("noseSneerLeft", "noseSneerRight", "cheekPuff"),
)
# How much an error counts, by region and by part.
REGION_WEIGHT = {FEATURE: 3.0, FINE: 12.0}
PART_WEIGHT = {
    "mouth_socket": 0.1,
    "eye_sockets": 0.03,
    "upper_gums": 0.03,
    "lower_gums": 0.03,
    "upper_teeth": 0.08,
    "lower_teeth": 0.08,
}
EDGE_WEIGHT = 10.0  # weight of the planes on edges of parts, relative to those of triangles
LENGTH_COST = 2e-4  # of an edge's squared length times the area around it: flat regions stay even
FOLD = 0.2  # least cosine between a triangle's normals before and after
LEAST_SHAPE = 0.12  # of a triangle after a collapse, 1 for an equilateral one, unless it was as thin before


class Collapse:
    """A mesh while its edges collapse."""

    def __init__(self, poses: Array, triangles: Array, part: Array, weight: Array) -> None:
        """`poses` [P, V, 3] metres; `part` and `weight` [F]."""
        self.poses, self.part, self.weight = poses.transpose(1, 0, 2).copy(), part, weight
        self.triangles = triangles.copy()
        self.around: list[set[int]] = [set() for _ in range(poses.shape[1])]  # triangles at each vertex
        for f, corners in enumerate(triangles.tolist()):
            for v in corners:
                self.around[v].add(f)
        self.alive = poses.shape[1]
        self.version = [0] * poses.shape[1]
        self.locked = self._border_vertices()
        self.quadric, self.area = self._quadrics()

    def neighbours(self, v: int) -> set[int]:
        """Vertices that share a triangle with v."""
        return {int(u) for f in self.around[v] for u in self.triangles[f]} - {v}

    def shared(self, u: int, v: int) -> set[int]:
        """Triangles at the edge u v."""
        return self.around[u] & self.around[v]

    def is_border(self, u: int, v: int) -> bool:
        """Whether the edge bounds the mesh or a part."""
        faces = self.shared(u, v)
        return len(faces) != 2 or len({int(self.part[f]) for f in faces}) > 1

    def cost(self, u: int, v: int) -> float:
        """The cost of moving u into v."""
        at = np.append(self.poses[v], np.ones((self.poses.shape[1], 1)), axis=1)
        error = np.einsum("pi,pij,pj->", at, self.quadric[u] + self.quadric[v], at)
        length = np.sum((self.poses[u, 0] - self.poses[v, 0]) ** 2)
        return float(error + LENGTH_COST * length * (self.area[u] + self.area[v]))

    def allowed(self, u: int, v: int) -> bool:
        """Whether u may move into v: topology, borders, no folds."""
        faces = self.shared(u, v)
        if not faces or (self.locked[u] and not (self.locked[v] and self.is_border(u, v))):
            return False
        if self.locked[u] and sum(self.is_border(u, w) for w in self.neighbours(u)) != 2:
            return False
        opposite = {int(w) for f in faces for w in self.triangles[f]} - {u, v}
        if self.neighbours(u) & self.neighbours(v) != opposite or len(opposite) != len(faces):
            return False
        rest = np.array(sorted(self.around[u] - faces))
        if not len(rest):
            return False
        corners = self.triangles[rest]
        before, after = (self._shapes(c) for c in (corners, np.where(corners == u, v, corners)))
        turned = np.sum(before[0] * after[0], axis=-1) < FOLD
        thin = after[1] < np.minimum(LEAST_SHAPE, before[1])
        return not (turned.any() or thin[:, 0].any())

    def collapse(self, u: int, v: int) -> set[int]:
        """Move u into v; returns the vertices whose edges have a new cost."""
        for f in self.shared(u, v):
            for w in self.triangles[f]:
                self.around[w].discard(f)
        for f in self.around[u]:
            self.triangles[f][self.triangles[f] == u] = v
            self.around[v].add(f)
        self.around[u] = set()
        self.quadric[v] += self.quadric[u]
        self.area[v] += self.area[u]
        self.alive -= 1
        touched = self.neighbours(v) | {v}
        for w in (*touched, u):
            self.version[w] += 1
        return touched

    def _shapes(self, corners: Array) -> tuple[Array, Array]:
        """(unit normals [F, P, 3], shape [F, P]: 1 for an equilateral triangle, 0 for a flat one)."""
        a, b, c = (self.poses[corners[:, i]] for i in range(3))
        normal = np.cross(b - a, c - a)
        length = sum(np.sum(e * e, axis=-1) for e in (b - a, c - b, a - c))
        return unit(normal), 2 * np.sqrt(3) * np.linalg.norm(normal, axis=-1) / np.maximum(length, 1e-20)

    def _border_vertices(self) -> list[bool]:
        locked = [False] * len(self.around)
        for u in range(len(locked)):
            for v in self.neighbours(u):
                if self.is_border(u, v):
                    locked[u] = locked[v] = True
        return locked

    def _quadrics(self) -> tuple[Array, Array]:
        """(quadric [V, P, 4, 4], weighted area [V]) of the planes around each vertex."""
        v, p = self.poses.shape[:2]
        quadric, area = np.zeros((v, p, 4, 4)), np.zeros(v)
        corner = self.poses[self.triangles]  # [F, 3, P, 3]
        normal = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
        size = np.linalg.norm(normal, axis=-1) / 2 * self.weight[:, None]
        normal = unit(normal)
        plane = np.append(normal, -np.sum(normal * corner[:, 0], axis=-1)[..., None], axis=-1)
        own = size[..., None, None] * plane[..., None] * plane[..., None, :]
        for i in range(3):
            np.add.at(quadric, self.triangles[:, i], own)
            np.add.at(area, self.triangles[:, i], size[:, 0])
            j = (i + 1) % 3
            ends = self.triangles[:, [i, j]]
            border = np.array(
                [self.locked[a] and self.locked[b] and self.is_border(a, b) for a, b in ends.tolist()]
            )
            along = corner[border, j] - corner[border, i]
            wall = unit(np.cross(along, normal[border]))
            plane = np.append(wall, -np.sum(wall * corner[border, i], axis=-1)[..., None], axis=-1)
            strength = EDGE_WEIGHT * np.sum(along**2, axis=-1) * self.weight[border, None]
            standing = strength[..., None, None] * plane[..., None] * plane[..., None, :]
            for end in ends[border].T:
                np.add.at(quadric, end, standing)
        return quadric, area


def simplified(mesh: Collapse, vertices: int) -> None:
    """Collapse edges, the cheapest first, until `vertices` are left."""
    heap: list[tuple[float, int, int, int, int]] = []

    def offer(u: int, v: int) -> None:
        heapq.heappush(heap, (mesh.cost(u, v), u, v, mesh.version[u], mesh.version[v]))

    for u in range(len(mesh.around)):
        for v in mesh.neighbours(u):
            offer(u, v)
    while mesh.alive > vertices:
        _, u, v, *versions = heapq.heappop(heap)
        if versions != [mesh.version[u], mesh.version[v]] or not mesh.allowed(u, v):
            continue
        touched = mesh.collapse(u, v)
        for a in touched:
            for b in mesh.neighbours(a):
                if a in touched or b in touched:
                    offer(a, b)
                    offer(b, a)


def importance(head: Head) -> Array:
    """How much an error counts [F]."""
    weight = np.ones(len(head.triangles))
    regions = face_regions(head)
    for region, factor in REGION_WEIGHT.items():
        weight[regions == region] = factor
    for part, factor in PART_WEIGHT.items():
        weight[head.triangles_in(part)] = factor
    return weight


def load_tracking_head(head: Head) -> tuple[Head, Array]:
    """(the coarse copy of `head`, the rows [v] of its vertices in `head`)."""
    with np.load(PATH, allow_pickle=False) as file:
        rows, triangles, part = (file[name].astype(np.int64) for name in ("rows", "triangles", "part"))
    coarse = replace(
        head,
        vertices=head.vertices[rows],
        colors=head.colors[rows],
        triangles=triangles,
        part=part,
        expressions=head.expressions[:, rows],
        identity=head.identity[:, rows],
    )
    return coarse, rows


def tracking_body(head: Head, body: BodyModel) -> BodyModel:
    """The body model of the coarse head: rows of `body`, with the same joints."""
    coarse, rows = load_tracking_head(head)
    shapes = body.shapedirs_expression[rows]
    return replace(
        body,
        v_template=body.v_template[rows],
        faces=coarse.triangles.astype(np.int32),
        face_part=coarse.part.astype(np.uint8),
        shapedirs_identity=body.shapedirs_identity[rows],
        shapedirs_expression=shapes,
        posedirs=body.posedirs[rows],
        J_regressor=regressor(coarse, body.joints, shapes, False).astype(np.float32),
        lbs_weights=body.lbs_weights[rows],
        l_eyelid=body.l_eyelid[rows],
        r_eyelid=body.r_eyelid[rows],
        back_of_head_faces=back_of_head(coarse),
    )


def main() -> None:
    head = load_head()
    poses = np.array([head.vertices + sum(map(head.expression, names), np.zeros(3)) for names in POSES])
    mesh = Collapse(poses, head.triangles, head.part, importance(head))
    simplified(mesh, VERTICES)
    kept = np.array(sorted({f for faces in mesh.around for f in faces}))
    rows, flat = np.unique(mesh.triangles[kept], return_inverse=True)
    np.savez_compressed(
        PATH,
        rows=rows.astype(np.uint16),
        triangles=flat.reshape(-1, 3).astype(np.uint16),
        part=head.part[kept].astype(np.uint8),
    )


if __name__ == "__main__":
    main()
