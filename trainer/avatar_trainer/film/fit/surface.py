"""Points of the head model's surface, and how identity and expressions move them: what every stage looks at."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from avatar_runtime import F32, F64, I64
from avatar_trainer.head import Head


@dataclass(frozen=True)
class SurfacePoints:
    """P points in head space, metres."""

    neutral: F64  # [P, 3] of the mean head
    identity: F32  # [P, I, 3] by one standard deviation of each mode
    expression: F32  # [P, K, 3] by each expression at full weight

    @staticmethod
    def at_vertices(head: Head, rows: I64) -> SurfacePoints:
        """The vertices `rows` [P]."""
        return SurfacePoints(
            head.vertices[rows],
            np.ascontiguousarray(head.identity[:, rows].transpose(1, 0, 2), np.float32),
            np.ascontiguousarray(head.expressions[:, rows].transpose(1, 0, 2), np.float32),
        )

    @staticmethod
    def on_triangles(head: Head, corners: I64, barycentric: F64) -> SurfacePoints:
        """Points with corners [P, 3] and barycentrics [P, 3]."""
        share = barycentric.astype(np.float64)
        return SurfacePoints(
            np.einsum("pc,pcx->px", share, head.vertices[corners]),
            np.einsum("pc,ipcx->pix", share, head.identity[:, corners], optimize=True).astype(np.float32),
            np.einsum("pc,kpcx->pkx", share, head.expressions[:, corners], optimize=True).astype(np.float32),
        )

    @staticmethod
    def joined(*parts: SurfacePoints) -> SurfacePoints:
        """The points of all parts, one after the other."""
        return SurfacePoints(
            np.concatenate([part.neutral for part in parts]),
            np.concatenate([part.identity for part in parts]),
            np.concatenate([part.expression for part in parts]),
        )

    def of_person(self, identity: F64) -> F64:
        """[P, 3] with the identity [I], at rest."""
        moved: F64 = self.neutral + np.einsum("pix,i->px", self.identity, identity)
        return moved

    def posed(self, identity: F64, weights: F64) -> F64:
        """[T, P, 3] in head space with weights [T, K]."""
        moved = np.tensordot(weights, self.expression.astype(np.float64), axes=(1, 1))
        result: F64 = self.of_person(identity) + moved
        return result
