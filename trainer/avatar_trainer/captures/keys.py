"""Keys of capture.json that its schema does not name, and `frames` that is not a list."""

from __future__ import annotations

import difflib
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from avatar_runtime import AvatarError
from avatar_schema import schema
from avatar_trainer.captures.rows import too_few

MISSPELLED = 0.8  # likeness of a key to one that is missing beside it
LISTED = 8  # keys in a note


def check_frame_list(file: Path, document: Mapping[str, Any]) -> None:
    """Raise AvatarError for one frame in place of the list of frames, and for a list with one."""
    frames = document.get("frames")
    if isinstance(frames, dict) and "image" in frames:
        raise AvatarError("is one frame; a list of frames is needed: [...]", file=file, field="frames")
    if isinstance(frames, list) and len(frames) == 1:
        raise too_few(1, file)


def unknown_keys(document: Mapping[str, Any], file: Path) -> str:
    """The keys that the schema does not name, for people; "" without such keys.

    Raises AvatarError for one that is a known key misspelled: it would be ignored, and the known one be at rest.
    """
    found: dict[str, None] = {}
    for at, known, part in _parts(document):
        for key in part.keys() - known:
            missing = [name for name in known if name not in part]
            if near := difflib.get_close_matches(key, missing, n=1, cutoff=MISSPELLED):
                raise AvatarError(
                    f"{key[:80]!a} is not a key here; did you mean {near[0]}?", file=file, field=at or None
                )
            found[ascii(key[:40])[1:-1]] = None
    listed = ", ".join(list(found)[:LISTED])
    return f"{listed} and {len(found) - LISTED} more" if len(found) > LISTED else listed


def _parts(document: Mapping[str, Any]) -> Iterator[tuple[str, set[str], Mapping[str, Any]]]:
    """(where, the keys it may have, the object itself) of every object of a capture that the schema names."""
    whole = schema("capture")
    named = whole["$defs"]
    body = named["rig" if document["body"]["kind"] == "rig" else "body_model"]
    of_frame = named["frame"]["properties"]
    frame, camera = {*of_frame}, {*of_frame["camera"]["properties"]}
    yield "", {*whole["properties"]}, document
    yield "body", {*body["properties"]}, document["body"]
    for index, entry in enumerate(document["frames"]):
        yield f"frames[{index}]", frame, entry
        yield f"frames[{index}].camera", camera, entry["camera"]
