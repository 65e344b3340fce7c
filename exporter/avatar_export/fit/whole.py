"""Is one avatar plausible for itself: values, names, places, statistics? One table of checks for every system."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from avatar_export.fit import gaps, names, neighbours, offsets, orientation, values
from avatar_export.fit.judge import ACCEPT
from avatar_export.notes.note import Note
from avatar_export.notes.text import text
from avatar_runtime.avatar import Avatar
from avatar_runtime.io.errors import AvatarError
from avatar_runtime.player import ABSURD

CLIPS = "clips.safetensors"
Check = Callable[[Avatar], list[Note]]
# What it looks at, in the files of a bundle; the check. A check says nothing without enough evidence, and never raises.
CHECKS: tuple[tuple[str, Check], ...] = (
    ("gaussians.ply: scale", values.scales),
    ("gaussians.ply: opacity", values.opacities),
    ("gaussians.ply: f_dc", values.colours),
    ("gaussians.ply: rot", values.rotations),
    (CLIPS, values.clips),
    ("avatar.json: $.expressions", names.names),
    ("blendshapes.safetensors", names.eyelids),
    ("gaussians.ply", neighbours.doubts),
    ("gaussians.ply: rot", orientation.doubts),
    ("gaussians.ply: xyz", offsets.doubts),
    (CLIPS, gaps.doubts),
)


@ABSURD
def found(avatar: Avatar) -> list[tuple[str, Note]]:
    """(file and field of a bundle, note) of every check."""
    return [(where, note) for where, check in CHECKS for note in check(avatar)]


def whole_fit(avatar: Avatar, accept: bool, owner: str | None = None, file: Path | None = None) -> list[Note]:
    """The notes of every check. Raises AvatarError for the first misfit, which names `owner` and `file`, unless
    `accept`."""
    notes = [note for _, note in found(avatar)]
    for note in notes:
        if note.severity == "misfit" and not accept:
            raise AvatarError(f"{text(note)}; {ACCEPT}", file=file, owner=owner)
    return notes
