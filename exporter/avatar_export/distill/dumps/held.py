"""Which frames are learnt from, and which are held out to measure."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from avatar_export.distill.dumps.folder import Dumps
from avatar_export.notes.note import Note, doubt
from avatar_runtime.avatar import I64

SHARE = 0.2  # of the frames that are held out, about, where dumps.json does not say which


@dataclass(frozen=True)
class Split:
    """The frames of both kinds, and what is doubtful about them."""

    fitted: I64
    held_out: I64
    doubts: tuple[Note, ...]


def split(dumps: Dumps) -> Split:
    """Whole takes are held out: those that dumps.json names, else the last, and more while they are a fifth at most.

    Of a single take the last fifth is held out.
    """
    take = dumps.drivers.take
    kinds = list(dict.fromkeys(take.tolist()))
    named = list(dumps.document.get("held_out", ()))
    if not named and len(kinds) > 1:
        for kind in reversed(kinds[1:]):
            size = int(np.isin(take, [*named, kind]).sum())
            if named and size > SHARE * len(take):
                break
            named.append(kind)
    if named and len(named) < len(kinds):
        held = np.flatnonzero(np.isin(take, named))
    else:
        held = np.arange(len(take) - max(1, round(SHARE * len(take))), len(take))
    fitted = np.setdiff1d(np.arange(len(take)), held)
    return Split(fitted, held, tuple(_doubts(dumps, fitted, held, bool(named))))


def _doubts(dumps: Dumps, fitted: I64, held: I64, whole: bool) -> list[Note]:
    found = []
    drivers = len(dumps.drivers.driver_names)
    if len(fitted) < 2 * drivers:
        found.append(doubt("few_frames", frames=len(fitted), drivers=drivers))
    if not whole and len(held) == held[-1] - held[0] + 1:
        found.append(doubt("one_take"))
    return found
