"""What a user should know of an avatar, as data; `text` alone makes sentences of it."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

DOUBT = "doubtful: "  # begins a note of the provenance that says something may be wrong
UNSAID = "assumed, nothing says otherwise"  # source of a setting that no file and no option states
FOUR_JOINTS = "three.js and both glTF importers of Unity"  # that ignore JOINTS_1: docs/engines
CAUSES = {  # of a rig.glb that differs from the runtime's mesh, by the key of the manifest's `engine`
    "truncation_mm": "{influences} joints a vertex are too few",
    "late_morph_mm": "engines move the eyelids before the skeleton",
    "shear_mm": "nodes of glTF cannot shear",
}


@dataclass(frozen=True)
class Note:
    """A key of TEXTS and the values in its text; `doubt`: something may be wrong, so it is a warning."""

    kind: str
    values: Mapping[str, Any] = field(default_factory=dict)
    doubt: bool = False


@dataclass(frozen=True)
class Setting:
    """A setting of a training in words, and what states it."""

    said: str
    source: str


def _rig_differs(mm: float, cause: str, influences: int, more: int | None) -> str:
    text = f"rig.glb differs from the runtime's mesh by up to {mm:.2g} mm, since "
    text += CAUSES[cause].format(influences=influences)
    if cause != "truncation_mm":
        return text
    if more is None:
        return f"{text}; rig.usdc keeps all"
    return f"{text}; --influences {more} gives more, but {FOUR_JOINTS} ignore the second four; rig.usdc keeps all"


def _settings(settings: Sequence[Setting]) -> str:
    return "; ".join(f"{one.said} ({one.source})" for one in settings)


TEXTS: Mapping[str, str | Callable[..., str]] = {
    "said": "{said}",
    "settings": _settings,
    "unstated": "no file of the checkpoint and no option says {settings}; wrong values change the size and the look: "
    "pass --units and --mesh-scaling or --no-mesh-scaling as in the training",
    "rows_dropped": "{count} rows with a NaN or infinity were dropped; avatar.json lists them",
    "no_rig": "no rig: only expressions move; joints and teeth do not",
    "not_driven": "ARKit cannot drive this avatar yet; pass --driving FILE with a matrix from the ARKit names",
    "jaw_not_driven": "the jaw is a joint ({joint}), which ARKit names cannot rotate without a driving matrix, so "
    "jawOpen only moves the skin; pass --driving FILE with rows joint/jaw/x if this avatar was trained with a "
    "rotating jaw",
    "rig_differs": _rig_differs,
    "groups": "Gaussians by group: {groups}",
    "files": "files read: {files}",
}


def text(note: Note) -> str:
    """The note in words."""
    made = TEXTS[note.kind]
    return made.format(**note.values) if isinstance(made, str) else made(**note.values)


def stored(note: Note) -> str:
    """The note as the provenance of a manifest has it."""
    return f"{DOUBT}{text(note)}" if note.doubt else text(note)


def as_note(one: str | Note) -> Note:
    """A note of a provenance, which a reader gives as data or in words."""
    if isinstance(one, Note):
        return one
    return Note("said", {"said": one.removeprefix(DOUBT)}, one.startswith(DOUBT))
