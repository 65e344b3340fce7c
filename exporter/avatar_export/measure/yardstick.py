"""How far an avatar is from its source: PSNR of images, and distances of positions."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from avatar_export.measure.poses import NamedPose
from avatar_export.measure.views import NamedView
from avatar_runtime.avatar import F32, F64, Avatar
from avatar_runtime.camera import Camera
from avatar_runtime.player import ABSURD, Player
from avatar_runtime.posed import Clock, Posed

MASK_ALPHA = 0.5
LARGEST_DB = 150.0  # float32 images cannot show less; images that are equal have this figure
BLACK = np.zeros(3, np.float32)
Mask = npt.NDArray[np.bool_]


@dataclass(frozen=True)
class Measured:
    """The figures of one avatar against its source. PSNR: -10 log10 of the mean squared error of RGB, in dB."""

    poses: tuple[str, ...]  # [P] names
    views: tuple[str, ...]  # [V] names
    whole: F64  # [P, V] PSNR of the whole image
    inside: F64  # [P, V] PSNR where the source's alpha is above 0.5; NaN where that is nowhere
    position_error: F64 | None  # [P] metres, the largest; None where the numbers of Gaussians differ
    size: tuple[int, int]  # width and height of the first view, pixels
    backend: str
    profile: str  # of the rasteriser

    @property
    def psnr(self) -> float:
        """Mean PSNR of the whole image."""
        return float(self.whole.mean())

    @property
    def worst_psnr(self) -> float:
        """The lowest PSNR of a whole image."""
        return float(self.whole.min())

    @property
    def psnr_inside(self) -> float | None:
        """Mean PSNR inside the source's mask; None where the source covers nothing."""
        return None if np.isnan(self.inside).all() else float(np.nanmean(self.inside))

    @property
    def worst_inside(self) -> float | None:
        """The lowest PSNR inside the source's mask; None where the source covers nothing."""
        return None if np.isnan(self.inside).all() else float(np.nanmin(self.inside))

    def as_json(self) -> dict[str, Any]:
        """The figures as JSON values, rounded to 0.001 dB and six digits of a metre; None stands for no figure."""
        rows: list[dict[str, Any]] = [
            {"name": name, "psnr_db": _rounded(whole), "psnr_mask_db": _rounded(inside)}
            for name, whole, inside in zip(self.poses, self.whole, self.inside, strict=True)
        ]
        position = None
        if self.position_error is not None:
            worst = int(np.argmax(self.position_error))
            position = {"metres": _digits(self.position_error[worst]), "pose": self.poses[worst]}
            for row, error in zip(rows, self.position_error, strict=True):
                row["position_error"] = _digits(error)
        return {
            "size": list(self.size),
            "backend": self.backend,
            "profile": self.profile,
            "views": list(self.views),
            "psnr_db": {"mean": _db(self.psnr), "worst": _db(self.worst_psnr)},
            "psnr_mask_db": {"mean": _db(self.psnr_inside), "worst": _db(self.worst_inside)},
            "position_error": position,
            "poses": rows,
        }


@dataclass(frozen=True)
class Pair:
    """Both images of one pose and view, over black, not clamped."""

    pose: int  # index
    view: int  # index
    source: F32  # [H, W, 3]
    mask: Mask  # [H, W] the source's alpha is above 0.5
    other: F32  # [H, W, 3]


class Yardstick:
    """Measures avatars against one source, whose images are drawn once and kept (13 bytes a pixel, pose and view)."""

    def __init__(
        self,
        source: Avatar,
        poses: Sequence[NamedPose],
        views: Sequence[NamedView],
        backend: str = "cpu",
    ) -> None:
        """Draws the source. Raises ValueError without poses or views, AvatarError where the backend is missing."""
        if not poses or not views:
            raise ValueError("needs at least one pose and one view")
        self.poses, self.views, self.backend = tuple(poses), tuple(views), backend
        player = Player(source, backend)
        self.profile = player.backend.profiles[0]
        self._means: list[F32] = []
        self._images: list[list[tuple[F32, Mask]]] = []
        for mean, images in self._drawn(player):
            self._means.append(mean)
            self._images.append([(image, alpha > MASK_ALPHA) for image, alpha in images])

    def measure(self, other: Avatar) -> Measured:
        """The figures of `other`, which must have the names that the poses use. Raises AvatarError if it has not."""
        shape = (len(self.poses), len(self.views))
        whole, inside = np.empty(shape), np.empty(shape)
        positions: list[float] | None = []
        for pose, (mean, images) in enumerate(self._drawn(Player(other, self.backend))):
            if positions is not None:
                same = mean.shape == self._means[pose].shape
                positions = [*positions, distance(self._means[pose], mean)] if same else None
            for view, (image, _) in enumerate(images):
                whole[pose, view], inside[pose, view] = psnr(*self._images[pose][view], image)
        camera = self.views[0].camera
        return Measured(
            tuple(named.name for named in self.poses),
            tuple(named.name for named in self.views),
            whole,
            inside,
            None if positions is None else np.array(positions),
            (camera.width, camera.height),
            self.backend,
            self.profile,
        )

    def pairs(self, other: Avatar) -> Iterator[Pair]:
        """Both images of every pose and view, one pair at a time."""
        for pose, (_, images) in enumerate(self._drawn(Player(other, self.backend))):
            for view, (image, _) in enumerate(images):
                yield Pair(pose, view, *self._images[pose][view], image)

    def _drawn(self, player: Player) -> Iterator[tuple[F32, Iterator[tuple[F32, F32]]]]:
        """Of each pose the positions [N, 3], and of each view the image over black [H, W, 3] and its alpha [H, W]."""
        for named in self.poses:
            posed = player.posed(named.pose)
            images = (_image(player, posed, view.camera, self.profile) for view in self.views)
            yield _mean(player, posed), images


def compare(
    source: Avatar,
    other: Avatar,
    poses: Sequence[NamedPose],
    views: Sequence[NamedView],
    backend: str = "cpu",
) -> Measured:
    """The figures of `other` against `source`. To measure several avatars against one source, keep a `Yardstick`."""
    return Yardstick(source, poses, views, backend).measure(other)


@ABSURD
def _mean(player: Player, posed: Posed) -> F32:
    return player.backend.animate(posed, Clock()).mean


@ABSURD
def _image(player: Player, posed: Posed, camera: Camera, profile: str) -> tuple[F32, F32]:
    image = player.backend.frame(posed, camera, BLACK, profile, Clock())
    return image.colour, 1 - image.transmittance


def psnr(source: F32, mask: Mask, other: F32) -> tuple[float, float]:
    """PSNR of images [H, W, 3] in dB, peak 1: whole, and inside `mask` [H, W] (NaN for an empty mask).

    At most LARGEST_DB; an error that is not finite counts as -LARGEST_DB.
    """
    with np.errstate(all="ignore"):
        error = other - source
        square = np.einsum("hwc,hwc->hw", error, error)  # [H, W]
        whole = square.sum(dtype=np.float64) / (3 * mask.size)
        inside = square[mask]
    return _psnr(whole), (
        _psnr(inside.sum(dtype=np.float64) / (3 * inside.size)) if inside.size else float("nan")
    )


def distance(a: F32, b: F32) -> float:
    """The largest distance of two rows of [N, 3]; infinite if one is not finite."""
    with np.errstate(all="ignore"):
        square = np.sum((a.astype(np.float64) - b) ** 2, axis=1)
    worst = float(np.sqrt(square.max(initial=0.0)))
    return worst if np.isfinite(worst) else float("inf")


def _psnr(mean_square: float) -> float:
    if not np.isfinite(mean_square):
        return -LARGEST_DB
    return float(min(LARGEST_DB, -10 * np.log10(max(mean_square, 1e-300))))


def _rounded(values: F64) -> list[float | None]:
    return [_db(float(value)) for value in values]


def _db(value: float | None) -> float | None:
    return None if value is None or np.isnan(value) else round(value, 3)


def _digits(metres: float) -> float | None:
    return float(f"{metres:.6g}") if np.isfinite(metres) else None
