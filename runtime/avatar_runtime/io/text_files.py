"""Writes a file completely or not at all."""

from __future__ import annotations

from pathlib import Path

from avatar_runtime.io.errors import AvatarError
from avatar_runtime.io.staging import followed, staged


def refuse_existing(out: Path, force: bool) -> None:
    """Raises AvatarError if `out` exists and `force` is not set, or if its folder is missing: before the work is done.

    A folder is never replaced.
    """
    if not followed(out.absolute().parent).is_dir():
        raise AvatarError("its folder does not exist; make it, or name another", file=out)
    if followed(out).exists() and not (force and out.is_file()):
        raise AvatarError("exists; name another or pass --force", file=out)


def write_text(out: Path, text: str, *, force: bool) -> None:
    """Writes `text` in UTF-8 to `out`; see `write_bytes`."""
    write_bytes(out, text.encode("utf-8"), force=force)


def write_bytes(out: Path, data: bytes, *, force: bool) -> None:
    """Writes `data` to `out`, which `force` replaces; on failure `out` is unchanged. Raises AvatarError as `staged`."""
    with staged(out, force=force) as partial:
        partial.write_bytes(data)
