"""Folders and files on local disks and in object stores, through fsspec: listed, fetched, written as a whole.

A row's folder holds its products and RECORD, which says what was made of what. On a local disk the folder is written
aside and renamed. An object store has no rename: an attempt writes its files below a folder of its own, avatar.json
after all others, and then RECORD, which names that folder. A reader looks into RECORD first, so it never sees half of
an attempt. Two attempts never write to one key.
"""

from __future__ import annotations

import hashlib
import json
import os
import re
import shutil
import stat
import uuid
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path, PurePosixPath
from typing import Any

from fsspec import AbstractFileSystem
from fsspec.core import url_to_fs

from avatar_export.batch.failures import StoreError, is_full, lost
from avatar_export.batch.locations import is_url, leaf
from avatar_export.batch.scratch import is_dead, own_process
from avatar_runtime.bundle import MANIFEST
from avatar_runtime.io import text_files
from avatar_runtime.io.errors import AvatarError
from avatar_runtime.io.files import open_file
from avatar_runtime.io.staging import followed, move, remove

RECORD = "result.json"
HERE = "."  # the folder of an attempt where there is a rename
OTHER = "a pipe, a device or a socket"  # the mark of what is neither file nor folder; it is never opened
RECORD_LIMIT = 64 << 20  # bytes
NAME = re.compile(r"\.|[^/\\]*[^./\\][^/\\]*")  # of a folder, or HERE
# Host and process of an attempt, after the row's name.
ATTEMPT = re.compile(r"(.+)-([0-9]{1,9})\.[^.]*\.partial")
FORMAT = "avatar-export-result"
ALONE = (".avatar", ".npz", ".zip")  # trained avatars and bundles that are one file


@contextmanager
def asked(location: str, *, writing: bool = False) -> Iterator[None]:
    """Turns what a store raises in the block into an AvatarError: see `failures.lost`."""
    try:
        yield
    except (AvatarError, MemoryError):
        raise
    except Exception as error:  # each store has errors of its own
        raise lost(error, location, writing=writing) from error


def opened(location: str) -> tuple[AbstractFileSystem, str]:
    """(store, path in it) of a URL. Raises StoreError where the store's library or credentials are missing."""
    with asked(location):
        store, path = url_to_fs(location, use_listings_cache=False)  # others write meanwhile
    return store, path


def files_of(location: str, without: tuple[str, ...] = ()) -> dict[str, tuple[int, str]]:
    """Path below `location` -> (bytes, mark) of every file; "" is the file `location` itself.

    `without` are endings of files that are left out. A mark changes when the file does: its time on a local disk, its
    tag in a store; OTHER is that of what is no file. Raises AvatarError if nothing is there, and StoreError.
    """
    files = _stored_files(location) if is_url(location) else _local_files(Path(location))
    return {name: said for name, said in sorted(files.items()) if not name.lower().endswith(without)}


def _stored_files(location: str) -> dict[str, tuple[int, str]]:
    store, path = opened(location)
    with asked(location):
        found = store.find(path, detail=True)
    if not found:
        raise AvatarError("no such file or folder", file=location)
    root = path.strip("/")
    files = {}
    for name, facts in found.items():
        below = name.strip("/")[len(root) :].strip("/")
        if facts.get("type") == "file" and not name.endswith("/"):
            mark = hashlib.sha256(json.dumps(facts, sort_keys=True, default=str).encode()).hexdigest()
            files[below] = (int(facts["size"] or 0), mark[:16])
    return files


def _local_files(path: Path) -> dict[str, tuple[int, str]]:
    if not path.exists():
        raise AvatarError("no such file or folder", file=path)
    if not path.is_dir():
        if not path.is_file():
            raise AvatarError(f"is {OTHER}; name a file or a folder", file=path)
        return {"": _stamp(path)}
    with asked(str(path)), os.scandir(path):
        pass  # the walk passes over what cannot be read, also over its beginning
    found, entered = {}, set[str]()
    for folder, inner, names in os.walk(path, followlinks=True):
        inner[:] = [name for name in inner if os.path.realpath(os.path.join(folder, name)) not in entered]
        entered |= {
            os.path.realpath(os.path.join(folder, name)) for name in ("", *inner)
        }  # links make circles
        for name in names:
            file = Path(folder, name)
            with suppress(OSError):  # a link to nothing, or a file that went away
                found[file.relative_to(path).as_posix()] = _stamp(file)
    return found


def _stamp(file: Path) -> tuple[int, str]:
    said = file.stat()
    return (said.st_size, str(said.st_mtime_ns)) if stat.S_ISREG(said.st_mode) else (0, OTHER)


def fetch(location: str, names: Mapping[str, tuple[int, str]], work: Path) -> Path:
    """A local path with the files `names` (as of `files_of`) of `location`: itself, or a copy below the folder `work`.

    The copy lies in folders of the same names, since an avatar may be called after one. Raises StoreError, also if the
    disk has too little room, and AvatarError for a name that leads out of its folder.
    """
    if not is_url(location):
        return Path(location)
    store, path = opened(location)
    target = work / location.replace("://", "/")
    need = sum(size for size, _ in names.values())
    work.mkdir(parents=True, exist_ok=True)
    free = shutil.disk_usage(work).free
    if need > free:
        raise StoreError(
            f"needs {need / 1e6:,.0f} MB of {work}, which has {free / 1e6:,.0f} MB",
            kind="disk full",
            file=location,
        )
    places = [target / name if name else target for name in names]
    for name, place in zip(names, places, strict=True):
        if ".." in PurePosixPath(name).parts or os.path.isabs(name):
            raise AvatarError(f"holds the name {name[:80]!a}, which leads out of its folder", file=location)
        place.parent.mkdir(parents=True, exist_ok=True)
    wanted = [(name, place) for name, place in zip(names, places, strict=True) if not place.exists()]
    with asked(location):  # a dataset often holds the source, too, which is there by now
        store.get(
            [f"{path}/{name}" if name else path for name, _ in wanted], [str(place) for _, place in wanted]
        )
    for place, (size, _) in zip(places, names.values(), strict=True):
        if place.stat().st_size != size:
            raise StoreError("changed while it was read", kind="store", file=location)
    return target


@contextmanager
def attempted(output: str, attempt: str, work: Path) -> Iterator[tuple[Path, str]]:
    """(folder to fill, name of the attempt's folder for RECORD); when the block ends it becomes the row's `output`.

    The block writes RECORD last. If it raises, nothing of the attempt is left. Raises AvatarError if `output` holds
    something else than the result of a batch, and StoreError.
    """
    key = f"{attempt}-{uuid.uuid4().hex}"  # a task that is run again has the same name
    refuse_other(output)
    if is_url(output):
        folder = work / key / leaf(output)
        folder.mkdir(parents=True)
        yield folder, key
        _upload(folder, output, key)
        return
    out = followed(Path(output))
    partial = out.with_name(f".{out.name}.{own_process()}.{key}.partial")
    try:
        partial.mkdir(parents=True)
        yield partial, HERE
        refuse_other(output)
        move(partial, out, force=True)
    except OSError as error:
        named = str(error.filename or partial)
        if not named.startswith((str(partial), str(out))) and not str(partial).startswith(named):
            raise  # of an input, or of the disk for copies
        kind = "disk full" if is_full(error) else "output"
        raise StoreError(f"cannot be written ({error.strerror or error})", kind=kind, file=output) from error
    finally:
        remove(partial)
    sweep(output)


def sweep(output: str) -> None:
    """Removes what processes that are dead left of attempts at a local `output`; another attempt may go on."""
    if is_url(output):
        return
    with suppress(OSError, AvatarError):  # no folder, or one of another user
        out = followed(Path(output))
        for left in out.parent.glob(f".{_literal(out.name)}.*.partial"):
            found = ATTEMPT.fullmatch(left.name[len(out.name) + 2 :])
            if found and is_dead(found[1], int(found[2])):
                remove(left)


def partial_pattern(output: str) -> str:
    """A pattern of the path of an attempt at a local `output`."""
    folder, _, name = output.rpartition("/")
    return rf"{re.escape(folder)}/\.{re.escape(name)}\.[^/]+\.partial"


def _literal(name: str) -> str:
    return "".join(f"[{letter}]" if letter in "*?[" else letter for letter in name)


def _upload(folder: Path, output: str, key: str) -> None:
    """Puts the files of a folder below `output`/`key`: manifests after the others, then RECORD to `output`."""
    refuse_other(output)
    store, path = opened(output)
    names = [name for name in _local_files(folder) if name != RECORD]
    manifests = [name for name in names if PurePosixPath(name).name == MANIFEST]
    others = [name for name in names if name not in manifests]
    try:
        with asked(output, writing=True):
            for group in filter(None, (others, manifests)):
                store.put([str(folder / name) for name in group], [f"{path}/{key}/{name}" for name in group])
    except BaseException:
        with suppress(Exception):  # the store fails
            store.rm(f"{path}/{key}", recursive=True)
        raise
    with asked(output, writing=True):  # a store that says it failed may have written it: the other files stay
        store.pipe_file(f"{path}/{RECORD}", (folder / RECORD).read_bytes())


def refuse_other(output: str) -> None:
    """Raises AvatarError if `output` holds something else than a result of a batch; it may be an empty folder."""
    if not is_url(output):
        path = Path(output)
        if not path.exists() or (path.is_dir() and not any(path.iterdir())):
            return
        if read_record(output) is None:
            raise StoreError(
                "exists and is not a result of a batch; it is not replaced", kind="output", file=output
            )
        return
    if read_record(output) is not None:
        return
    store, inside = opened(output)
    with asked(output):
        if store.exists(f"{inside}/{MANIFEST}") or store.isfile(inside):
            raise StoreError("exists and is not a result of a batch", kind="output", file=output)


def read_record(output: str) -> dict[str, Any] | None:
    """What RECORD in the folder `output` says; None without one of ours. Raises StoreError."""
    try:
        said = json.loads(read_bytes(f"{output}/{RECORD}", RECORD_LIMIT))
    except StoreError:
        raise
    except (AvatarError, ValueError, RecursionError):
        return None
    ours = isinstance(said, dict) and said.get("format") == FORMAT
    return said if ours and NAME.fullmatch(str(said.get("folder"))) else None


def folder_of(output: str, record: Mapping[str, Any]) -> str:
    """Where the products lie that a RECORD in the folder `output` names."""
    return output if record["folder"] == HERE else f"{output}/{record['folder']}"


def bundle_of(location: str) -> str | None:
    """The bundle of a row whose folder is `location`; None for any other location. Raises StoreError."""
    record = None if location.lower().endswith(ALONE) else read_record(location)
    return None if record is None else f"{folder_of(location, record)}/{leaf(location)}"


def read_bytes(location: str, limit: int) -> bytes:
    """The bytes of a file of at most `limit` bytes. Raises AvatarError for none or a larger one, and StoreError."""
    with asked(location):
        if is_url(location):
            store, path = opened(location)
            size = store.size(path) or 0
            data: bytes = store.cat_file(path) if size <= limit else b""
        else:
            with open_file(Path(location)) as file:
                data = file.read(limit + 1)
                size = len(data)
    if size > limit:
        raise AvatarError(f"is longer than {limit} bytes", file=location)
    return data


def exists(location: str) -> bool:
    """Whether a file or folder is there. Raises StoreError."""
    if not is_url(location):
        return os.path.exists(location)
    store, path = opened(location)
    with asked(location):
        return bool(store.exists(path))


def make_folder(location: str) -> None:
    """Makes a folder and those above it; a store has none. Raises AvatarError where it cannot be made."""
    if is_url(location):
        return
    try:
        Path(location).mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise AvatarError(f"cannot be made ({error.strerror or error})", file=location) from None


def write_bytes(location: str, data: bytes) -> None:
    """Writes a file as a whole, in place of an older one. Raises AvatarError where it cannot be written."""
    if not is_url(location):
        text_files.write_bytes(Path(location), data, force=True)
        return
    store, path = opened(location)
    with asked(location, writing=True):
        store.pipe_file(path, data)


def sha256(location: str, name: str) -> str:
    """The hash of the content of the file `name` below `location` ("": itself). Raises AvatarError, StoreError."""
    whole = f"{location}/{name}" if name else location
    with asked(whole), _opened_file(whole) as file:
        return str(hashlib.file_digest(file, "sha256").hexdigest())


def _opened_file(location: str) -> Any:
    """Raises what the store or the system raises; of a local path also for what is no file."""
    if not is_url(location):
        return open_file(Path(location))
    store, path = opened(location)
    return store.open(path, "rb")
