"""What a user says of a film, and of the avatar that is made of it."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from dataclasses import dataclass

from avatar_export.options import Author, Consent, License, Options, declared, option

SYSTEMS = ("gaussian_blendshapes", "splatting_avatar", "psavatar")  # that the trainer has
ITERATIONS = 4000
DEFAULTS = {"--system": SYSTEMS[0], "--iterations": ITERATIONS, "--seed": 0}


@dataclass(frozen=True)
class Film(Options):
    """What is known of the film, and how much of it is used: options of `avatar-train capture`. None: as before, else
    the default."""

    focal: float | None = option(None, "Focal length in pixels of the upright film, if you know it.", least=1)
    fov: float | None = option(
        None, "Field of view of the longer side in degrees, if you know it.", least=5, most=150
    )
    rotation: int | None = option(
        None,
        "Degrees clockwise that set the film upright. Default: as the file says.",
        choices=(0, 90, 180, 270),
    )
    crop: str | None = option(
        None, "The part of the upright film that is used, in pixels.", metavar="X,Y,W,H"
    )
    first: float | None = option(None, "Second at which to begin.", least=0)
    last: float | None = option(None, "Second at which to end.", least=0)
    fps: float | None = option(None, "Frames that are used of each second.", least=1, most=120)
    size: int | None = option(None, "Pixels of the longer side of the images.", least=64, most=2048)


@dataclass(frozen=True)
class Wanted(Options):
    """What is made. None: as before, else the default."""

    name: str | None = option(None, "Name of the avatar. Default: that of the folder.")
    consent: Consent = None
    license: License = None
    author: Author = None
    system: str | None = option(
        None, f"What is trained: {', '.join(SYSTEMS)}. Default: the first.", choices=SYSTEMS
    )
    iterations: int | None = option(
        None,
        f"Iterations of the training, one image each. Default: {ITERATIONS}.",
        least=1,
        most=10**9 - 1,
    )
    gaussians: int | None = option(
        None, "Gaussians at the start. Default: as the system has it.", least=1, most=10**6
    )
    seed: int | None = option(None, "Seed of all random numbers. Default: 0.", least=0, most=2**31 - 1)


def words(options: Options, names: Collection[str]) -> Iterator[str]:
    """The options of these names that are given, as words of a command line."""
    for name in names:
        value = getattr(options, name)
        if value is not None:
            yield from (
                declared(type(options))[name].flag,
                f"{value:.15g}" if isinstance(value, float) else str(value),
            )
