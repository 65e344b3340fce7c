"""Finds how coarse a pack may be: the smallest one that is good enough, or the best one of a size."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from avatar_export.measure.yardstick import Measured, Yardstick
from avatar_export.notes.note import Note, fact
from avatar_export.ops.active_sh import with_active_sh
from avatar_export.packing.balance import Balance, balanced
from avatar_export.packing.quantise import Kept, quantised
from avatar_export.packing.steps import Fineness
from avatar_runtime.avatar import Avatar

Levels = Sequence[Avatar]  # finest first
Size = Callable[[Levels, Fineness], int]  # bytes of the file
Coarser = Callable[[Avatar, float], Avatar]  # an avatar with such a part of its Gaussians
FINEST, COARSEST = -6.0, 5.0  # octaves of the balanced steps
CLOSE = 0.995  # a file of so much of the budget is not made larger
SPARE_DB = 0.4  # above the mean that is asked for: other poses may come out worse
CLOSE_DB = 0.3  # a pack that is so little better than that is not made smaller
DB_AN_OCTAVE = 5.0  # a little less than the 6 of errors that go with the square of the step
TRIES, SIZES = 3, 8  # packs that are measured, or made
CLOSE_OCTAVES = 1 / 32
OCTAVES_A_HALVING = 4.0  # of the bytes, a guess
ROOM = 1.5  # times the budget
PARTS = (0.7, 0.5, 0.35, 0.25, 0.15, 0.1)  # of the Gaussians: what is tried last


@dataclass(frozen=True)
class Aims:
    """What a pack should keep in every kind of poses, dB inside the outline."""

    mean: float
    worst: float

    @property
    def allowance(self) -> float:
        """dB that the worst image may lie below the mean. A claim allows for so much: where two Gaussians of nearly the
        same depth change places, a few pixels are far off, in images too rare to be among those that are drawn."""
        return self.mean - self.worst

    def missed_by(self, measured: Measured) -> float:
        """dB that are missing; 0 or less if nothing is."""
        return max(self.mean - measured.mean, self.worst - measured.worst)

    def text(self) -> str:
        """For people."""
        return f"a mean of {self.mean:g} dB and a worst of {self.worst:g} dB inside the outline"


EXPRESSIVE, STILL = Aims(59.0, 54.0), Aims(56.0, 48.0)  # by default, with expressions and without


def aims_of(avatar: Avatar, min_psnr: float | None) -> Aims:
    """The default aims, or those of a mean of `min_psnr`, as far above the worst image."""
    usual = EXPRESSIVE if avatar.expressions else STILL
    return usual if min_psnr is None else Aims(min_psnr, min_psnr - (usual.mean - usual.worst))


@dataclass(frozen=True)
class Found:
    """What a search chose: the steps of `balance`, 2^`octaves` times as coarse, for `levels`."""

    balance: Balance
    octaves: float
    levels: tuple[Avatar, ...]  # what to pack: the source, or less of it
    tried: int  # packs

    @property
    def fine(self) -> Fineness:
        """The steps."""
        return self.balance.fine(self.octaves)

    @property
    def finest(self) -> bool:
        """Whether no finer steps are there."""
        return self.octaves <= FINEST + CLOSE_OCTAVES

    def finer(self, missing_db: float) -> Found:
        """The same with steps that make up for so many dB."""
        octaves = self.octaves - (missing_db + SPARE_DB) / DB_AN_OCTAVE
        return replace(self, octaves=max(octaves, FINEST), tried=self.tried + 1)

    def record(self) -> dict[str, Any]:
        """JSON values for the pack's document."""
        fine = self.fine
        return {
            "steps": {path: _digits(fine.step(path)) for path in self.balance.factors},
            "tried": self.tried,
        }

    def notes(self, source: Avatar) -> list[Note]:
        """The same for people."""
        steps, kept = self.fine.factors or {}, self.levels[0]
        notes = [fact("tried", count=self.tried)]
        if steps:
            finest, coarsest = min(steps, key=steps.__getitem__), max(steps, key=steps.__getitem__)
            extremes = {"fine": steps[finest], "coarse": steps[coarsest]}
            notes.append(fact("steps", finest=finest, coarsest=coarsest, **extremes))
        if kept.sh_degree != source.sh_degree:
            notes.append(fact("degree_lowered", degree=kept.sh_degree, before=source.sh_degree))
        if kept.gaussians.count != source.gaussians.count:
            notes.append(fact("gaussians_merged", count=kept.gaussians.count, before=source.gaussians.count))
        return notes


def by_aims(levels: Levels, aims: Aims, yardstick: Yardstick, coarsest: float = COARSEST) -> Found:
    """The coarsest balanced steps, at most `coarsest` octaves, with which the finest level meets `aims` in `yardstick`.

    The finest ones that were tried if none does. The same input gives the same result.
    """
    avatar, kept = levels[0], Kept()
    balance = balanced(avatar, yardstick)
    fits, too_coarse, tried = FINEST, coarsest + CLOSE_OCTAVES, 0
    spare = balance.mean_db - SPARE_DB - aims.mean
    octaves = 0.0
    while tried < TRIES and too_coarse - fits > CLOSE_OCTAVES:
        octaves += (spare - CLOSE_DB / 2) / DB_AN_OCTAVE
        octaves = min(max(octaves, fits + CLOSE_OCTAVES / 2), too_coarse - CLOSE_OCTAVES / 2)
        measured = yardstick.measure(quantised(avatar, balance.fine(octaves), kept)[0])
        tried += 1
        spare = min(measured.mean - SPARE_DB - aims.mean, measured.worst - aims.worst)
        if spare >= 0:
            fits = octaves
        else:
            too_coarse = octaves
        if 0 <= spare < CLOSE_DB:
            break
    return Found(balance, fits if fits > FINEST else octaves, tuple(levels), tried)


def by_size(
    levels: Levels, max_bytes: int, yardstick: Yardstick, size: Size, coarser: Coarser | None = None
) -> Found:
    """The finest balanced steps with which `levels` fit `max_bytes`; the same input gives the same result.

    For a size that no steps reach, spherical harmonics are left out, degree by degree, then Gaussians are merged by
    `coarser`, if it is given. The coarsest pack if none fits.
    """
    balance = balanced(levels[0], yardstick)
    tried: list[int] = []

    def bytes_at(some: Levels, octaves: float) -> int:
        tried.append(size(some, balance.fine(octaves)))
        return tried[-1]

    chosen, good, least = tuple(levels), COARSEST, bytes_at(levels, COARSEST)
    for chosen in _reductions(tuple(levels), coarser, max_bytes, least):
        least = bytes_at(chosen, COARSEST)
        if least <= max_bytes:
            break
    fits, bad, large = least, FINEST, 0
    octaves = COARSEST - OCTAVES_A_HALVING * float(np.log2(max_bytes / least))
    for _ in range(SIZES):
        if fits > max_bytes or fits >= CLOSE * max_bytes or good - bad < 1 / 64:
            break
        octaves = min(max(octaves, bad + (good - bad) / 16), good - (good - bad) / 16)
        found = bytes_at(chosen, octaves)
        if found <= max_bytes:
            good, fits = octaves, found
        else:
            bad, large = octaves, found
        aim = float(np.log2((1 + CLOSE) / 2 * max_bytes / fits))
        slope = float(np.log2(large / fits)) / (good - bad) if large else 1 / OCTAVES_A_HALVING
        octaves = good - aim / max(slope, 1e-3)
    return Found(balance, good, chosen, len(tried))


def _reductions(
    levels: tuple[Avatar, ...], coarser: Coarser | None, max_bytes: int, least: int
) -> Iterator[tuple[Avatar, ...]]:
    """Less and less of an avatar that takes `least` bytes: lower degrees of SH, then fewer Gaussians.

    Parts of the Gaussians that can hardly be small enough are passed over, since each takes as long as a level.
    """
    if least <= max_bytes:
        return
    for degree in range(levels[0].sh_degree - 1, -1, -1):
        levels = tuple(
            with_active_sh(replace(level, sh_degree=min(degree, level.sh_degree))) for level in levels
        )
        yield levels
    if coarser is None:
        return
    for part in PARTS:
        if part * least < ROOM * max_bytes or part == PARTS[-1]:
            yield tuple(coarser(level, part) for level in levels)


def _digits(value: float) -> float:
    return float(f"{value:.4g}")
