"""One scan that an ASM face is fitted to: the part that is fitted, its motion, and its distance from the face."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import torch
from torch import Tensor

from avatar_runtime import F64, I64, AvatarError
from avatar_trainer.asm.align import Placement, Scan, in_face, keypoint_rows, placed_by_pairs
from avatar_trainer.asm.kernels.closest import TriangleTree, point_to_surface
from avatar_trainer.asm.model import rotation_matrices
from avatar_trainer.asm.register.settings import RegisterSettings
from avatar_trainer.asm.strain import Edges
from avatar_trainer.normals import vertex_normals


class Target:
    """A scan, placed by its keypoints, or not moved if it is `placed`.

    Raises AvatarError for degenerate keypoints, and for a scan without points in the facial region.
    """

    def __init__(self, scan: Scan, goal: dict[str, F64], settings: RegisterSettings) -> None:
        self.scan = scan
        self.start = Placement(np.eye(3), np.zeros(3)) if settings.placed else _start(scan, goal, settings)
        rows = in_face(scan.points, scan.keypoints, settings.widened)
        if scan.vertex is not None:
            rows = rows[scan.vertex[rows] >= 0]
        if not len(rows):
            raise AvatarError(
                "has no point in the facial region; are the keypoints in its unit?", file=scan.name
            )
        self.middle = self.start.apply(keypoint_rows(scan.keypoints)).mean(axis=0)
        self.arm = torch.from_numpy(self.start.apply(scan.points[rows]) - self.middle).float()
        self.vertex = None if scan.vertex is None else torch.from_numpy(scan.vertex[rows])
        self.known: Tensor | None = None  # bool [E] edges between known vertices, computed on demand
        self.normal: Tensor | None = None
        if scan.triangles is not None and scan.vertex is None:
            normal = vertex_normals(scan.points, scan.triangles)[rows] @ self.start.rotation.T
            self.normal = torch.from_numpy(normal).float()
        self.turn, self.shift = torch.zeros(3, requires_grad=True), torch.zeros(3, requires_grad=True)
        self.guess: I64 | None = None

    def points(self) -> Tensor:
        """The fitted part [n, 3] in the template's space."""
        return self.arm @ rotation_matrices(self.turn).T + (
            torch.from_numpy(self.middle).float() + self.shift
        )

    def apart(self, vertices: Tensor, tree: TriangleTree, cap: float, facing: float) -> Tensor:
        """The mean of the points' squared distances to a mesh [v, 3], of those up to `cap`, both in square metres.

        Points of scans with triangles count only where the cosine of their normal and the mesh's is above `facing`:
        nearest points alone pull the skin around nostrils and lips inwards. Known vertices always count.
        """
        points = self.points()
        if self.vertex is not None:
            squared = (points - vertices[self.vertex]).square().sum(-1)
        else:
            squared, found = point_to_surface(points, vertices, tree, self.guess)
            self.guess = found.triangle
        counted = squared.detach() < cap
        if self.normal is not None and self.guess is not None:
            counted &= self._agree(vertices.detach(), tree, self.guess) > facing
        return (squared * counted).mean()

    def even(self, first: Edges) -> Edges:
        """The reference for the strain of a face: the first mesh, or known vertices of the scan.

        Known vertices may move freely; the face's distance from them should vary slowly over it.
        """
        if self.vertex is None:
            return first
        if self.known is None:
            self.known = torch.isin(first.ends, self.vertex).all(0)
        goal = first.vertices.index_put((self.vertex,), self.points())
        return replace(first, ends=first.ends[:, self.known], length=first.length[self.known], vertices=goal)

    def placement(self) -> Placement:
        """Of the scan, as it is moved now."""
        rotation = rotation_matrices(self.turn.detach().double()).numpy()
        shift = self.shift.detach().double().numpy()
        return Placement(rotation, self.middle - rotation @ self.middle + shift).after(self.start)

    @torch.no_grad()
    def _agree(self, vertices: Tensor, tree: TriangleTree, triangle: I64) -> Tensor:
        """Cosines [n] of the points' normals and those of the triangles [n] of the mesh."""
        assert self.normal is not None
        a, b, c = vertices[torch.from_numpy(tree.triangles[triangle])].unbind(1)
        across = torch.linalg.cross(b - a, c - a)
        turned = self.normal @ rotation_matrices(self.turn).T
        return (turned * torch.nn.functional.normalize(across, dim=-1, eps=1e-30)).sum(-1)


def _start(scan: Scan, goal: dict[str, F64], settings: RegisterSettings) -> Placement:
    try:
        return placed_by_pairs(keypoint_rows(scan.keypoints), keypoint_rows(goal), settings.similarity)
    except ValueError as error:
        raise AvatarError(str(error), file=scan.name, field="keypoints") from None
