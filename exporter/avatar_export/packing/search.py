"""Finds the steps with which a pack keeps to a size, or to an error, and is best otherwise."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from avatar_export.measure.yardstick import Measured, Yardstick
from avatar_export.ops.active_sh import with_active_sh
from avatar_export.packing.curves import chosen, curves, finer_within, predict
from avatar_export.packing.steps import Fineness
from avatar_runtime.avatar import Avatar

Levels = Sequence[Avatar]  # finest first
Pack = Callable[
    [Levels, Fineness], tuple[Avatar, int]
]  # (the finest level as it will play, bytes of the file)
Coarser = Callable[[Avatar, float], Avatar]  # an avatar with such a part of its Gaussians
CLOSE = 0.995  # a file of so much of the budget is not made larger
CLOSE_DB = 0.1  # nor one smaller that is so little better than it must be
TRIES = 7  # packs that are made with one set of Gaussians
FILLS = 3  # packs that are made to fill what is left of the budget
BELOW = 5.0  # dB that the worst image may lie below the mean
# Octaves by which the step of the positions changes when an image is far worse than the others.
REDRAWS = (-1 / 8, 1 / 8, -1 / 4, 1 / 4)
POSITIONS = ("gaussians.mean", "embedding.local_offset", "embedding.displacement")
# Bytes for the whole image error that the default steps make: which steps are worth it follows from the price.
PRICES = 2.0 ** np.arange(4, 40, 0.1)
PARTS = (0.7, 0.5, 0.35, 0.25, 0.15, 0.1)  # of the Gaussians: what is tried last


@dataclass(frozen=True)
class Target:
    """What a pack must be: at most `max_bytes` large, or at least `min_psnr` dB (mean inside the mask) good."""

    max_bytes: int | None = None
    min_psnr: float | None = None

    def __post_init__(self) -> None:
        """Raises ValueError unless one of the two is set."""
        if (self.max_bytes is None) == (self.min_psnr is None):
            raise ValueError("expected either max_bytes or min_psnr")


@dataclass(frozen=True)
class Found:
    """What a search chose."""

    fine: Fineness
    levels: tuple[Avatar, ...]  # what to pack: the source, or less of it
    measured: Measured  # the finest level of the pack against the source
    bytes: int
    met: bool  # whether the target was met; if not, this comes nearest to it
    record: Mapping[str, Any] = field(
        default_factory=dict
    )  # JSON values: the target, the steps, what was tried
    lines: tuple[str, ...] = ()  # the same for people


@dataclass(frozen=True)
class _Try:
    """One pack that was made."""

    levels: tuple[Avatar, ...]
    fine: Fineness
    avatar: Avatar
    bytes: int
    measured: Measured | None = None

    @property
    def psnr(self) -> float:
        """dB inside the mask, or of whole images where the mask is empty."""
        assert self.measured is not None
        inside = self.measured.psnr_inside
        return self.measured.psnr if inside is None else inside

    @property
    def steady_psnr(self) -> float:
        """`psnr`, but less if an image is more than BELOW worse."""
        assert self.measured is not None
        worst = self.measured.worst_inside
        return min(self.psnr, (self.measured.worst_psnr if worst is None else worst) + BELOW)


def search(
    levels: Levels,
    target: Target,
    yardstick: Yardstick,
    pack: Pack,
    coarser: Coarser | None = None,
) -> Found:
    """The steps for `levels` (finest first) that meet `target`; the same input gives the same result.

    Bytes and image error of each attribute are measured apart; the steps are those at which one more byte buys
    equally much in every attribute. For a size that no steps reach, spherical harmonics are left out, degree by
    degree, then Gaussians are merged by `coarser`, if it is given. `yardstick` measures against the source. Raises
    AvatarError as `pack`.
    """
    searching = _Search(tuple(levels), target, yardstick, pack)
    best = searching.by_psnr() if target.max_bytes is None else searching.by_size(coarser)
    return searching.found(best)


class _Search:
    """The state of one search: the curves, and what was tried."""

    def __init__(self, levels: tuple[Avatar, ...], target: Target, yardstick: Yardstick, pack: Pack) -> None:
        self._levels, self._target, self._yardstick, self._pack = levels, target, yardstick, pack
        found = self._curves = curves(levels[0], yardstick)
        self._fine = [Fineness(1.0, chosen(found, float(price))) for price in PRICES]
        predicted = [predict(found, fine.factors or {}) for fine in self._fine]
        self._bytes = np.array([size for size, _ in predicted])
        self._db = -10 * np.log10(np.array([error for _, error in predicted]))
        self._tried: list[dict[str, Any]] = []

    def by_size(self, coarser: Coarser | None) -> _Try:
        """The largest file within the budget; the smallest one if none is."""
        limit = self._target.max_bytes
        assert limit is not None
        best = self._made(self._levels, 0)
        for levels in _reductions(self._levels, coarser):
            if best.bytes <= limit:
                break
            best = min(best, self._made(levels, 0), key=lambda one: one.bytes)
        low, high, offset = 0, len(PRICES), best.bytes - self._bytes[0]
        for _ in range(TRIES):
            if best.bytes > limit or best.bytes >= CLOSE * limit or high - low < 2:
                break
            # Where the sum of the curves, corrected by what the last file showed, meets the limit.
            wanted = (1 + CLOSE) / 2 * limit - offset
            index = int(np.searchsorted(self._bytes, wanted, "right")) - 1
            index = min(max(index, low + 1), high - 1)
            made = self._made(best.levels, index)
            offset = made.bytes - self._bytes[index]
            if made.bytes <= limit:
                low, best = index, max(best, made, key=lambda one: one.bytes)
            else:
                high = index
        best = self._measured(self._filled(best, low, high, limit))
        return self._redrawn(best, lambda made: made.bytes <= limit)

    def _filled(self, best: _Try, low: int, high: int, limit: int) -> _Try:
        """`best`, made at price `low`, with as many of the finer steps towards price `high` as fit.

        A small change of the price can change a step a lot: no price gives the steps in between.
        """
        if best.bytes > limit or high >= len(PRICES):
            return best
        aim = (1 + CLOSE) / 2 * limit
        room = aim - best.bytes
        for _ in range(FILLS):
            factors = dict(best.fine.factors or {})
            finer = finer_within(self._curves, factors, self._fine[high].factors or {}, room)
            if best.bytes >= CLOSE * limit or finer == factors:
                break
            made = self._packed(best.levels, Fineness(1.0, finer), float(PRICES[low]))
            if made.bytes <= best.bytes:
                break
            if made.bytes <= limit:
                best, room = made, aim - made.bytes
            else:  # the curves promised less
                room *= room / (made.bytes - best.bytes)
        return best

    def _redrawn(self, best: _Try, fits: Callable[[_Try], bool]) -> _Try:
        """`best`, or nearly the same without an image that is far worse than the others.

        Two Gaussians at nearly the same depth may change places when positions are rounded. This is chance: another
        step draws again.
        """
        factors = dict(best.fine.factors or {})
        path = next((path for path in POSITIONS if path in factors), None)
        for octaves in REDRAWS:
            if path is None or not fits(best) or best.steady_psnr >= best.psnr:
                break
            fine = Fineness(1.0, {**factors, path: factors[path] * 2.0**octaves})
            made = self._measured(self._packed(best.levels, fine))
            if fits(made) and made.steady_psnr > best.steady_psnr:
                best = made
        return best

    def by_psnr(self) -> _Try:
        """The smallest file that is good enough; the best one if none is."""
        limit = self._target.min_psnr
        assert limit is not None
        low, high = -1, len(PRICES) - 1
        best = self._measured(self._made(self._levels, high))
        offset = 0.0
        start = int(np.argmin(np.abs(self._db)))  # about as good as the default steps
        for step in range(TRIES):
            if best.psnr < limit or best.psnr < limit + CLOSE_DB or high - low < 2:
                break
            index = start if step == 0 else int(np.searchsorted(self._db, limit + CLOSE_DB / 2 - offset))
            index = min(max(index, low + 1), high - 1)
            made = self._measured(self._made(self._levels, index))
            offset = made.psnr - self._db[index]
            if made.psnr >= limit:
                high, best = index, min(best, made, key=lambda one: one.bytes)
            else:
                low = index
        return self._redrawn(best, lambda made: made.psnr >= limit)

    def _made(self, levels: tuple[Avatar, ...], index: int) -> _Try:
        return self._packed(levels, self._fine[index], float(PRICES[index]))

    def _packed(self, levels: tuple[Avatar, ...], fine: Fineness, price: float | None = None) -> _Try:
        avatar, size = self._pack(levels, fine)
        entry: dict[str, Any] = {"gaussians": levels[0].gaussians.count, "bytes": size}
        if price is not None:
            entry["price"] = _digits(price)
        self._tried.append(entry)
        return _Try(levels, fine, avatar, size)

    def _measured(self, made: _Try) -> _Try:
        if made.measured is None:
            made = replace(made, measured=self._yardstick.measure(made.avatar))
            for entry in self._tried:
                if entry["bytes"] == made.bytes:
                    entry["psnr_mask_db"] = round(made.psnr, 3)
        return made

    def found(self, best: _Try) -> Found:
        """What to return for the pack that was chosen."""
        assert best.measured is not None
        target, source, kept = self._target, self._levels[0], best.levels[0]
        met = (
            best.bytes <= target.max_bytes
            if target.max_bytes is not None
            else best.psnr >= (target.min_psnr or 0)
        )
        factors = best.fine.factors or {}
        record = {
            "met": met,
            "coarseness": best.fine.coarseness,
            "steps": {path: _digits(best.fine.step(path)) for path in factors},
            "gaussians": kept.gaussians.count,
            "sh_degree": kept.sh_degree,
            "tried": self._tried,
        }
        coarse = sorted(factors, key=lambda path: factors[path])
        asked = f"{target.max_bytes} bytes" if target.max_bytes is not None else f"{target.min_psnr:g} dB"
        lines = [
            f"asked for {asked}: {best.bytes} bytes, {best.psnr:.1f} dB inside the mask"
            + ("" if met else "; nothing comes nearer"),
            f"{len(self._tried)} packs were tried",
        ]
        if coarse:
            lines.append(
                f"finest against the default: {_named(coarse[0], factors)}; coarsest: {_named(coarse[-1], factors)}"
            )
        if kept.sh_degree != source.sh_degree:
            lines.append(f"spherical harmonics of degree {kept.sh_degree} instead of {source.sh_degree}")
        if kept.gaussians.count != source.gaussians.count:
            lines.append(f"{kept.gaussians.count} of {source.gaussians.count} Gaussians")
        return Found(best.fine, best.levels, best.measured, best.bytes, met, record, tuple(lines))


def _reductions(levels: tuple[Avatar, ...], coarser: Coarser | None) -> Iterator[tuple[Avatar, ...]]:
    """Less and less of an avatar: lower degrees of SH, then fewer Gaussians."""
    for degree in range(levels[0].sh_degree - 1, -1, -1):
        levels = tuple(
            with_active_sh(replace(level, sh_degree=min(degree, level.sh_degree))) for level in levels
        )
        yield levels
    if coarser is None:
        return
    for part in PARTS:
        yield tuple(coarser(level, part) for level in levels)


def _named(path: str, factors: Mapping[str, float]) -> str:
    return f"{path} (step times {factors[path]:.3g})"


def _digits(value: float) -> float:
    return float(f"{value:.4g}")
