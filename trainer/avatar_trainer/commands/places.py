"""Checks that a command can write its output, before anything is computed."""

from __future__ import annotations

import os
from pathlib import Path

from avatar_export.writers import bundle as bundles
from avatar_runtime import AvatarError
from avatar_runtime.io import followed
from avatar_trainer.loop import run

FOLDERS = (run.CHECKPOINTS, run.UPSTREAM, run.LOGS, run.PREVIEW)  # of a run


def expect_run_folder(out: Path) -> None:
    """Raise AvatarError if no run can be written into the folder `out`."""
    expect_room(out)
    for folder in (out, *(out / name for name in FOLDERS)):
        if folder.exists() and not folder.is_dir():
            raise AvatarError("is a file, but a run needs a folder here; name another --out", file=folder)


def expect_bundle_place(bundle: Path, out: Path | None, *, force: bool) -> None:
    """Raise AvatarError if no bundle can be written to `bundle`, or if it contains or is inside the run in
    `out`."""
    here = followed(bundle)
    there = here if out is None else followed(out)
    if out is not None and (here == there or here in there.parents or there in here.parents):
        raise AvatarError(f"the bundle and the run in {out} overlap; name another folder", file=bundle)
    bundles.may_replace(here, force)
    expect_room(here.parent)


def expect_room(folder: Path) -> None:
    """Raise AvatarError if `folder` cannot be made or written to."""
    path = followed(folder)
    while not path.exists() and path != path.parent:
        path = path.parent
    if not path.is_dir():
        raise AvatarError(f"cannot be written: {path} is a file", file=folder)
    if not os.access(path, os.W_OK | os.X_OK):
        raise AvatarError(f"cannot be written: no permission for {path}", file=folder)
