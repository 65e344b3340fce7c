"""What the tracker knows of a film: the camera, the person's identity, and pose and expression of each frame."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from avatar_runtime import F64
from avatar_runtime import rotation as runtime_rotation


@dataclass(frozen=True)
class Fit:
    """Of T frames. Camera space: x right, y down, z forward; metres; pixel centres at half integers."""

    focal: float  # pixels
    principal: F64  # [2] pixels
    identity: F64  # [I] standard deviations
    weights: F64  # [T, K] 0..1
    rotation: F64  # [T, 3, 3] camera from head
    translation: F64  # [T, 3]

    def __len__(self) -> int:
        return len(self.weights)

    def of(self, rows: F64 | slice | list[int]) -> Fit:
        """Some frames."""
        return replace(
            self, weights=self.weights[rows], rotation=self.rotation[rows], translation=self.translation[rows]
        )

    def in_camera(self, points: F64) -> F64:
        """[T, P, 3] of points in head space, [T, P, 3] or [P, 3]."""
        return points @ self.rotation.transpose(0, 2, 1) + self.translation[:, None]

    def pixels(self, camera: F64) -> F64:
        """[T, P, 2] of points in camera space."""
        result: F64 = self.focal * camera[..., :2] / camera[..., 2:] + self.principal
        return result

    def scaled(self, factor: float, shift: F64) -> Fit:
        """The same for images whose pixels are `factor` times (old pixel - shift)."""
        return replace(self, focal=self.focal * factor, principal=(self.principal - shift) * factor)

    def moved(self, turn: F64, shift: F64, weights: F64) -> Fit:
        """Turned by rotation vectors [T, 3] about the head's origin in camera axes, shifted [T, 3]; weights added."""
        return replace(
            self,
            rotation=runtime_rotation.matrix_from_rotvec(turn) @ self.rotation,
            translation=self.translation + shift,
            weights=np.clip(self.weights + weights, 0, 1),
        )
