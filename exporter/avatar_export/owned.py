"""The list by which a command knows its own files in a folder that belongs to the user.

The list names each file with the SHA-256 of its contents. A file counts as the command's own only while its contents
are on the list; whatever else is in the folder is the user's. While files change, the list holds old and new contents.
"""

from __future__ import annotations

import hashlib
import json
import os
import re
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from avatar_export.version import GENERATOR
from avatar_runtime.io.errors import AvatarError
from avatar_runtime.io.staging import partial_of, remove, sync
from avatar_runtime.io.whole_files import read_bytes

HASH = re.compile("[0-9a-f]{64}")
MOST_LISTED = 16 << 20  # bytes of a list
FOREIGN = "foreign"  # in place of a hash: a folder, a link, a device, or anything below a link
Listed = Mapping[str, Sequence[str]]  # path: SHA-256 of what was put there; several after a kill


@dataclass(frozen=True)
class OwnList:
    """One command's list: its file, what it may name, and the words of its errors."""

    mark: str  # name of the list's file, NAME.json; its format is NAME
    path: re.Pattern[str]  # nothing outside of the folder, and nothing that the command never writes
    command: str  # publish
    done: str  # published
    does: str  # publishes
    cure: str  # what to do with an unsound list

    def read(self, top: Path) -> Listed:
        """The list in the folder `top`. Raises AvatarError for one that is unsound."""
        mark = top / self.mark
        try:
            found = json.loads(read_bytes(mark, MOST_LISTED))
        except (ValueError, RecursionError):
            raise AvatarError(f"is not JSON; {self.cure}", file=mark) from None
        files = found.get("files") if isinstance(found, dict) and found.get("format") == mark.stem else None
        if not isinstance(files, dict):
            raise AvatarError(
                f"holds no list of the {self.done} files, as of an older avatar-export; {self.cure}",
                file=mark,
            )
        for path, hashes in files.items():
            if not self.path.fullmatch(path):
                raise AvatarError(
                    f"names {path[:80]!a}, which `{self.command}` never writes; {self.cure}",
                    file=mark,
                    field="files",
                )
            if not (
                isinstance(hashes, list) and all(isinstance(h, str) and HASH.fullmatch(h) for h in hashes)
            ):
                raise AvatarError(f"has no list of SHA-256; {self.cure}", file=mark, field=f"files.{path}")
        return files

    def text(self, listed: Listed) -> bytes:
        """The file of a list."""
        document = {
            "format": self.mark.removesuffix(".json"),
            "generator": GENERATOR,
            "files": dict(sorted(listed.items())),
        }
        return f"{json.dumps(document, indent=1)}\n".encode()

    @contextmanager
    def staging(self, top: Path) -> Iterator[Path]:
        """A folder for temporary files in `top`. Raises AvatarError while another process has one."""
        own = partial_of(top / self.mark)
        own.mkdir()
        try:
            for other in top.glob(f".{self.mark}.*.partial"):
                if other != own:
                    raise AvatarError(
                        f"another process {self.does} here; if none runs, delete {other.name}", file=top
                    )
            yield own
        finally:
            remove(own)


def stage(staging: Path, files: Mapping[str, bytes]) -> dict[str, Path]:
    """Temporary files with what is written, by the paths that they get; they are on the disk."""
    staged = {}
    for number, (path, data) in enumerate(files.items()):
        staged[path] = staging / str(number)
        staged[path].write_bytes(data)
    sync(staging)
    return staged


def found(top: Path, path: str) -> str | None:
    """SHA-256 of a file in `top`, which holds no link; None if nothing is there, FOREIGN for what is no plain file of
    the folder itself."""
    at = top / path
    if Path(os.path.realpath(at)) != at:
        return FOREIGN
    if not at.exists() and (at.parent.is_dir() or not at.parent.exists()):
        return None
    if not at.is_file():
        return FOREIGN
    with at.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def sha256(data: bytes) -> str:
    """The hash of a file's contents, as lists have it."""
    return hashlib.sha256(data).hexdigest()


def meanwhile(before: Listed, own: Mapping[str, str]) -> Listed:
    """The list while files change from what `before` names to the hashes `own`: either is the command's."""
    paths = {**before, **own}
    return {path: sorted({*before.get(path, ()), *filter(None, [own.get(path)])}) for path in paths}
