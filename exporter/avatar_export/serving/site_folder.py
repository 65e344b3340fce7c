"""The folder of a published site: only files that its own list names are ever replaced or removed.

Whoever reads the folder meanwhile, or after a kill at any moment, finds every page with all that it loads: names of
other files hold a hash of their contents, so new ones come beside the old ones; then each page changes in one step;
what no page loads any more goes last.
"""

from __future__ import annotations

import os
import re
from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple

from avatar_export.owned import FOREIGN, Listed, OwnList, found, meanwhile, sha256, stage
from avatar_runtime.io.errors import AvatarError
from avatar_runtime.io.staging import followed, heal, sync_folder

PAGE = "index.html"
FOLDERS = ("packs", "previews", "talk", "viewer")  # of files that are no pages
SITE = OwnList(
    mark="avatar-export-site.json",
    path=re.compile(
        rf"(?:[a-z0-9-]{{1,64}}/)?index\.html|(?:{'|'.join(FOLDERS)})/[A-Za-z0-9_-][A-Za-z0-9._-]{{0,127}}"
    ),
    command="publish",
    done="published",
    does="publishes",
    cure="move away what is yours (.git, CNAME), delete the rest, and publish again",
)
MARK = SITE.mark


class _Plan(NamedTuple):
    """What happens to the files of a folder."""

    new: dict[str, bytes]  # in the order of writing
    kept: list[str]  # listed, and changed by the user
    stale: list[str]  # in the order of removing
    meanwhile: Listed  # the list while files change
    after: Listed


def addressed(path: str, data: bytes) -> str:
    """The path of a file that is no page, with a hash of its contents: packs/head.0123456789abcdef.avatar."""
    start, _, suffix = path.rpartition(".")
    return f"{start}.{sha256(data)[:16]}.{suffix}"


def expect_replaceable(out: Path, force: bool) -> Listed:
    """The list of the published folder `out`; of an empty or missing one an empty list.

    Raises AvatarError if `out` is anything else, if its list is unsound, or if it exists without `force`.
    """
    heal(out / MARK)
    if not out.exists() or (out.is_dir() and not any(out.iterdir())):
        return {}
    mark = out / MARK
    if mark.is_symlink() or not mark.is_file():
        raise AvatarError("exists and is not a published folder; it is not replaced", file=out)
    listed = SITE.read(out)
    if not force:
        raise AvatarError("exists; pass --force to replace what was published in it", file=out)
    return listed


def write_site(out: Path, files: Mapping[str, bytes], force: bool, *, overwrite: bool = False) -> list[str]:
    """Writes a published folder, or what is new in it; the paths of listed files that the user changed, which stay.

    `overwrite` replaces these, too, but for what is no plain file and what is no longer published.

    Raises AvatarError as `expect_replaceable`, if a file that is not on the list is in the way, if another process
    publishes there, and for a full disk; nothing in the folder has changed then.
    """
    out = followed(out)
    before = expect_replaceable(out, force)
    plan = _plan(out, before, files, overwrite)
    made = not out.exists()
    try:
        out.mkdir(parents=True, exist_ok=True)
        with SITE.staging(out) as staging:
            lists = {"meanwhile": SITE.text(plan.meanwhile), "after": SITE.text(plan.after)}
            staged = stage(staging, {**plan.new, **lists})
            os.replace(staged["meanwhile"], out / MARK)
            sync_folder(out)
            for path in plan.new:
                (out / path).parent.mkdir(exist_ok=True)
                os.replace(staged[path], out / path)
            for folder in {(out / path).parent for path in plan.new}:
                sync_folder(folder)
            _remove(out, plan.stale)
            os.replace(staged["after"], out / MARK)
            sync_folder(out)
    except OSError as error:
        raise AvatarError(f"cannot be written ({error.strerror or error})", file=out) from None
    finally:
        if made:
            with suppress(OSError):
                out.rmdir()  # goes only if it is empty: nothing was written
    return plan.kept


def _plan(out: Path, before: Listed, files: Mapping[str, bytes], overwrite: bool) -> _Plan:
    """What to do, after a look at the folder. Raises AvatarError for a file of the user in the place of a new one."""
    own = {path: sha256(data) for path, data in files.items()}
    held = {path: found(out, path) for path in {**before, **own}}
    for path in own:
        if held[path] == FOREIGN or (path not in before and held[path] is not None):
            raise AvatarError("is not a file that was published here; move it away", file=out / path)
    changed = [path for path, hashes in before.items() if held[path] not in (None, *hashes)]
    kept = [path for path in changed if not (overwrite and path in own)]
    new = [path for path in own if held[path] != own[path] and path not in kept]
    old = [path for path in before if path not in (*own, *kept) and held[path] is not None]
    stay = old if any(map(_is_page, kept)) else []  # a page that is kept loads them
    return _Plan(
        {path: files[path] for path in sorted(new, key=lambda path: (_is_page(path), path == PAGE))},
        kept,
        sorted((path for path in old if path not in stay), key=_is_page, reverse=True),
        meanwhile(before, own),
        {path: [own[path]] for path in own if path not in kept}
        | {path: before[path] for path in (*kept, *stay)},
    )


def _remove(out: Path, stale: Sequence[str]) -> None:
    for path in stale:
        (out / path).unlink(missing_ok=True)
    for folder in {(out / path).parent for path in stale} - {out}:
        with suppress(OSError):
            folder.rmdir()  # goes only if it is empty


def _is_page(path: str) -> bool:
    return path.rpartition("/")[2] == PAGE
