"""A trained model's own renderer against its bundle, on poses and views that were not trained on.

The live model is drawn by rasteriser `cpu`, as in training. One more row draws the same live model by the definition,
rasteriser `torch`: it shows whether the images that the bundle is compared with are right themselves.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from rich.table import Table

from avatar_runtime import Avatar, AvatarError, Image, Player
from avatar_trainer.captures.model import Capture, Frame
from avatar_trainer.evaluation.bundle import pose_of
from avatar_trainer.systems.drawing import Drawing, draw
from avatar_trainer.systems.protocol import System
from avatar_trainer.tensors import Rendered

# Rounding decides at thresholds: whether alpha reaches 1/255, whether a splat ends a pixel, which tiles a radius
# reaches, and which of two splats of nearly equal depth comes first. A pixel where it decided otherwise is counted.
FLIP = 1e-4
MOST_FLIPPED = 1e-4  # of all pixels; at most 6e-5 on the shipped samples (`python -m samples.trained`)
FURTHEST = (
    0.05  # 1.5 times the largest change of a pixel measured when two splats of equal depth change places
)
TRAINED = "trainer"  # the raster profile that training draws with
DEFINITION = "torch"  # the rasteriser that defines images and gradients
LIVE = f"live model, {DEFINITION}"  # in the column of backends
BACKENDS = (("reference", TRAINED), ("cpu", TRAINED), ("gl", "engine"))


@dataclass(frozen=True)
class Row:
    """One backend against the trainer's renderer over all compared frames."""

    backend: str  # of the runtime, or LIVE
    profile: str
    frames: int
    pixels: int  # of all the frames together
    largest: float  # difference of colour or alpha, 0..1, over all pixels except the flipped ones
    flipped: int  # pixels that differ by more than FLIP
    furthest: float  # the largest difference of those; infinite if a pixel is NaN
    psnr_db: float  # inside the mask (where the trainer draws anything), the worst frame; infinite: equal

    @property
    def holds(self) -> bool:
        """Whether rounding explains the number of flipped pixels."""
        return self.flipped <= 2 + MOST_FLIPPED * self.pixels and self.furthest <= FURTHEST


def playable(avatar: Avatar) -> tuple[list[tuple[str, str]], list[str]]:
    """(those of BACKENDS that run here, a line for each engine backend that does not).

    `gl` is an extra of its own and needs a driver. Raises AvatarError for a backend that training needs, too.
    """
    found, missing = [], []
    for backend, profile in BACKENDS:
        try:
            Player(avatar, backend)
        except AvatarError as error:
            if profile == TRAINED:
                raise
            missing.append(f"{backend} is not compared: {error}")
        else:
            found.append((backend, profile))
    return found, missing


def compare(
    system: System, avatar: Avatar, every: int = 1, backends: Iterable[tuple[str, str]] = BACKENDS
) -> list[Row]:
    """Every `every`-th held-out frame of the system's capture, in its own view.

    One row for each (backend, profile), and one for LIVE. `avatar` is the one that was read back from the bundle.
    Raises AvatarError if a backend's library is missing, or if no frame is held out.
    """
    frames = system.capture.test[::every]
    if not frames:
        raise AvatarError(
            "has no held-out frames (split test), so there is nothing to compare", file=system.capture.folder
        )
    wanted = [_image(draw(system, frame)) for frame in frames]
    rows = [
        _row(backend, profile, wanted, _played(system.capture, avatar, frames, backend, profile))
        for backend, profile in backends
    ]
    defined = (_image(draw(system, frame, by=Drawing(DEFINITION))) for frame in frames)
    return [*rows, _row(LIVE, TRAINED, wanted, defined)]


def table(rows: Iterable[Row]) -> Table:
    """The rows as they are shown."""
    shown = Table(box=None, pad_edge=False)
    for title in ("backend", "profile"):
        shown.add_column(title)
    for title in ("frames", "largest difference", "flipped pixels", "largest of those", "worst PSNR dB"):
        shown.add_column(title, justify="right")
    for row in rows:
        numbers = (f"{row.largest:.2g}", str(row.flipped), f"{row.furthest:.2g}")
        if row.profile != TRAINED:  # all pixels differ: only the PSNR is meaningful
            numbers = ("-", "-", "-")
        shown.add_row(row.backend, row.profile, str(row.frames), *numbers, f"{row.psnr_db:.1f}")
    return shown


def _image(rendered: Rendered) -> Image:
    return Image(rendered.colour.numpy(), 1 - rendered.alpha.numpy())


def _played(
    capture: Capture, avatar: Avatar, frames: Iterable[Frame], backend: str, profile: str
) -> Iterator[Image]:
    player = Player(avatar, backend)
    for frame in frames:
        yield player.frame(pose_of(capture, avatar, frame), frame.camera, (0.0, 0.0, 0.0), profile).image


def _row(backend: str, profile: str, wanted: Sequence[Image], drawn: Iterable[Image]) -> Row:
    largest, flipped, furthest, psnr, pixels = 0.0, 0, 0.0, np.inf, 0
    for want, got in zip(wanted, drawn, strict=True):
        difference = got.colour.astype(np.float64) - want.colour
        difference_alpha = want.transmittance - got.transmittance.astype(np.float64)
        off = np.maximum(np.abs(difference).max(axis=-1), np.abs(difference_alpha))
        off[~np.isfinite(off)] = np.inf
        flips = off > FLIP
        largest = max(largest, float(off[~flips].max(initial=0.0)))
        flipped, pixels = flipped + int(flips.sum()), pixels + off.size
        furthest = max(furthest, float(off[flips].max(initial=0.0)))
        psnr = min(psnr, _psnr_db(difference[want.transmittance < 1]))
    return Row(backend, profile, len(wanted), pixels, largest, flipped, furthest, psnr)


def _psnr_db(difference: npt.NDArray[np.float64]) -> float:
    """Peak 1; infinite for equal images, minus infinite for NaN."""
    noise = float(np.mean(np.square(difference))) if difference.size else 0.0
    if noise == 0:
        return np.inf
    return float(-10 * np.log10(noise)) if np.isfinite(noise) else -np.inf
