"""Provenance of an avatar: its source files, licence, author and consent, as in the manifest."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from avatar_export.notes.note import Note
from avatar_runtime.avatar import Avatar
from avatar_runtime.io.errors import AvatarError
from avatar_runtime.io.files import open_file

BODY_RESTRICTION = "the rig derives from the body model given; its licence goes with this bundle"
BODY_LICENCE = "the rig derives from a body model whose file states its licence: "


def provenance(
    system: str,
    files: Mapping[str, Path],
    notes: Sequence[Note],
    *,
    commit: str | None = None,
    form: str | None = None,
    body_licence: str | None = None,
) -> dict[str, Any]:
    """What a reader of `system` records of an avatar: the `commit` of the code that it follows, the files, the notes.

    body_licence: as the body model's file states it; "" if it states none, None without a body model. Raises
    AvatarError for a file that cannot be read.
    """
    return {
        "system": system,
        **({} if commit is None else {"source_commit": commit}),
        **({} if form is None else {"form": form}),
        "source_files": source_files(files),
        "notes": list(notes),
        **({} if body_licence is None else {"body_model_restriction": body_restriction(body_licence)}),
    }


def body_restriction(licence: str) -> str:
    """What a bundle says of its body model, whose file states `licence`; "" if it states none."""
    return BODY_LICENCE + licence if licence else BODY_RESTRICTION


def source_files(files: Mapping[str, Path]) -> list[dict[str, Any]]:
    """{path, bytes, sha256} of every file an avatar was read from; `files` gives the name to show for each.

    Folders of this machine are not named. Raises AvatarError for a file that cannot be read.
    """
    return [_entry(name, files[name]) for name in sorted(files)]


def with_rights(avatar: Avatar, license: str | None, author: str | None, consent: str | None) -> Avatar:
    """`avatar` with licence, author and consent statement. None keeps the statement of the source; a missing statement
    becomes null in the manifest."""
    given = {"licence": license, "author": author, "consent": consent}
    kept = {name: avatar.provenance.get(name) if text is None else text for name, text in given.items()}
    return replace(avatar, provenance={**avatar.provenance, **kept})


def _entry(name: str, path: Path) -> dict[str, Any]:
    try:
        with open_file(path) as file:
            digest = hashlib.file_digest(file, "sha256").hexdigest()
            return {"path": name, "bytes": file.tell(), "sha256": digest}
    except OSError as error:
        raise AvatarError(f"cannot be read ({error.strerror or error})", file=path) from None
