"""The small files of one subject: identity shape, eyelids, index lists."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from avatar_export.formats.archive import Archive
from avatar_export.formats.json_text import json_fault
from avatar_export.formats.npy import ComputedArray, StoredArray, open_npy, parse_npy
from avatar_export.formats.pth import read_frame
from avatar_runtime.avatar import F32, F64
from avatar_runtime.io.errors import AvatarError
from avatar_runtime.io.files import open_file

MAX_COEFFICIENTS = 300
MAX_TEXT_BYTES = 256 << 20
EYELID_FILES = {"left": "l_eyelid.npy", "right": "r_eyelid.npy"}
SHAPE_FILE = "a .frame, .npy, .npz or JSON file with the identity coefficients of a subject"
FACES_FILE = "a text file with face indices, such as back_of_head.txt"
OFFSET_FILE = "static_offset.npy"
TEETH = 120  # vertices that VHAP and GaussianAvatars append to FLAME's
SHAPE_KEYS = ("shape", "shape_params", "betas")


def read_shape(path: Path) -> F64:
    """Identity coefficients [S], S <= 300, from a tracked `.frame`, `.npy`, `.npz` or `.json`.

    A dict is searched for flame.shape, shape, shape_params or betas. Raises AvatarError if there is no
    list of finite numbers.
    """
    values = np.asarray(_shape_values(path), np.float64)
    if sum(size > 1 for size in values.shape) > 1 or not 0 < values.size <= MAX_COEFFICIENTS:
        raise _wrong(f"expected 1 to {MAX_COEFFICIENTS} coefficients, got shape {list(values.shape)}", path)
    values = values.reshape(-1)
    if not np.isfinite(values).all():
        raise _wrong(f"[{int(np.argmax(~np.isfinite(values)))}] is not a finite number", path)
    return values


def read_static_offset(path: Path, vertices: int) -> F32 | None:
    """[V, 3] metres, `static_offset` of an .npz beside its coefficients (VHAP, GaussianAvatars); None if it has none.

    It is added to the template. Rows beyond `vertices` are the teeth that these tools append to FLAME; they are left
    out. Raises AvatarError for fewer rows and for a value that is not finite.
    """
    with open_file(path) as stream:
        if stream.read(2) != b"PK":
            return None
    with Archive(path) as archive:
        if OFFSET_FILE not in archive.names:
            return None
        source = parse_npy(archive.read(OFFSET_FILE), path, OFFSET_FILE)
    values = np.asarray(_numbers(source, path), np.float32).reshape(-1)
    offset = values.reshape(-1, 3) if values.size % 3 == 0 else values[:0, None]
    if len(offset) not in (vertices, vertices + TEETH):
        raise AvatarError(
            f"is {list(source.shape)}, but the body model has {vertices} vertices",
            file=path,
            field="static_offset",
        )
    if not np.isfinite(offset).all():
        raise AvatarError("holds a value that is not finite", file=path, field="static_offset")
    return offset[:vertices]


def read_eyelids(folder: Path, vertices: int) -> dict[str, F32]:
    """ "left" and "right" -> [V, 3] offsets of a body model's vertices for a closed eyelid.

    From l_eyelid.npy and r_eyelid.npy in `folder`. Raises AvatarError for a missing file, another shape, NaN.
    """
    return {side: _vertex_offsets(folder / name, vertices) for side, name in EYELID_FILES.items()}


def read_faces(path: Path, count: int) -> npt.NDArray[np.int32]:
    """Face indices below `count` from a text file such as back_of_head.txt, in its order and with repeats.

    Raises AvatarError for a word that is not a number, an index out of range, or an empty file.
    """
    words = _text(path, FACES_FILE).replace(",", " ").split()
    if not words:
        raise AvatarError("has no face index", file=path)
    for row, word in enumerate(words):
        if not (word.isascii() and word.isdigit()) or len(word) > 10 or int(word) >= count:
            raise AvatarError(
                f"entry {row} is {word[:20]!a}, expected a face of the body model, 0..{count - 1}", file=path
            )
    return np.array([int(word) for word in words], np.int32)


def _vertex_offsets(path: Path, vertices: int) -> F32:
    source = open_npy(path)
    if source.shape != (vertices, 3) or source.dtype.kind != "f":
        raise AvatarError(
            f"expected floats [{vertices}, 3] (one row per vertex of the body model), "
            f"got {source.dtype}{list(source.shape)}",
            file=path,
        )
    with np.errstate(over="ignore"):
        offsets = source.rows(0, vertices)
    if not np.isfinite(offsets).all():
        raise AvatarError(f"row {int(np.nonzero(~np.isfinite(offsets))[0][0])} is not finite", file=path)
    return offsets


def _shape_values(path: Path) -> Any:
    try:
        with open_file(path) as stream:
            head = stream.read(6)
    except OSError as error:
        raise AvatarError(f"cannot be read ({error.strerror or error})", file=path) from error
    if head == b"\x93NUMPY":
        return _numbers(open_npy(path), path)
    if not head.startswith(b"PK"):
        return _from_json(path)
    with Archive(path) as archive:
        if not any(name.endswith("data.pkl") for name in archive.names):
            keys = [key for key in SHAPE_KEYS if f"{key}.npy" in archive.names]
            name = f"{keys[0]}.npy" if keys else archive.names[0] if len(archive.names) == 1 else None
            if name is None:
                raise _wrong(f"has no array {' or '.join(SHAPE_KEYS)}", path)
            return _numbers(parse_npy(archive.read(name), path, name), path)
    return _numbers(_search(read_frame(path), path), path)


def _from_json(path: Path) -> Any:
    try:
        content = json.loads(_text(path, SHAPE_FILE))
    except (ValueError, RecursionError) as error:
        raise _wrong(f"is not {SHAPE_FILE} ({json_fault(error)})", path) from None
    values = _search(content, path) if isinstance(content, dict) else content
    if isinstance(values, list) and len(values) == 1 and isinstance(values[0], list):
        values = values[0]
    if not isinstance(values, list) or not all(type(v) in (int, float) and abs(v) < 1e30 for v in values):
        raise _wrong("is not a list of numbers", path)
    return values


def _search(content: dict[str, Any], path: Path) -> Any:
    flame = content.get("flame")
    for holder in (flame if isinstance(flame, dict) else {}, content):
        for key in SHAPE_KEYS:
            if key in holder:
                return holder[key]
    raise _wrong(f"has no key flame.shape, {' or '.join(SHAPE_KEYS)}", path)


def _numbers(source: object, path: Path) -> Any:
    if not isinstance(source, (StoredArray, ComputedArray)) or source.dtype.kind not in "fiu":
        raise _wrong("is not an array of numbers", path)
    return source.read()


def _text(path: Path, wanted: str) -> str:
    """The text of a small file; `wanted` says what the file should be."""
    try:
        if path.stat().st_size > MAX_TEXT_BYTES:
            raise AvatarError(
                f"is larger than {MAX_TEXT_BYTES} bytes, too large for such a text file", file=path
            )
        with open_file(path) as stream:
            return stream.read().decode("utf8")
    except OSError as error:
        raise AvatarError(f"cannot be read ({error.strerror or error})", file=path) from None
    except UnicodeDecodeError:
        raise AvatarError(f"is not {wanted}: it is not UTF-8 text", file=path) from None


def _wrong(message: str, path: Path) -> AvatarError:
    return AvatarError(message, file=path, field="shape")
