"""Where MediaPipe's landmarks lie on the head model, how they err, and what its weights say of ours.

Made by `python -m tools.landmark_map` from heads that were drawn. Yaw and pitch, in radians, say from where the camera
sees the head: `seen_from`. The size of a face is the distance of landmarks 10 (forehead) and 152 (chin), seen from the
front at rest.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np

from avatar_runtime import F64, I64

PATH = Path(__file__).parents[1] / "data" / "landmark_map.npz"
COUNT, SKIN = 478, 468  # landmarks; those before the irises
MIDDLE = (0.0, -0.01, 0.06)  # metres in head space: the point that yaw and pitch belong to
LEAST = 0.3  # of a landmark's variance: no yaw makes it surer
REACH = np.radians((45.0, 30.0))  # of yaw and pitch; beyond them a correction stays as it is there


@dataclass(frozen=True)
class LandmarkMap:
    """The table. Units: radians, the face's size, weights 0..1. Errors are those on people and skins held out."""

    triangle_corners: I64  # [478, 3] vertices of the head model
    barycentric: F64  # [478, 3]
    template: F64  # [478, 2] a mean face from the front, y down, its size 1, the mean of the first 468 at 0
    correction: F64  # [478, 2, C] by `features`
    covariance: F64  # [478, 2, 2] of what remains, in the axes of an upright face
    variance_by_yaw: F64  # [478, 3] the same along one axis, a polynomial of the yaw
    film_share: F64  # [478] share of it that stays the same over a film: this face, skin and light
    score_names: tuple[str, ...]  # [52] MediaPipe's, in its order
    names: tuple[str, ...]  # [51] ours
    weight_matrix: F64  # [51, C] by `features`
    weight_variance: F64  # [51, 2] of the true weight about the predicted one: at 0, and more by weight

    @property
    def sigma(self) -> F64:
        """[478] deviation of a corrected landmark along one axis, in sizes of the face."""
        result: F64 = np.sqrt(np.trace(self.covariance, axis1=1, axis2=2) / 2)
        return result

    def sigma_at(self, yaw: F64) -> F64:
        """[..., 478] the same seen from `yaw` [...]: a turned face is less certain."""
        square = np.clip(yaw, -REACH[0], REACH[0])[..., None] ** np.arange(3) @ self.variance_by_yaw.T
        result: F64 = np.sqrt(np.maximum(square, LEAST * self.sigma**2))
        return result

    def frame(self, landmarks: F64) -> tuple[F64, F64]:
        """(size [...] in pixels, roll [...] in radians, clockwise in the picture) of landmarks [..., 478, 2]."""
        turn = self._similarity(landmarks)
        return np.abs(turn), np.angle(turn)

    def corrected(self, landmarks: F64, yaw: F64, pitch: F64, scores: F64) -> F64:
        """Landmarks [..., 478, 2] in pixels, moved to where their surface points are seen.

        `yaw` and `pitch` [...] as from `seen_from`, MediaPipe's `scores` [..., 52].
        """
        error = np.einsum("lxc,...c->...lx", self.correction, features(yaw, pitch, scores))
        moved = (error[..., 0] + 1j * error[..., 1]) * self._similarity(landmarks)[..., None]
        result: F64 = landmarks[..., :2] - np.stack([moved.real, moved.imag], axis=-1)
        return result

    def of_film(self, away: F64, landmarks: F64) -> F64:
        """[478] complex, in sizes of a face: what stays the same of `away` [T, 478, 2], pixels, over a film.

        `away`: corrected landmarks less their places by a fit to the film. The likeliest, where a landmark's deviation
        is that of the film and that of a frame, `film_share` apart. Less it (`placed`), landmarks have the deviation
        sigma * sqrt(1 - film_share).
        """
        turn = self._similarity(landmarks)[:, None]
        kept = self.film_share / (self.film_share + (1 - self.film_share) / len(away))
        found: F64 = kept * np.mean((away[..., 0] + 1j * away[..., 1]) / turn, axis=0)
        return found

    def placed(self, own: F64, landmarks: F64) -> F64:
        """[T, 478, 2] pixels: errors as `of_film` finds them, on these landmarks."""
        same = own * self._similarity(landmarks)[:, None]
        return np.stack([same.real, same.imag], axis=-1)

    def prior(self, scores: F64, yaw: F64, pitch: F64) -> tuple[F64, F64]:
        """(our weights [..., 51], their deviations [..., 51]) by MediaPipe's `scores` [..., 52]."""
        weights = np.clip(features(yaw, pitch, scores) @ self.weight_matrix.T, 0, 1)
        return weights, np.sqrt(self.weight_variance[:, 0] + weights * self.weight_variance[:, 1])

    def _similarity(self, landmarks: F64) -> F64:
        """[...] complex: what scales and turns the template into the landmarks."""
        points = landmarks[..., :SKIN, :2] - landmarks[..., :SKIN, :2].mean(axis=-2, keepdims=True)
        own = self.template[:SKIN, 0] - 1j * self.template[:SKIN, 1]
        result: F64 = (points[..., 0] + 1j * points[..., 1]) @ own / np.sum(np.abs(own) ** 2)
        return result


def features(yaw: F64, pitch: F64, scores: F64) -> F64:
    """[..., C]: 1, yaw and pitch to the third power together, MediaPipe's weights but `_neutral`."""
    x, y = np.clip(yaw, -REACH[0], REACH[0]), np.clip(pitch, -REACH[1], REACH[1])
    powers = [x**i * y**j for n in range(4) for i, j in ((n - k, k) for k in range(n + 1))]
    return np.concatenate([np.stack(powers, axis=-1), scores[..., 1:]], axis=-1)


def seen_from(rotation: F64, translation: F64) -> tuple[F64, F64]:
    """(yaw [...], pitch [...]) of camera_from_head [..., 3, 3], [..., 3]: the camera's direction in head space.

    Positive where the camera stands at the head's left (+X), and above it.
    """
    middle = translation + rotation @ np.array(MIDDLE)
    x, y, z = np.moveaxis(-np.einsum("...ij,...i->...j", rotation, middle), -1, 0)
    return np.arctan2(x, z), np.arctan2(y, np.hypot(x, z))


@cache
def load(path: Path = PATH) -> LandmarkMap:
    """The table that ships."""
    with np.load(path, allow_pickle=False) as file:
        data = {name: file[name] for name in file.files}
    plain = (
        "barycentric",
        "template",
        "correction",
        "variance_by_yaw",
        "film_share",
        "weight_matrix",
        "weight_variance",
    )
    return LandmarkMap(
        triangle_corners=data["triangle_corners"].astype(np.int64),
        covariance=data["covariance"].astype(np.float64)[:, [[0, 1], [1, 2]]],
        score_names=tuple(data["score_names"].tolist()),
        names=tuple(data["names"].tolist()),
        **{name: data[name].astype(np.float64) for name in plain},
    )
