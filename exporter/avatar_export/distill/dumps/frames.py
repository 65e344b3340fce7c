"""The numbers of frames, decoded: log scale, opacity logit, wxyz quaternions, SH; metres, +Y up.

Only some rows of all frames are held at a time, so that memory does not grow with the number of Gaussians.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from avatar_export.distill.dumps.folder import OWNER, Dumps, Encoding
from avatar_export.distill.sh_turn import turned_sh
from avatar_runtime.avatar import F32, I64
from avatar_runtime.codec import ply
from avatar_runtime.io.errors import AvatarError
from avatar_runtime.io.files import open_file
from avatar_runtime.rotation import quat_from_matrix, quat_multiply
from avatar_schema import constants

COVARIANCE = tuple(f"cov_{k}" for k in range(6))  # xx xy xz yy yz zz
NORMALS = ("nx", "ny", "nz")
SCALE_FLOOR = 1e-9  # of a linear scale, before its logarithm
OPACITY_FLOOR = 1e-6  # of a linear opacity and of 1 minus it

Array = npt.NDArray[Any]


@dataclass(frozen=True)
class Rows:
    """Some Gaussians over some frames, decoded."""

    mean: F32  # [F, n, 3] metres
    log_scale: F32  # [F, n, 3] ln of metres
    quat_wxyz: F32  # [F, n, 4] unit, of either sign
    opacity_logit: F32  # [F, n]
    sh: F32  # [F, n, K, 3]

    def take(self, frames: Array) -> Rows:
        """The given frames."""
        return Rows(
            self.mean[frames],
            self.log_scale[frames],
            self.quat_wxyz[frames],
            self.opacity_logit[frames],
            self.sh[frames],
        )


@dataclass(frozen=True)
class Layout:
    """Where the properties of the frames' rows lie; equal in all frames."""

    names: tuple[str, ...]
    rows: int
    head: int  # bytes before the rows
    dtype: np.dtype[Any]

    @property
    def sh_count(self) -> int:
        """SH coefficients a channel, K."""
        return 1 + sum(name.startswith("f_rest_") for name in self.names) // 3


def layout(file: Path, encoding: Encoding) -> Layout:
    """The layout of a frame. Raises AvatarError for a file that is no frame, and for features that need a decoder."""
    try:
        with open_file(file) as stream:
            data = stream.read(ply.MAX_HEADER_BYTES)
            size = stream.seek(0, 2)
    except OSError as error:
        raise AvatarError(f"cannot be read ({error.strerror or error})", file=file, owner=OWNER) from None
    found = ply.header(data, size, file)
    known = {*ply.POSITION, *ply.NORMAL, *ply.DC, *ply.OPACITY}
    known |= set(COVARIANCE) if encoding.scale == "covariance" else {*ply.SCALE, *ply.ROTATION}
    names = tuple(found.dtype.names or ())
    missing = sorted(known - set(NORMALS) - set(names))
    features = [name for name in names if name not in known and not name.startswith("f_rest_")]
    if set(ply.DC) & set(missing) and features:
        raise AvatarError(
            f"has no colours but features ({features[0]}, ...) that a network must decode; dump the decoded colours as "
            "f_dc_0..2",
            file=file,
            owner=OWNER,
        )
    if missing:
        hint = ""
        if set(COVARIANCE) <= set(names):
            hint = "; it holds covariances: set encoding.scale to covariance"
        raise AvatarError(f"is missing{hint}", file=file, field=f"property {missing[0]}", owner=OWNER)
    wide = [
        name
        for name in features
        if name.rpartition("_")[0] in ("feature", "feat", "f_feat", "latent", "code")
    ]
    if wide:
        raise AvatarError(
            f"has {len(wide)} features ({wide[0]}, ...) that a network must decode: a portable avatar has SH colours "
            "only; dump the decoded colours alone",
            file=file,
            owner=OWNER,
        )
    rest = sum(name.startswith("f_rest_") for name in names)
    if rest not in ply.REST_COUNTS:
        known_counts = ", ".join(map(str, ply.REST_COUNTS))
        raise AvatarError(
            f"{rest} properties, expected one of {known_counts}", file=file, field="f_rest_*", owner=OWNER
        )
    gap = next((k for k in range(rest) if f"f_rest_{k}" not in names), None)
    if gap is not None:
        raise AvatarError("is missing", file=file, field=f"property f_rest_{gap}", owner=OWNER)
    return Layout(names, found.rows, found.offset, found.dtype)


def read_rows(dumps: Dumps, known: Layout, rows: slice | I64, order: I64 | None = None) -> Rows:
    """The given Gaussians in all frames, decoded.

    `order` [F, N], where rows changed their places: Gaussian i is row order[f, i] of frame f. Raises AvatarError for a
    number that is not finite.
    """
    frames = dumps.drivers.frames
    count = rows.stop - rows.start if isinstance(rows, slice) else len(rows)
    raw = np.empty((frames, count, len(known.names)), np.float32)
    for index in range(frames):
        raw[index] = raw_rows(dumps.frame(index), known, rows if order is None else order[index, rows])
    return decoded(dumps, known, raw)


def read_frame(dumps: Dumps, known: Layout, index: int, order: I64 | None = None) -> Rows:
    """All rows of one frame, decoded, [1, N, ...]."""
    rows = slice(0, known.rows) if order is None else order[index]
    return decoded(dumps, known, raw_rows(dumps.frame(index), known, rows)[None])


def raw_rows(file: Path, known: Layout, rows: slice | I64) -> F32:
    """[n, properties] of a frame as stored."""
    part = rows if isinstance(rows, slice) else slice(0, known.rows)
    first, count = part.start, part.stop - part.start
    try:
        with open_file(file) as stream:
            stream.seek(known.head + first * known.dtype.itemsize)
            data = stream.read(count * known.dtype.itemsize)
    except OSError as error:
        raise AvatarError(f"cannot be read ({error.strerror or error})", file=file, owner=OWNER) from None
    if len(data) != count * known.dtype.itemsize:
        raise AvatarError("became shorter while it was read", file=file, owner=OWNER)
    if all(known.dtype[name] == np.dtype("<f4") for name in known.names):
        result: F32 = np.frombuffer(data, "<f4").reshape(count, -1)
    else:
        table = np.frombuffer(data, known.dtype)
        result = np.stack([table[name].astype(np.float32) for name in known.names], axis=1)
    return result if isinstance(rows, slice) else result[rows]


def decoded(dumps: Dumps, known: Layout, raw: F32) -> Rows:
    """Decode [F, n, properties]. Raises AvatarError for a number that is not finite or cannot be decoded."""
    at = {name: column for column, name in enumerate(known.names)}

    def columns(names: Sequence[str]) -> F32:
        index = [at[name] for name in names]
        if index == list(range(index[0], index[0] + len(index))):
            return raw[..., index[0] : index[0] + len(index)]
        return raw[..., index]

    encoding = dumps.encoding
    turn = dumps.turn
    mean = columns(ply.POSITION) * np.float32(dumps.unit)
    if encoding.scale == "covariance":
        log_scale, quat = from_covariance(columns(COVARIANCE))
    else:
        log_scale, quat = _log_scale(columns(ply.SCALE), encoding), columns(ply.ROTATION)
        quat = quat if encoding.quaternion == "wxyz" else quat[..., [3, 0, 1, 2]]
    length = np.maximum(np.linalg.norm(quat, axis=-1, keepdims=True), np.float32(1e-12))
    quat = np.asarray(quat / length, np.float32)
    opacity = columns(ply.OPACITY)[..., 0]
    if encoding.opacity == "linear":
        clipped = np.clip(opacity, OPACITY_FLOOR, 1 - OPACITY_FLOOR)
        opacity = np.log(clipped / (1 - clipped))
    sh = _sh(columns, known, encoding)
    if not np.array_equal(turn, np.eye(3)):
        mean = mean @ turn.T.astype(np.float32)
        quat = quat_multiply(quat_from_matrix(turn).astype(np.float32), quat)
        sh = turned_sh(sh, turn.astype(np.float32)) if sh.shape[2] > 1 else sh
    log_scale = log_scale + np.float32(np.log(dumps.unit))
    return Rows(*(np.ascontiguousarray(part, np.float32) for part in (mean, log_scale, quat, opacity, sh)))


def _log_scale(scale: F32, encoding: Encoding) -> F32:
    if encoding.scale == "log":
        return scale
    half = np.float32(0.5 if encoding.scale == "variance" else 1)
    result: F32 = half * np.log(np.maximum(scale, SCALE_FLOOR ** (2 if encoding.scale == "variance" else 1)))
    return result


def _sh(columns: Any, known: Layout, encoding: Encoding) -> F32:
    """[F, n, K, 3]; f_rest is stored channel by channel."""
    dc: F32 = columns(ply.DC)
    if encoding.colour == "rgb":
        dc = (dc - np.float32(0.5)) / np.float32(constants()["sh_c0"][0])
    rest = known.sh_count - 1
    if not rest:
        return dc[..., None, :]
    higher: F32 = columns([f"f_rest_{k}" for k in range(3 * rest)])
    higher = higher.reshape(*higher.shape[:-1], 3, rest).swapaxes(-1, -2)
    return np.concatenate([dc[..., None, :], higher], axis=-2)


def from_covariance(packed: F32) -> tuple[F32, F32]:
    """(log scales [F, n, 3], quaternions wxyz [F, n, 4]) of covariances [F, n, 6] (xx xy xz yy yz zz).

    Axes are named as in the first frame: each later frame takes the order and signs nearest to the frame before.
    """
    full = packed[..., [0, 1, 2, 1, 3, 4, 2, 4, 5]].reshape(*packed.shape[:-1], 3, 3).astype(np.float64)
    value, axes = np.linalg.eigh(full)
    for frame in range(1, len(axes)):
        likeness = np.abs(np.einsum("nij,nik->njk", axes[frame - 1], axes[frame]))  # [n, before, now]
        totals = np.stack([sum(likeness[:, k, p[k]] for k in range(3)) for p in PERMUTATIONS], axis=1)
        order = np.array(PERMUTATIONS)[np.argmax(totals, axis=1)]
        value[frame] = np.take_along_axis(value[frame], order, axis=1)
        axes[frame] = np.take_along_axis(axes[frame], order[:, None, :], axis=2)
        sign = np.sign(np.einsum("nij,nij->nj", axes[frame - 1], axes[frame]))
        axes[frame] *= np.where(sign == 0, 1, sign)[:, None, :]
    axes *= np.sign(np.linalg.det(axes))[..., None, None]
    log_scale = 0.5 * np.log(np.maximum(value, SCALE_FLOOR**2))
    return log_scale.astype(np.float32), quat_from_matrix(axes).astype(np.float32)


PERMUTATIONS = ((0, 1, 2), (0, 2, 1), (1, 0, 2), (1, 2, 0), (2, 0, 1), (2, 1, 0))
