"""What becomes of neck and shoulders: the mask ends softly at the neck, or the chest stays while the head turns on it.

A head that turns leaves its shoulders where they are. If a film shows them, the head's turns become turns of the neck
joint, and the root stays as the chest does; the mask then ends at the lower edge of the model's bust.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
import numpy.typing as npt

from avatar_runtime import F64, I64
from avatar_trainer.film.fit.pose import Fit
from avatar_trainer.head import JOINTS, NECK, ROOT, BodyModel, Head, load_tracking_head, neck_height

# Heights (`neck_height`, metres): below SIDES only what the mesh covers is kept, so no shoulder beside the neck; where
# the mesh is taken to end, with and without a chest.
SIDES, NECK_END, BUST_END, RING = -0.065, -0.105, -0.165, 0.006
AROUND, SOFT = 0.05, 0.03  # of the face's height: how far around the mesh is kept, how softly that ends
SHOULDERS = 1.35  # widths of the neck: a person as wide below the neck shows shoulders
OFTEN = 0.8  # share of the frames that show them
TURNS = np.radians(3.0)  # deviation of the head's rotation from which a chest can be told from the head

Grey = npt.NDArray[np.uint8]


@dataclass(frozen=True)
class Chest:
    """How the root stands, and what of the person is kept."""

    rotation: F64 | None  # [3, 3] camera from root in all frames; None: the root turns with the head
    joint: F64  # [3] the neck joint at rest, metres
    vertices: F64  # [v, 3] of the coarse mesh at rest
    expressions: F64  # [K, v, 3]
    root_share: F64  # [v] how much of a vertex follows the root
    triangles: I64  # [f, 3] those that are kept
    sides: F64  # [n, 3] the ring below which only the mesh is kept

    @staticmethod
    def of(head: Head, body: BodyModel, rotation: F64 | None) -> Chest:
        """For a person's head and the body model of its coarse mesh."""
        coarse, _ = load_tracking_head(head)
        height = neck_height(coarse.vertices)
        kept = height > (NECK_END if rotation is None else BUST_END)
        return Chest(
            rotation,
            body.joints[NECK].astype(np.float64),
            coarse.vertices,
            coarse.expressions.astype(np.float64),
            body.lbs_weights[:, ROOT].astype(np.float64),
            coarse.triangles[kept[coarse.triangles].all(axis=1)],
            coarse.vertices[(np.abs(height - SIDES) < RING) & (coarse.vertices[:, 2] < 0.03)],
        )

    def root_pose(self, one: Fit) -> tuple[F64, F64, dict[str, F64]]:
        """(R, t of the camera from the root, rotation matrices of joints) of a fit of one frame."""
        turn, shift = one.rotation[0], one.translation[0]
        if self.rotation is None:
            return turn, shift, {}
        there = turn @ self.joint + shift
        return self.rotation, there - self.rotation @ self.joint, {JOINTS[NECK]: self.rotation.T @ turn}

    def kept(self, one: Fit, size: tuple[int, int], face: float) -> F64:
        """[H, W] 0..1 what of a frame's person is kept; `face`: its height in pixels."""
        rotation, shift, _ = self.root_pose(one)
        posed = self.vertices + np.tensordot(one.weights[0], self.expressions, 1)
        with_head = posed @ one.rotation[0].T + one.translation[0]
        with_root = posed @ rotation.T + shift
        camera = with_head + self.root_share[:, None] * (with_root - with_head)
        drawn = np.zeros(size[::-1], np.uint8)
        for corners in np.round((one.pixels(camera)[self.triangles] - 0.5) * 16).astype(np.int32):
            cv2.fillConvexPoly(drawn, corners, 1, shift=4)
        away = cv2.distanceTransform(1 - drawn, cv2.DIST_L2, 3)
        mesh = np.clip((AROUND * face - away) / (2 * SOFT * face) + 0.5, 0, 1)
        ring = one.pixels(one.in_camera(self.sides))[0]
        slope, height = np.polyfit(ring[:, 0], ring[:, 1], 1)
        y, x = np.mgrid[: size[1], : size[0]] + 0.5
        above = np.clip((slope * x + height - y) / (2 * SOFT * face) + 0.5, 0, 1)
        result: F64 = np.maximum(mesh, above)
        return result


def still_chest(fit: Fit, head: Head, masks: list[Grey], rows: I64) -> F64 | None:
    """[3, 3] how the chest stands in a film that shows shoulders; None where there are none, or the head never turns.

    `masks` of the frames `rows`.
    """
    u, _, vt = np.linalg.svd(fit.rotation.mean(axis=0))
    middle = u @ vt
    cosine = (np.einsum("tij,ij->t", fit.rotation, middle) - 1) / 2
    if np.sqrt(np.mean(np.arccos(np.clip(cosine, -1, 1)) ** 2)) < TURNS:
        return None
    ring = head.vertices[np.abs(neck_height(head.vertices) - NECK_END) < RING]
    wide = 0
    for row, mask in zip(rows, masks, strict=True):
        one = fit.of(slice(row, row + 1))
        at = one.pixels(one.in_camera(ring))[0]
        low = int(at[:, 1].max() + 0.25 * np.ptp(at[:, 0]))
        wide += low < len(mask) and np.count_nonzero(mask[low] > 127) > SHOULDERS * np.ptp(at[:, 0])
    return middle if wide > OFTEN * len(rows) else None
