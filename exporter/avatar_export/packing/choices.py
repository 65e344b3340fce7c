"""What a user asks of a pack."""

from __future__ import annotations

import re
from dataclasses import dataclass
from itertools import pairwise

from avatar_export.options import Options, option
from avatar_runtime.handedness import HANDEDNESS

UNITS = {"": 1, "kb": 10**3, "mb": 10**6, "kib": 1 << 10, "mib": 1 << 20}
SIZE = re.compile(r"([0-9]{1,12}(?:\.[0-9]{1,6})?) ?([a-z]{0,3})", re.IGNORECASE)
MOST_LEVELS = 8


def byte_count(text: str) -> int:
    """Bytes from 900000, 900kB, 2MB or 2MiB. Raises ValueError for anything else."""
    found = SIZE.fullmatch(text.strip())
    if found is None or found[2].lower() not in UNITS or not float(found[1]):
        raise ValueError(f"{text!r} is not a size such as 900kB or 2MB")
    return int(float(found[1]) * UNITS[found[2].lower()])


def level_parts(text: str) -> tuple[float, ...]:
    """Parts of the Gaussians from 1,0.5,0.25: the first is 1, and each is smaller than the one before.

    Raises ValueError."""
    try:
        parts = tuple(float(part) for part in text.split(","))
    except ValueError:
        parts = ()
    falling = all(0 < later < earlier for earlier, later in pairwise(parts))
    if not parts or parts[0] != 1 or not falling or len(parts) > MOST_LEVELS:
        raise ValueError(
            f"{text!r} is not a list such as 1,0.5,0.25: it begins at 1 and falls, up to {MOST_LEVELS} levels"
        )
    return parts


@dataclass(frozen=True)
class Choices(Options):
    """What a user asks of a pack."""

    max_bytes: int | None = option(
        None,
        "Largest size of the file, such as 900kB or 2MB. The best image that fits is chosen.",
        text=byte_count,
    )
    min_psnr: float | None = option(
        None,
        "Least mean PSNR in dB, inside the avatar's outline at 512x512, in every kind of poses. The smallest "
        "file is chosen.",
        least=10,
        most=120,
    )
    levels: tuple[float, ...] = option(
        (1.0,),
        "Levels of detail as parts of the Gaussians, finest first: 1,0.5,0.25.",
        text=level_parts,
        shown="1",
    )
    sh_degree: int | None = option(None, "Highest SH degree to keep.", least=0, most=3)
    handedness: str = option(
        HANDEDNESS[0], f"Frame of the pack: {' or '.join(HANDEDNESS)} (Unity, Unreal).", choices=HANDEDNESS
    )
    exact: bool = option(False, "Keep float32 throughout, for people who port kernels.")
    preview: bool = option(True, "Put no still image into the file.", ("--no-preview",), off=True)
