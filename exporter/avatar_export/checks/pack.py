"""Finds the problems of a pack: in the file, the program, and the values that it decodes to."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from avatar_export.checks.bundle import LEVEL_CHECKS, VALUE_CHECKS
from avatar_runtime.bundle import MANIFEST
from avatar_runtime.codec.pack import manifest_of
from avatar_runtime.handedness import mirrored
from avatar_runtime.io.errors import AvatarError
from avatar_runtime.packs import Pack, placed, read_pack
from avatar_schema.validate import Problem


def validate_pack(path: Path) -> list[Problem]:
    """Every problem of the pack at `path`; [] for a sound pack. If it cannot be read, nothing else is checked.

    A pack is made from a source that it does not hold: its measured figures are not checked.
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
    for level in range(pack.avatar.packed.levels):
        stored = pack.avatar.packed.at(level)
        said = pack.document["levels"][level]["count"]
        where = f"$.levels[{level}]"
        if said != stored.gaussians.count:
            yield Problem(
                f"{where}.count", f"is {said}, but the level has {stored.gaussians.count} Gaussians"
            )
        avatar = placed(mirrored(stored) if left else stored)
        for check in LEVEL_CHECKS if level else VALUE_CHECKS:
            for problem in check(avatar, document):
                place = problem.path.replace(f"{MANIFEST}: $", "$.avatar")
                yield Problem(f"level {level}: {place}" if level else place, problem.message, problem.warning)
