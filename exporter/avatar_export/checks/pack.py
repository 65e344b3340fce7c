"""Finds the problems of a pack: in the file, the program, the values that it decodes to, and what it says of them."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from avatar_export.checks.bundle import LEVEL_CHECKS, PACK_CHECKS, bounds_problems
from avatar_export.checks.pack_derived import (
    fact_problems,
    motion_problems,
    preview_problems,
    program_problems,
)
from avatar_export.ops.bounds import bounds_of_levels
from avatar_runtime.bundle import MANIFEST
from avatar_runtime.checks.avatar import check_avatar
from avatar_runtime.codec.pack import manifest_of
from avatar_runtime.handedness import mirrored
from avatar_runtime.io.errors import AvatarError
from avatar_runtime.packs import Pack, placed, read_pack
from avatar_runtime.player import ABSURD
from avatar_schema.validate import Problem


@ABSURD
def validate_pack(path: Path) -> list[Problem]:
    """Every problem of the pack at `path`; [] for a sound pack. If it cannot be read, nothing else is checked.

    What follows from the avatar in the pack is made again and compared. The measured error is not: that needs the
    source, which a pack does not hold.
    """
    try:
        pack = read_pack(path)
        return list(_problems(pack))
    except AvatarError as error:
        field = f": {error.field}" if error.field else ""
        return [Problem(f"{path.name}{field}", error.message)]


def _problems(pack: Pack) -> Iterator[Problem]:
    document = manifest_of(pack.document)
    left = document["frame"]["handedness"] == "left"
    assert pack.avatar.packed is not None
    levels = []
    for level in range(pack.avatar.packed.levels):
        stored = pack.avatar.packed.at(level)
        try:
            check_avatar(stored)  # with what readers take although it is odd
        except AvatarError as error:
            yield Problem(f"$.levels[{level}]: {error.field}", error.message)
        levels.append(placed(mirrored(stored) if left else stored))
        for check in LEVEL_CHECKS if level else PACK_CHECKS:
            for problem in check(levels[-1], document):
                yield _of_pack(problem, level)
    boxes = bounds_of_levels(levels)
    yield from (_of_pack(problem) for problem in bounds_problems(boxes, document))
    yield from motion_problems(document, levels)
    yield from program_problems(pack)
    yield from fact_problems(pack, levels[0])
    yield from preview_problems(pack, levels[0])


def _of_pack(problem: Problem, level: int = 0) -> Problem:
    """A problem of a bundle in the words of a pack."""
    place = problem.path.replace(f"{MANIFEST}: $", "$.avatar")
    return Problem(f"level {level}: {place}" if level else place, problem.message, problem.warning)
