"""Images of the whole avatar: drawn, turned into bytes, compared."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
import numpy.typing as npt

from avatar_runtime.avatar import F32, Avatar
from avatar_runtime.backends.reference import ReferenceBackend
from avatar_runtime.conformance.model import Case, View
from avatar_runtime.player import ABSURD, Player
from avatar_runtime.posed import Clock
from avatar_runtime.stages.raster import Image, raster
from avatar_runtime.stages.sort import sort

BYTE_ROUNDING = 0.5


@ABSURD
def draw(avatar: Avatar, case: Case, profiles: Iterable[str]) -> dict[str, Image]:
    """The NumPy stages' image in each profile; the stages before raster run once."""
    posed = Player(avatar, "reference", light=case.light).posed(case.pose)
    seen = ReferenceBackend(avatar).seen(posed, case.camera, Clock())
    order, background = sort(seen), np.array(case.background, np.float32)
    return {profile: raster(seen, order, case.camera, background, profile) for profile in profiles}


def view(image: Image) -> View:
    """Colour over the background and alpha, in bytes."""
    return View(_bytes(image.colour), _bytes(1 - image.transmittance))


def psnr_db(a: Image, b: Image) -> float | None:
    """Peak signal (1) to noise of the colours where either draws something; None where they are equal."""
    mask = (a.transmittance < 1) | (b.transmittance < 1)
    with np.errstate(invalid="ignore"):  # of colours that are infinite
        return _psnr(a.colour[mask].astype(np.float64) - b.colour[mask])


def compare(image: Image, want: View) -> tuple[float, float | None]:
    """(largest difference of colour and alpha in units of 1/255, PSNR of the colour where either draws something).

    The difference is that to the nearest value that rounds to the reference's byte, so rounding neither hides nor
    makes one. The PSNR is that of the bytes; None where they are equal.
    """
    colour = np.clip(image.colour, 0, 1).astype(np.float64) * 255 - want.colour
    alpha = (1 - image.transmittance.astype(np.float64)) * 255 - want.alpha
    mask = (image.transmittance < 1) | (want.alpha > 0)
    worst = max(_largest(colour), _largest(alpha))
    return worst, _psnr((view(image).colour[mask] - want.colour[mask].astype(np.float64)) / 255)


def _largest(difference: npt.NDArray[np.float64]) -> float:
    """Largest magnitude beyond half a byte's step; NaN counts as infinite."""
    beyond = np.nan_to_num(np.abs(difference) - BYTE_ROUNDING, nan=np.inf)
    return float(beyond.max(initial=0.0))


def _psnr(difference: npt.NDArray[np.float64]) -> float | None:
    noise = float(np.mean(np.square(difference))) if difference.size else 0.0
    return None if noise == 0 else float(-10 * np.log10(noise))


def _bytes(values: F32) -> npt.NDArray[np.uint8]:
    return (np.clip(np.nan_to_num(values), 0, 1) * 255 + 0.5).astype(np.uint8)
