"""Steps that are in balance: one more bit buys equally much of the image in every attribute."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from avatar_export.measure.yardstick import Measured, Yardstick
from avatar_export.packing.quantise import Kept, quantised
from avatar_export.packing.steps import KEPT_FINE, STEPS, WEIGHTS, Fineness
from avatar_runtime.avatar import F64, Avatar
from avatar_runtime.program.codes import Codes

SHOTS = 3  # of the yardstick's that compare attributes
ALMOST_EXACT = 1 / 32  # factor of the other attributes while one is measured
ZERO = 0.1  # what a number that rounds to 0 costs of one that does not
UNSEEN = 1e-6  # of the squared error of an image
CLOSEST, FARTHEST = 2.0**-6, 4.0  # factors
# Where two Gaussians have nearly the same depth, rounding can let them change places, which spoils a few pixels much,
# in few images: more than a mean shows. How often it happens goes with these steps, and they take few bytes.
DEPTHS = (
    "gaussians.mean",
    "embedding.barycentric",
    "embedding.displacement",
    "embedding.local_offset",
    *WEIGHTS,
)
DEEPER = 1 / 8


@dataclass(frozen=True)
class Balance:
    """Factors of the steps that are in balance; all of them times a number are in balance as well."""

    factors: Mapping[str, float]  # by path
    mean_db: float  # inside the outline that they promise

    def fine(self, octaves: float) -> Fineness:
        """The steps, 2^`octaves` times as coarse, but for those that are never coarser than by default."""
        scaled = {path: factor * 2.0**octaves for path, factor in self.factors.items()}
        return Fineness(1.0, {path: min(at, 1.0) if path in KEPT_FINE else at for path, at in scaled.items()})


def balanced(avatar: Avatar, yardstick: Yardstick) -> Balance:
    """Steps for `avatar` at which one more bit buys equally much in every attribute.

    The squared error of an image goes with the square of a step, and one bit more for each number halves the step.
    So bits are spent best where every number causes the same squared error. Errors are measured at the default steps,
    in the first shots of `yardstick`, one attribute after the other. What shows in no image keeps its step.
    """
    kept: Kept = {}
    few = yardstick.first(SHOTS)
    _, codes = quantised(avatar, Fineness(), kept)
    numbers = {path: _numbers(one) for path, one in codes.items() if path in STEPS}
    if avatar.embedding is None:  # no image shows the mesh
        numbers = {path: number for path, number in numbers.items() if not path.startswith("rig.")}
    paths = [path for path, number in numbers.items() if number > 0]
    exact = {path: ALMOST_EXACT for path in paths}

    def measured(path: str) -> F64:
        fine = Fineness(1, {**exact, path: 1.0} if path else exact)
        return _square(few.measure(quantised(avatar, fine, kept)[0]))

    floor = measured("")
    errors = {path: np.maximum(measured(path) - floor, 0) for path in paths}
    whole = floor + np.sum(list(errors.values()), axis=0)
    share = {path: float((error / whole).mean()) for path, error in errors.items()}
    found = dict.fromkeys(numbers, 1.0)
    shown = [path for path in paths if share[path] > UNSEEN]
    usual = sum(share[path] for path in shown) / max(sum(numbers[path] for path in shown), 1)
    for path in shown:
        found[path] = float(np.clip(np.sqrt(usual * numbers[path] / share[path]), CLOSEST, FARTHEST))
    found |= {path: found[path] * DEEPER for path in DEPTHS if path in found}
    promised = floor + np.sum([error * found[path] ** 2 for path, error in errors.items()], axis=0)
    return Balance(found, float(-10 * np.log10(promised).mean()))


def _numbers(codes: Codes) -> float:
    """How many numbers one bit more is paid for."""
    if codes.codes is None:
        return 0.0
    middle = 1 << (codes.width - 1) if codes.kind == "signed" else -1
    used = int(np.count_nonzero(codes.codes != middle))
    return used + ZERO * (codes.codes.size - used)


def _square(measured: Measured) -> F64:
    """[S] mean squared errors inside the mask, or of the whole image where it is empty."""
    db = np.where(np.isnan(measured.inside), measured.whole, measured.inside)
    return np.asarray(10 ** (-db / 10), np.float64)
