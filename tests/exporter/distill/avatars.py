"""Avatars that were learnt from posed dumps of a tiny one, for tests of what plays them."""

from __future__ import annotations

from pathlib import Path
from tempfile import TemporaryDirectory

from samples.dumps import random_poses, write_dumps

from avatar_export.distill.make import distill
from avatar_runtime.avatar import Avatar
from tests.avatars import full_avatar

FRAMES, HELD_OUT = 20, 4
# On a skeleton without a mesh, with residual bases in its clips; and on no skeleton, with clips alone.
DISTILLED = {"distilled": True, "distilled clips": False}


def distilled_avatars() -> dict[str, Avatar]:
    """By the names in DISTILLED."""
    full = full_avatar(3)
    takes = [random_poses(full, FRAMES, 8.0), random_poses(full, HELD_OUT, 8.0, seed=8)]
    made = {}
    with TemporaryDirectory() as folder:
        for name, skeleton in DISTILLED.items():
            dumps = write_dumps(full, takes, Path(folder) / name, skeleton=skeleton)
            made[name] = distill(dumps, accept_error=True).avatar
    return made
