"""How far an avatar is from its source: PSNR of images, single pixels, and distances of positions."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from copy import copy
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from avatar_export.measure.views import Shot
from avatar_runtime.avatar import F32, F64, Avatar
from avatar_runtime.player import ABSURD, Player
from avatar_runtime.posed import Clock

MASK_ALPHA = 0.5
LARGEST_DB = 150.0  # float32 images cannot show less; images that are equal have this figure
BLACK = np.zeros(3, np.float32)
NOWHERE = np.zeros((0, 3), np.float32)
POSITIONS = 4  # of so many shots one compares positions
Mask = npt.NDArray[np.bool_]

# A claim rests on some fifty images. In hundreds, one is worse by so many standard deviations.
TAIL = 3.0


@dataclass(frozen=True)
class Measured:
    """The figures of one avatar against its source in S shots. PSNR: -10 log10 of the mean squared error of RGB, in dB.

    The mean is that of the kind of poses that comes out worst, so that no mixture of kinds is on the average worse.
    """

    shots: tuple[str, ...]  # [S] names of pose and view
    kinds: tuple[str, ...]  # [S] of the poses
    whole: F64  # [S] PSNR of the whole image
    inside: F64  # [S] PSNR where the source's alpha is above 0.5; NaN where that is nowhere
    largest: F64  # [S] the largest error of one channel of a pixel there, of 1; NaN where that is nowhere
    # [S] metres, the largest; NaN in shots without; None where the numbers of Gaussians differ.
    position_error: F64 | None
    size: tuple[int, int]  # width and height of the first view, pixels
    backend: str
    profile: str  # of the rasteriser
    # dB between mean and worst at least: rare images are worse than those that were drawn.
    allowance: float = 0.0

    @property
    def region(self) -> str:
        """Where `mean` and `worst` are measured: in whole images if the source covers nothing."""
        return "of the whole image" if np.isnan(self.inside).all() else "inside the outline"

    @property
    def judged(self) -> F64:
        """[S] PSNR of each shot, as `region` says."""
        return self.whole if np.isnan(self.inside).all() else self.inside

    @property
    def mean(self) -> float:
        """Mean PSNR of the kind of poses that comes out worst."""
        return min(mean for _, mean, _ in self.by_kind())

    @property
    def worst(self) -> float:
        """The lowest PSNR of one shot. With an `allowance` it is TAIL standard deviations about the means of the kinds
        less, and at least `allowance` below the mean."""
        lowest = float(np.nanmin(self.judged))
        if not self.allowance or not np.isfinite(lowest):
            return lowest
        own = {kind: mean for kind, mean, _ in self.by_kind()}
        off = self.judged - np.array([own[kind] for kind in self.kinds])
        return min(lowest - TAIL * float(np.sqrt(np.nanmean(off**2))), self.mean - self.allowance)

    @property
    def worst_pixel(self) -> float | None:
        """The largest error of one channel of one pixel inside the outline, of 1; None where that is nowhere."""
        return None if np.isnan(self.largest).all() else float(np.nanmax(self.largest))

    def by_kind(self) -> list[tuple[str, float, int]]:
        """(kind, its mean PSNR, index of its worst shot) of every kind, in the order of the shots."""
        found = []
        for kind in dict.fromkeys(self.kinds):
            at = [i for i, one in enumerate(self.kinds) if one == kind and not np.isnan(self.judged[i])]
            if at:
                found.append((kind, float(self.judged[at].mean()), min(at, key=lambda i: self.judged[i])))
        return found

    def as_json(self) -> dict[str, Any]:
        """The figures as JSON values, rounded to 0.001 dB and six digits of a metre; None stands for no figure."""
        covered = self.region == "inside the outline"
        position = None
        if self.position_error is not None:
            worst = int(np.nanargmax(self.position_error))
            position = {"metres": _digits(self.position_error[worst]), "pose": self.shots[worst]}
        pixel = self.worst_pixel
        return {
            "size": list(self.size),
            "backend": self.backend,
            "profile": self.profile,
            "psnr_db": {"mean": _db(float(self.whole.mean())), "worst": _db(float(self.whole.min()))},
            "psnr_mask_db": {
                "mean": _db(self.mean) if covered else None,
                "worst": _db(self.worst) if covered else None,
            },
            "pixel_mask": None if pixel is None else _digits(pixel),
            "position_error": position,
            "kinds": [
                {
                    "name": kind,
                    "shots": self.kinds.count(kind),
                    "mean_db": _db(mean),
                    "worst_db": _db(float(self.judged[at])),
                    "worst_shot": self.shots[at],
                }
                for kind, mean, at in self.by_kind()
            ],
        }


@dataclass(frozen=True)
class Pair:
    """Both images of one shot, over black, not clamped."""

    source: F32  # [H, W, 3]
    mask: Mask  # [H, W] the source's alpha is above 0.5
    other: F32  # [H, W, 3]


class Yardstick:
    """Measures many avatars against one source, whose images are drawn once and kept (13 bytes a pixel and shot)."""

    def __init__(self, source: Avatar, shots: Sequence[Shot], backend: str = "cpu") -> None:
        """Draws the source. Raises ValueError without shots, AvatarError where the backend is missing."""
        self.shots, self.backend = tuple(shots), backend
        self._drawn = list(_masked(_drawn(Player(source, backend), self.shots)))

    def first(self, count: int) -> Yardstick:
        """The same in the first `count` shots alone."""
        some = copy(self)
        some.shots, some._drawn = self.shots[:count], self._drawn[:count]
        return some

    def measure(self, other: Avatar) -> Measured:
        """The figures of `other`, which must have the names that the poses use. Raises AvatarError if it has not."""
        return _compared(iter(self._drawn), [other], self.shots, self.backend)[0]


def compare(
    source: Avatar, others: Sequence[Avatar], shots: Sequence[Shot], backend: str = "cpu"
) -> list[Measured]:
    """The figures of each of `others` against `source`; no image is kept. Raises as `Yardstick`."""
    return _compared(_masked(_drawn(Player(source, backend), shots)), others, shots, backend)


def pairs(source: Avatar, other: Avatar, shots: Sequence[Shot], backend: str = "cpu") -> Iterator[Pair]:
    """Both images of every shot, one pair at a time."""
    first, second = (_drawn(Player(avatar, backend), shots) for avatar in (source, other))
    for (_, source_image, mask), (_, image, _) in zip(_masked(first), second, strict=True):
        yield Pair(source_image, mask, image)


def _compared(
    source: Iterator[tuple[F32, F32, Mask]], others: Sequence[Avatar], shots: Sequence[Shot], backend: str
) -> list[Measured]:
    players = [Player(other, backend) for other in others]
    drawn = [_drawn(player, shots) for player in players]
    figures: list[list[tuple[float, float, float]]] = [[] for _ in others]
    positions: list[list[float] | None] = [[] for _ in others]
    for mean, image, mask in source:
        for at, images in enumerate(drawn):
            other_mean, other_image, _ = next(images)
            figures[at].append(psnr(image, mask, other_image))
            kept = positions[at]
            if kept is None or other_mean.shape != mean.shape:
                positions[at] = None
            else:
                kept.append(distance(mean, other_mean) if len(mean) else float("nan"))
    camera = shots[0].view.camera
    found = []
    for figure, position in zip(figures, positions, strict=True):
        whole, inside, largest = np.array(figure).T
        found.append(
            Measured(
                tuple(shot.name for shot in shots),
                tuple(shot.pose.kind for shot in shots),
                whole,
                inside,
                largest,
                None if position is None else np.array(position),
                (camera.width, camera.height),
                backend,
                players[0].backend.profiles[0],
            )
        )
    return found


def _masked(drawn: Iterator[tuple[F32, F32, F32]]) -> Iterator[tuple[F32, F32, Mask]]:
    return ((mean, image, alpha > MASK_ALPHA) for mean, image, alpha in drawn)


def _drawn(player: Player, shots: Sequence[Shot]) -> Iterator[tuple[F32, F32, F32]]:
    """Of each shot the positions [N, 3] (of most none), the image over black [H, W, 3] and its alpha [H, W]."""
    if not shots:
        raise ValueError("needs at least one shot")
    return (_shown(player, shot, at % POSITIONS == 0) for at, shot in enumerate(shots))


@ABSURD
def _shown(player: Player, shot: Shot, with_mean: bool) -> tuple[F32, F32, F32]:
    backend, posed = player.backend, player.posed(shot.pose.pose)
    mean = backend.animate(posed, Clock()).mean if with_mean else NOWHERE
    image = backend.frame(posed, shot.view.camera, BLACK, backend.profiles[0], Clock())
    return mean, image.colour, 1 - image.transmittance


def psnr(source: F32, mask: Mask, other: F32) -> tuple[float, float, float]:
    """PSNR of images [H, W, 3] in dB, peak 1: whole, inside `mask` [H, W]; and the largest error of one channel there.

    NaN inside an empty mask. At most LARGEST_DB; an error that is not finite counts as -LARGEST_DB, and as infinite.
    """
    with np.errstate(all="ignore"):
        error = other - source
        square = np.einsum("hwc,hwc->hw", error, error)  # [H, W]
        whole = square.sum(dtype=np.float64) / (3 * mask.size)
        inside = square[mask]
        if not inside.size:
            return _psnr(whole), float("nan"), float("nan")
        largest = float(np.abs(error[mask]).max())
    mean = inside.sum(dtype=np.float64) / (3 * inside.size)
    return _psnr(whole), _psnr(mean), largest if np.isfinite(largest) else float("inf")


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


def _db(value: float | None) -> float | None:
    return None if value is None or np.isnan(value) else round(value, 3)


def _digits(metres: float) -> float | None:
    return float(f"{metres:.6g}") if np.isfinite(metres) else None
