"""Checkpoints of a run: one file each, written whole or not at all; the last two are kept.

A file is MAGIC, the length of the body (u64, little endian), the body and the body's SHA-256. The body is a tree of
dicts, lists, numbers and texts as JSON (its length as u64 before it, padded to 8 bytes) and then its tensors as
safetensors. Nothing in it can be executed, and reading it takes no more memory than the file has bytes.
"""

from __future__ import annotations

import hashlib
import json
import os
import re
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import torch

from avatar_runtime import AvatarError
from avatar_runtime.codec import safetensors
from avatar_runtime.io import open_file, sync_folder

MAGIC = b"AVTRAIN1"
NAME = re.compile(r"iteration_(\d{6,9})\.ckpt")
PARTIAL = ".partial"  # ending of a file that is being written
KEPT = 2
DIGEST = 32  # bytes
TENSOR, DICT, LIST = "tensor", "dict", "list"  # the one key of a JSON object that stands for such a thing

Note = Callable[[str], None]


@dataclass(frozen=True)
class Checkpoint:
    """What one file holds."""

    path: Path
    iteration: int
    state: dict[str, Any]


def path_of(folder: Path, iteration: int) -> Path:
    """The file of an iteration's checkpoint."""
    return folder / f"iteration_{iteration:06d}.ckpt"


def write(folder: Path, iteration: int, state: dict[str, Any]) -> Path:
    """Write the checkpoint of an iteration, then remove all but the last two.

    `state`: dicts with text keys, lists, tensors, numbers, texts, None; TypeError for anything else. The
    earlier checkpoints stay whole at every moment. Raises OSError if it cannot be written.
    """
    folder.mkdir(parents=True, exist_ok=True)
    path = path_of(folder, iteration)
    partial = path.with_name(f".{path.name}{PARTIAL}")
    try:
        with partial.open("wb") as file:
            pieces = _body({"iteration": iteration, "state": state})
            file.write(MAGIC + sum(len(piece) for piece in pieces).to_bytes(8, "little"))
            digest = hashlib.sha256()
            for piece in pieces:
                file.write(piece)
                digest.update(piece)
            file.write(digest.digest())
            file.flush()
            os.fsync(file.fileno())
        partial.replace(path)
    except BaseException:
        partial.unlink(missing_ok=True)
        raise
    sync_folder(folder)
    for old in paths(folder)[:-KEPT]:
        old.unlink(missing_ok=True)
    return path


def paths(folder: Path) -> list[Path]:
    """The checkpoint files of a folder, whole or not, oldest first."""
    if not folder.is_dir():
        return []
    found = [(int(m[1]), p) for p in folder.iterdir() if (m := NAME.fullmatch(p.name))]
    return [path for _, path in sorted(found)]


def partials(folder: Path) -> list[Path]:
    """Partial files of an interrupted write in a folder."""
    return sorted(folder.glob(f".iteration_*{PARTIAL}")) if folder.is_dir() else []


def remove(folder: Path) -> None:
    """Remove every checkpoint of a folder, the newest last, so that an interruption leaves a valid run."""
    for path in [*partials(folder), *paths(folder)]:
        path.unlink(missing_ok=True)


def newest(folder: Path, note: Note) -> Checkpoint | None:
    """The newest whole checkpoint; None without a file. `note` gets a line for each that is not whole.

    Raises AvatarError if there are files but none is whole.
    """
    found = paths(folder)
    for path in reversed(found):
        try:
            return read(path)
        except AvatarError as error:
            note(f"{error}; trying the one before")
    if found:
        raise AvatarError("every checkpoint here is damaged; --no-resume starts again", file=folder)
    return None


def read(path: Path) -> Checkpoint:
    """One checkpoint. Raises AvatarError for a file that is not whole or not a checkpoint."""
    body = _whole_body(path)
    view = memoryview(body)
    size = int.from_bytes(view[:8], "little")
    if len(body) < 8 or size > len(body) - 8:
        raise AvatarError("is not a checkpoint of avatar-train (tree)", file=path)
    arrays = safetensors.decode(view[8 + size :], str(path))
    try:
        top = _unpacked(json.loads(bytes(view[8 : 8 + size])), arrays)
        iteration, state = top["iteration"], top["state"]
    except (ValueError, KeyError, TypeError, AttributeError, RecursionError):
        raise AvatarError("is not a checkpoint of avatar-train (tree)", file=path) from None
    if type(iteration) is not int or iteration < 0 or not isinstance(state, dict):
        raise AvatarError("is not a checkpoint of avatar-train (state)", file=path)
    return Checkpoint(path, iteration, state)


def _whole_body(path: Path) -> bytearray:
    try:
        with open_file(path) as file:
            held = os.fstat(file.fileno()).st_size - len(MAGIC) - 8 - DIGEST
            start = file.read(len(MAGIC) + 8)
            if start[: len(MAGIC)] != MAGIC:
                raise AvatarError("is not a checkpoint of avatar-train", file=path)
            claimed = int.from_bytes(start[len(MAGIC) :], "little")
            if held < 0 or claimed != held:
                raise AvatarError(f"is cut: {max(held, 0)} bytes of {claimed}", file=path)
            body = bytearray(claimed)
            if file.readinto(body) != claimed or hashlib.sha256(body).digest() != file.read():
                raise AvatarError("is damaged: its SHA-256 does not match", file=path)
            return body
    except OSError as error:
        raise AvatarError(f"cannot be read ({error.strerror or error})", file=path) from None


def _body(tree: dict[str, Any]) -> list[bytes | memoryview]:
    arrays: dict[str, npt.NDArray[Any]] = {}
    text = json.dumps(_packed(tree, arrays), separators=(",", ":")).encode()
    text += b" " * (-len(text) % 8)
    return [len(text).to_bytes(8, "little") + text, *safetensors.encode(arrays)]


def _packed(value: Any, arrays: dict[str, npt.NDArray[Any]]) -> Any:
    """`value` as JSON data; its tensors go to `arrays`, boolean ones as bytes."""
    if isinstance(value, torch.Tensor):
        key = str(len(arrays))
        array = value.detach().cpu().contiguous().numpy()
        arrays[key] = array.view(np.uint8) if array.dtype == bool else array
        return {TENSOR: key, "bool": array.dtype == bool}
    if isinstance(value, dict):
        if not all(isinstance(key, str) for key in value):
            raise TypeError(f"the keys {list(value)[:4]} of a state are not all texts")
        return {DICT: {key: _packed(inner, arrays) for key, inner in value.items()}}
    if isinstance(value, list | tuple):
        return {LIST: [_packed(inner, arrays) for inner in value]}
    if value is None or isinstance(value, bool | int | float | str):
        return value
    raise TypeError(f"a state cannot hold a {type(value).__name__}")


def _unpacked(value: Any, arrays: dict[str, npt.NDArray[Any]]) -> Any:
    if not isinstance(value, dict):
        if isinstance(value, list):
            raise ValueError("a bare list")
        return value
    if TENSOR in value:
        tensor = torch.from_numpy(arrays[value[TENSOR]])
        return tensor.to(torch.bool) if value["bool"] else tensor
    if DICT in value:
        return {key: _unpacked(inner, arrays) for key, inner in value[DICT].items()}
    return [_unpacked(inner, arrays) for inner in value[LIST]]
