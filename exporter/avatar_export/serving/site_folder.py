"""The folder of a published site: only files that its own list names are ever replaced or removed.

The list MARK names each published file with the SHA-256 of its contents. A file counts as the site's own only while its
contents are on the list; whatever else is in the folder is the user's. Whoever reads the folder meanwhile, or after a
kill at any moment, finds every page with all that it loads: names of other files hold a hash of their contents, so new
ones come beside the old ones; then each page changes in one step; what no page loads any more goes last.
"""

from __future__ import annotations

import hashlib
import json
import os
import re
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import NamedTuple

from avatar_export.version import GENERATOR
from avatar_runtime.io.errors import AvatarError
from avatar_runtime.io.staging import followed, heal, partial_of, remove, sync, sync_folder
from avatar_runtime.io.whole_files import read_bytes

MARK = "avatar-export-site.json"
FORMAT = "avatar-export-site"
PAGE = "index.html"
FOLDERS = ("packs", "previews", "viewer")  # of files that are no pages
# What a list may name: nothing outside of the folder, and nothing that `publish` never writes.
PATH = re.compile(
    rf"(?:[a-z0-9-]{{1,64}}/)?index\.html|(?:{'|'.join(FOLDERS)})/[A-Za-z0-9_-][A-Za-z0-9._-]{{0,127}}"
)
HASH = re.compile("[0-9a-f]{64}")
MOST_LISTED = 16 << 20  # bytes of a list
FOREIGN = "foreign"  # in place of a hash: a folder, a link, a device, or anything below a link
CURE = "move away what is yours (.git, CNAME), delete the rest, and publish again"
Listed = Mapping[str, Sequence[str]]  # path: SHA-256 of what was published there; several after a kill


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
    return f"{start}.{_hash(data)[:16]}.{suffix}"


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
    listed = _read(mark)
    if not force:
        raise AvatarError("exists; pass --force to replace what was published in it", file=out)
    return listed


def write_site(out: Path, files: Mapping[str, bytes], force: bool) -> list[str]:
    """Writes a published folder, or what is new in it; the paths of listed files that the user changed, which stay.

    Raises AvatarError as `expect_replaceable`, if a file that is not on the list is in the way, if another process
    publishes there, and for a full disk; nothing in the folder has changed then.
    """
    out = followed(out)
    before = expect_replaceable(out, force)
    plan = _plan(out, before, files)
    made = not out.exists()
    try:
        out.mkdir(parents=True, exist_ok=True)
        with _staging(out) as staging:
            staged = _staged(staging, plan)
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


def _plan(out: Path, before: Listed, files: Mapping[str, bytes]) -> _Plan:
    """What to do, after a look at the folder. Raises AvatarError for a file of the user in the place of a new one."""
    own = {path: _hash(data) for path, data in files.items()}
    found = {path: _found(out, path) for path in {**before, **own}}
    for path in own:
        if found[path] == FOREIGN or (path not in before and found[path] is not None):
            raise AvatarError("is not a file that was published here; move it away", file=out / path)
    kept = [path for path, hashes in before.items() if found[path] not in (None, *hashes)]
    new = [path for path in own if found[path] != own[path] and path not in kept]
    old = [path for path in before if path not in (*own, *kept) and found[path] is not None]
    stay = old if any(map(_is_page, kept)) else []  # a page that is kept loads them
    return _Plan(
        {path: files[path] for path in sorted(new, key=lambda path: (_is_page(path), path == PAGE))},
        kept,
        sorted((path for path in old if path not in stay), key=_is_page, reverse=True),
        {path: sorted({*before.get(path, ()), *filter(None, [own.get(path)])}) for path in {**before, **own}},
        {path: [own[path]] for path in own if path not in kept}
        | {path: before[path] for path in (*kept, *stay)},
    )


def _staged(staging: Path, plan: _Plan) -> dict[str, Path]:
    """Temporary files with what is written and with both lists, on the disk before anything changes."""
    texts = {"meanwhile": _text(plan.meanwhile), "after": _text(plan.after)}
    staged = {}
    for number, (name, data) in enumerate({**plan.new, **texts}.items()):
        staged[name] = staging / str(number)
        staged[name].write_bytes(data)
    sync(staging)
    return staged


def _remove(out: Path, stale: Sequence[str]) -> None:
    for path in stale:
        (out / path).unlink(missing_ok=True)
    for folder in {(out / path).parent for path in stale} - {out}:
        with suppress(OSError):
            folder.rmdir()  # goes only if it is empty


@contextmanager
def _staging(out: Path) -> Iterator[Path]:
    """A folder for temporary files in `out`. Raises AvatarError while another process has one."""
    own = partial_of(out / MARK)
    own.mkdir()
    try:
        for other in out.glob(f".{MARK}.*.partial"):
            if other != own:
                raise AvatarError(
                    f"another process publishes here; if none runs, delete {other.name}", file=out
                )
        yield own
    finally:
        remove(own)


def _found(out: Path, path: str) -> str | None:
    """SHA-256 of a file in `out`; None if nothing is there, FOREIGN for what is no plain file of the folder itself."""
    at = out / path
    if Path(os.path.realpath(at)) != at:
        return FOREIGN
    if not at.exists() and (at.parent.is_dir() or not at.parent.exists()):
        return None
    if not at.is_file():
        return FOREIGN
    with at.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def _read(mark: Path) -> Listed:
    try:
        found = json.loads(read_bytes(mark, MOST_LISTED))
    except (ValueError, RecursionError):
        raise AvatarError(f"is no JSON; {CURE}", file=mark) from None
    files = found.get("files") if isinstance(found, dict) and found.get("format") == FORMAT else None
    if not isinstance(files, dict):
        raise AvatarError(
            f"holds no list of the published files, as of an older avatar-export; {CURE}", file=mark
        )
    for path, hashes in files.items():
        if not PATH.fullmatch(path):
            raise AvatarError(
                f"names {path[:80]!a}, which `publish` never writes; {CURE}", file=mark, field="files"
            )
        if not (isinstance(hashes, list) and all(isinstance(h, str) and HASH.fullmatch(h) for h in hashes)):
            raise AvatarError(f"has no list of SHA-256; {CURE}", file=mark, field=f"files.{path}")
    return files


def _text(listed: Listed) -> bytes:
    document = {"format": FORMAT, "generator": GENERATOR, "files": dict(sorted(listed.items()))}
    return f"{json.dumps(document, indent=1)}\n".encode()


def _is_page(path: str) -> bool:
    return path.rpartition("/")[2] == PAGE


def _hash(data: bytes) -> str:
    return hashlib.sha256(data).hexdigest()
