"""Body models in the layout of FLAME, SMPL or SMPL-X, from `.npz` or `.pkl`, as checked arrays."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from avatar_export.bodies.body_pickles import body_globals
from avatar_export.formats.archive import Archive
from avatar_export.formats.npy import ComputedArray, RowSource, StoredArray, parse_npy, parse_text_npy
from avatar_export.formats.pickle.arrays import read_pickle
from avatar_runtime.avatar import F32, I32, U32
from avatar_runtime.io.errors import AvatarError
from avatar_runtime.io.files import open_file

IDENTITY_COUNT = 300  # FLAME's shapedirs hold 300 identity directions, then the expressions
WEIGHT_TOLERANCE = 1e-3
MAX_ARRAY_BYTES = 1 << 30
SMPLX_JOINTS, SMPLX_SMALL = 55, 10  # SMPL-X's smaller file holds 10 identity directions, then 10 expressions
ROOT = 2**32 - 1
_BODY_JOINTS = (
    "pelvis", "left_hip", "right_hip", "spine1", "left_knee", "right_knee", "spine2", "left_ankle",
    "right_ankle", "spine3", "left_foot", "right_foot", "neck", "left_collar", "right_collar", "head",
    "left_shoulder", "right_shoulder", "left_elbow", "right_elbow", "left_wrist", "right_wrist",
)  # fmt: skip
_FINGERS = tuple(
    f"{side}_{finger}{bone}"
    for side in ("left", "right")
    for finger in ("index", "middle", "pinky", "ring", "thumb")
    for bone in (1, 2, 3)
)
JOINT_NAMES = {
    5: ("root", "neck", "jaw", "leftEye", "rightEye"),
    24: (*_BODY_JOINTS, "left_hand", "right_hand"),
    SMPLX_JOINTS: (*_BODY_JOINTS, "jaw", "left_eye_smplhf", "right_eye_smplhf", *_FINGERS),
}

Array = npt.NDArray[Any]


@dataclass(frozen=True)
class BodyModel:
    """A linear body model: vertices = template + directions x coefficients, skinned by joints.

    Lengths are in the units of the file.
    """

    v_template: F32  # [V, 3]
    triangles: U32  # [F, 3]
    identity_dirs: F32  # [V, 3, S]
    expression_dirs: F32  # [V, 3, E]
    expression_names: tuple[str, ...]  # [E]
    posedirs: F32  # [V, 3, 9 (J - 1)], of R - I of joints 1.., row-major
    joint_regressor: F32  # [J, V]
    skin_weights: F32  # [V, J]
    parents: I32  # [J], -1 for a root, parents first
    joint_names: tuple[str, ...]  # [J]
    licence: str = ""  # that the file states

    @property
    def vertex_count(self) -> int:
        """The number of vertices, V."""
        return len(self.v_template)


def read_body_model(path: Path) -> BodyModel:
    """A body model in the layout of FLAME, SMPL or SMPL-X, in the units of the file (metres).

    Keys: v_template, f | faces, shapedirs (300 identity directions, then expressions; 10 and 10 in SMPL-X's smaller
    file) or shapedirs_identity and shapedirs_expression, posedirs ([V, 3, P] or [P, 3 V]), J_regressor (dense or
    sparse), weights | lbs_weights, kintree_table | parents; and licence, a list of one text, if
    the file states its terms. Raises AvatarError for a missing or unsound array.
    """
    fields = _Fields(path)
    template = fields.floats("v_template")
    v = len(template)
    fields.expect(template, "v_template", (None, 3))
    if not v:
        raise fields.wrong("has no vertices", "v_template")
    weights = fields.floats("weights", "lbs_weights")
    fields.expect(weights, "weights", (v, None))
    joints = weights.shape[1]
    identity, expression = _directions(fields, v, joints)
    _check_weights(fields, weights)
    regressor = fields.floats("J_regressor")
    fields.expect(regressor, "J_regressor", (joints, v))
    return BodyModel(
        v_template=template,
        triangles=_triangles(fields, v),
        identity_dirs=identity,
        expression_dirs=expression,
        expression_names=_expression_names(fields, expression.shape[2]),
        posedirs=_pose_directions(fields, v, joints),
        joint_regressor=regressor,
        skin_weights=weights,
        parents=_parents(fields, joints),
        joint_names=JOINT_NAMES.get(joints) or tuple(f"joint_{i}" for i in range(joints)),
        licence="; ".join(fields.names("licence")) if "licence" in fields else "",
    )


def _directions(fields: _Fields, v: int, joints: int) -> tuple[F32, F32]:
    if "shapedirs_identity" in fields:
        identity, expression = fields.floats("shapedirs_identity"), fields.floats("shapedirs_expression")
        fields.expect(identity, "shapedirs_identity", (v, 3, None))
        fields.expect(expression, "shapedirs_expression", (v, 3, None))
        return identity, expression
    both = fields.floats("shapedirs")
    fields.expect(both, "shapedirs", (v, 3, None))
    small = joints == SMPLX_JOINTS and both.shape[2] == 2 * SMPLX_SMALL
    count = SMPLX_SMALL if small else IDENTITY_COUNT
    return both[:, :, :count], both[:, :, count:]


def _expression_names(fields: _Fields, count: int) -> tuple[str, ...]:
    if "expression_names" not in fields:
        return tuple(f"exp_{i:03d}" for i in range(count))
    names = fields.names("expression_names")
    if len(names) != count or len(set(names)) != count or not all(names):
        raise fields.wrong(
            f"has {len(names)} names for {count} expressions, or duplicate names", "expression_names"
        )
    return names


def _pose_directions(fields: _Fields, v: int, joints: int) -> F32:
    dirs = fields.floats("posedirs")
    if dirs.ndim == 2 and dirs.shape[1] == 3 * v:  # as smplx stores it
        dirs = np.ascontiguousarray(dirs.reshape(-1, v, 3).transpose(1, 2, 0))
    fields.expect(dirs, "posedirs", (v, 3, 9 * (joints - 1)))
    return dirs


def _triangles(fields: _Fields, v: int) -> U32:
    faces = fields.whole("f", "faces")
    fields.expect(faces, "f", (None, 3))
    outside = (faces < 0) | (faces >= v)
    if outside.any():
        row = int(np.argmax(outside.any(axis=1)))
        raise fields.wrong(f"[{row}] = {faces[row].tolist()}, but there are {v} vertices (0..{v - 1})", "f")
    return faces.astype(np.uint32)


def _check_weights(fields: _Fields, weights: F32) -> None:
    if not weights.shape[1]:
        raise fields.wrong("has no joints", "weights")
    sums = weights.sum(axis=1, dtype=np.float64)
    wrong = (np.abs(sums - 1) > WEIGHT_TOLERANCE) | (weights < 0).any(axis=1)
    if wrong.any():
        row = int(np.argmax(wrong))
        raise fields.wrong(
            f"row {row} sums to {sums[row]:.6g}, its smallest weight is {weights[row].min():.6g}; "
            f"weights must be >= 0 and sum to 1 within {WEIGHT_TOLERANCE}",
            "weights",
        )


def _parents(fields: _Fields, joints: int) -> I32:
    parents = fields.whole("kintree_table", "parents")
    if parents.ndim == 2:
        fields.expect(parents, "kintree_table", (2, joints))
        if (parents[1] != np.arange(joints)).any():
            raise fields.wrong("row 1 is not 0, 1, 2, ...", "kintree_table")
        parents = parents[0]
    fields.expect(parents, "parents", (joints,))
    parents = np.where(parents == ROOT, -1, parents)
    wrong = (parents < -1) | (parents >= np.arange(joints))
    if wrong.any():
        joint = int(np.argmax(wrong))
        raise fields.wrong(
            f"joint {joint} has parent {int(parents[joint])}; parents must come before children", "parents"
        )
    return parents.astype(np.int32)


# Protocol 2 and later; (, ] and } open the tuple, list or dict of older ones, c names a global.
PICKLE_STARTS = (b"\x80", b"(", b"]", b"}", b"c")


def _other_zip(names: Collection[str]) -> str:
    """What a zip without arrays is, and what to pass instead."""
    torch_file = any(name.rpartition("/")[2] == "data.pkl" for name in names)
    what = "a file of torch.save (a tracked .frame or a .pth)" if torch_file else "a zip without arrays"
    return f"is not a body model but {what}; pass a FLAME or SMPL file, .npz or .pkl"


class _Fields:
    """The arrays of a body-model file by name, read on demand."""

    def __init__(self, path: Path):
        self.path = path
        try:
            with open_file(path) as stream:
                head = stream.read(4)
        except OSError as error:
            raise AvatarError(f"cannot be read ({error.strerror or error})", file=path) from error
        self._entries: dict[str, str] = {}
        self._objects: Mapping[Any, object] = {}
        if not (head == b"PK\x03\x04" or head[:1] in PICKLE_STARTS):
            raise AvatarError("is not a body model: neither .npz nor .pkl", file=path)
        if head == b"PK\x03\x04":
            with Archive(path) as archive:
                self._entries = {n.removesuffix(".npy"): n for n in archive.names if n.endswith(".npy")}
                if not self._entries:
                    raise AvatarError(_other_zip(archive.names), file=path)
            return
        content = read_pickle(path, body_globals(path))
        if not isinstance(content, dict):
            raise AvatarError("is not a body model: it does not hold a dict", file=path)
        self._objects = content

    def __contains__(self, name: str) -> bool:
        return name in self._entries or name in self._objects

    def floats(self, *names: str) -> F32:
        """The first array of `names` that exists, as finite float32."""
        name = self._first(names)
        source = self._source(name)
        if source.dtype.kind not in "fiu":
            raise self.wrong(f"has type {source.dtype}, numbers are needed", name)
        with np.errstate(over="ignore"):
            array = np.ascontiguousarray(source.read(), np.float32)
        if not np.isfinite(array).all():
            row = [int(i[0]) for i in np.nonzero(~np.isfinite(array))]
            raise self.wrong(f"{row} is not a finite number", name)
        return array

    def whole(self, *names: str) -> npt.NDArray[np.int64]:
        """The first array of `names` that exists, as whole numbers."""
        name = self._first(names)
        source = self._source(name)
        if source.dtype.kind not in "iu":
            raise self.wrong(f"has type {source.dtype}, whole numbers are needed", name)
        return source.read().astype(np.int64)

    def names(self, name: str) -> tuple[str, ...]:
        if name in self._entries:
            return parse_text_npy(self._entry(name), self.path, name)
        value = self._objects[name]
        if not isinstance(value, (list, tuple)) or not all(isinstance(text, str) for text in value):
            raise self.wrong("is not a list of names", name)
        return tuple(str(text) for text in value)

    def expect(self, array: Array, name: str, shape: tuple[int | None, ...]) -> None:
        """Raise AvatarError unless `array` has `shape`; None stands for any size."""
        fits = array.ndim == len(shape) and all(
            want is None or size == want for size, want in zip(array.shape, shape, strict=True)
        )
        if not fits or (array.size == 0 and 0 not in shape and None not in shape):
            wanted = ", ".join("any" if size is None else str(size) for size in shape)
            raise self.wrong(f"has shape {list(array.shape)}, expected [{wanted}]", name)

    def wrong(self, message: str, name: str) -> AvatarError:
        return AvatarError(message, file=self.path, field=name)

    def _first(self, names: tuple[str, ...]) -> str:
        for name in names:
            if name in self:
                return name
        there = ", ".join(ascii(str(key)[:40])[1:-1] for key in [*self._entries, *self._objects][:20])
        raise self.wrong(
            f"is missing; a body model needs it. This file has: {there or 'nothing'}", " or ".join(names)
        )

    def _entry(self, name: str) -> bytes:
        with Archive(self.path) as archive:
            return archive.read(self._entries[name], MAX_ARRAY_BYTES)

    def _source(self, name: str) -> RowSource:
        if name in self._entries:
            return parse_npy(self._entry(name), self.path, name)
        value = self._objects[name]
        if not isinstance(value, (StoredArray, ComputedArray)):
            raise self.wrong("is not an array", name)
        return value
