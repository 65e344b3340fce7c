"""Writes a file completely or not at all."""

from __future__ import annotations

import os
from pathlib import Path

from avatar_runtime.io.errors import AvatarError


def refuse_existing(out: Path, force: bool) -> None:
    """Raises AvatarError if `out` exists and `force` is not set, or if its folder is missing: before the work is done.

    A folder is never replaced.
    """
    if not out.absolute().parent.is_dir():
        raise AvatarError("its folder does not exist; make it, or name another", file=out)
    if out.exists() and not (force and out.is_file()):
        raise AvatarError("exists; name another or pass --force", file=out)


def write_text(out: Path, text: str) -> None:
    """Writes `text` in UTF-8 to `out`; see `write_bytes`."""
    write_bytes(out, text.encode("utf-8"))


def write_bytes(out: Path, data: bytes) -> None:
    """Writes `data` to `out`; on failure `out` is unchanged. Raises AvatarError if it cannot be written."""
    partial = out.with_name(f".{out.name}.{os.getpid()}.partial")
    try:
        partial.write_bytes(data)
        partial.replace(out)
    except OSError as error:
        raise AvatarError(f"cannot be written ({error.strerror or error})", file=out) from None
    finally:
        partial.unlink(missing_ok=True)
