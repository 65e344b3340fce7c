"""Opens an .fbx: runs `scene.py` on its bytes in another process, and checks the result as untrusted data.

The process is separate because ufbx is C code that parses untrusted bytes. Lengths and axes are those of the file.
"""

from __future__ import annotations

import importlib.util
import io
import json
import os
import subprocess
import sys
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from avatar_runtime.avatar import F64, I64
from avatar_runtime.io.errors import AvatarError
from avatar_runtime.io.whole_files import read_bytes
from avatar_schema.extras import how_to_install

MAX_FILE_BYTES = 512 << 20
MAX_SECONDS = 300
MAX_NUMBER = 1e12
REFUSED = 3  # exit status of scene.py with a reason on stdout
FPS = 30.0  # at which scene.py samples animations
PROGRAM = Path(__file__).with_name("scene.py")
# ufbx's CoordinateAxis: +X, -X, +Y, -Y, +Z, -Z.
AXES = np.array([[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]], np.float64)
UNIT_METRES = (1e-6, 1e6)

Array = npt.NDArray[Any]


@dataclass(frozen=True)
class FbxCluster:
    """The vertices that one bone moves."""

    bone: int  # node
    vertices: I64  # [n]
    weights: F64  # [n]
    geometry_to_bone: F64  # [4, 4] at bind
    bind_to_world: F64  # [4, 4] world from bone, at bind


@dataclass(frozen=True)
class FbxShape:
    """A blend shape at full weight."""

    name: str
    vertices: I64  # [n]
    offsets: F64  # [n, 3]


@dataclass(frozen=True)
class FbxMesh:
    """A skinned mesh in its own (geometry) space."""

    name: str
    vertices: F64  # [V, 3]
    triangles: I64  # [F, 3] polygons as fans
    polygons: int  # faces of more than three corners
    clusters: tuple[FbxCluster, ...]
    shapes: tuple[FbxShape, ...]
    between: int  # number of in-between shapes, which are ignored
    linear: bool  # linear blend skinning; False: dual quaternions


@dataclass(frozen=True)
class FbxClip:
    """One animation, FPS frames a second."""

    name: str
    world: F64  # [T, nodes, 4, 4] world from node
    weights: F64  # [T, channels]


@dataclass(frozen=True)
class FbxFile:
    """The skinned meshes, nodes and animations of an .fbx."""

    name: str
    nodes: tuple[str, ...]
    parents: I64  # [nodes] -1 for a root; checked for loops
    channels: tuple[str, ...]  # names of all blend shapes, as in FbxShape
    meshes: tuple[FbxMesh, ...]
    clips: tuple[FbxClip, ...]
    axes: F64  # [3, 3] rotation to right-handed +Y up, face +Z
    unit: float  # metres

    def in_metres(self, world: F64) -> F64:
        """World transforms [..., 4, 4] of the file in mesh axes and metres; joints keep their axes, without scale."""
        result = world.copy()
        result[..., :3, :3] = self.axes @ world[..., :3, :3]
        result[..., :3, 3] = self.unit * (world[..., :3, 3] @ self.axes.T)
        return result


def open_fbx(path: Path) -> FbxFile:
    """Everything in the .fbx at `path` that a rig or a clip needs.

    Raises AvatarError for a file that is damaged, has left-handed axes, or crashes the FBX reader, and if the extra
    [fbx] is not installed.
    """
    if importlib.util.find_spec("ufbx") is None:
        raise AvatarError(f"reading .fbx needs the extra [fbx]: {how_to_install('fbx')}", file=path.name)
    fields = _Fields(path.name, _unpacked(_run(read_bytes(path, MAX_FILE_BYTES), path.name), path.name))
    unit = fields.number(fields.header, "unit_metres")
    if not UNIT_METRES[0] <= unit <= UNIT_METRES[1]:
        raise fields.wrong(
            f"is {unit:.6g} m per unit; between {UNIT_METRES[0]:g} and {UNIT_METRES[1]:g} is expected",
            "UnitScaleFactor",
        )
    nodes = fields.names(fields.header, "nodes")
    parents = fields.whole("parents", (len(nodes),), -1, len(nodes))
    _check_no_loop(parents, fields)
    channels = _short(fields.names(fields.header, "channels"))
    clips = tuple(
        FbxClip(
            fields.name(clip, "name"),
            fields.floats(f"{fields.name(clip, 'key')}.world", (None, len(nodes), 4, 4)),
            fields.floats(f"{fields.name(clip, 'key')}.weights", (None, len(channels))),
        )
        for clip in fields.entries("clips")
    )
    meshes = tuple(
        _mesh(fields, f"mesh{i}", entry, len(nodes), channels)
        for i, entry in enumerate(fields.entries("meshes"))
    )
    return FbxFile(path.name, nodes, parents, channels, meshes, clips, _axes(fields), unit)


def _run(data: bytes, file: str) -> bytes:
    """The output of scene.py for the bytes of an .fbx."""
    try:
        done = subprocess.run(
            [sys.executable, "-P", str(PROGRAM)],
            input=data,
            capture_output=True,
            timeout=MAX_SECONDS,
            env={**os.environ, "OPENBLAS_NUM_THREADS": "1"},
            check=False,
        )
    except subprocess.TimeoutExpired:
        raise AvatarError(f"takes longer than {MAX_SECONDS} s to read; export it again", file=file) from None
    except OSError as error:
        raise AvatarError(
            f"cannot be read: its reader does not start ({error.strerror or error})", file=file
        ) from None
    if done.returncode == REFUSED:
        raise AvatarError(f"is a damaged .fbx ({done.stdout[:200].decode('utf-8', 'replace')!a})", file=file)
    if done.returncode:
        reason = done.stderr[-200:].decode("utf-8", "replace").strip().rpartition("\n")[2]
        raise AvatarError(
            f"crashes the FBX reader (status {done.returncode}, {reason!a}); export it again, or as .glb",
            file=file,
        )
    return done.stdout


def _unpacked(data: bytes, file: str) -> dict[str, Array]:
    try:
        with np.load(io.BytesIO(data), allow_pickle=False) as archive:
            return {name: archive[name] for name in archive.files}
    except Exception as error:  # a damaged zip or header raises almost anything
        raise AvatarError(f"gives no arrays in the FBX reader ({type(error).__name__})", file=file) from None


def _axes(fields: _Fields) -> F64:
    codes = fields.whole("axes", (3,), 0, None)
    if (codes >= len(AXES)).any():
        raise fields.wrong("does not name an axis", "UpAxis")
    axes = AXES[codes]  # rows: mesh +X, +Y, +Z in the axes of the file
    if abs(np.linalg.det(axes) - 1) > 0.5:
        raise fields.wrong("has left-handed axes; export it with right-handed axes", "CoordAxis")
    return axes


def _check_no_loop(parents: I64, fields: _Fields) -> None:
    above = parents.copy()
    for _ in range(len(parents).bit_length()):  # each pass doubles the distance
        above = np.where(above >= 0, np.where(above >= 0, above[above], -1), -1)
    if (above >= 0).any():
        raise fields.wrong("contains a loop", "nodes")


def _short(channels: tuple[str, ...]) -> tuple[str, ...]:
    """Names without the deformer's (`blendShape1.AK_25_JawOpen`), if they stay different."""
    short = tuple(name.rsplit(".", 1)[-1] for name in channels)
    return short if len(set(short)) == len(set(channels)) and all(short) else channels


def _mesh(
    fields: _Fields, key: str, entry: Mapping[str, Any], nodes: int, channels: tuple[str, ...]
) -> FbxMesh:
    vertices = fields.floats(f"{key}.vertices", (None, 3))
    v = len(vertices)
    bones = fields.numbers(entry, "bones", nodes)
    clusters = tuple(
        FbxCluster(
            bone,
            fields.whole(f"{key}.cluster{i}.vertices", (None,), 0, v),
            fields.floats(f"{key}.cluster{i}.weights", (None,)),
            fields.floats(f"{key}.cluster{i}.geometry_to_bone", (4, 4)),
            fields.floats(f"{key}.cluster{i}.bind_to_world", (4, 4)),
        )
        for i, bone in enumerate(bones)
    )
    used = fields.numbers(entry, "channels", len(channels))
    full = fields.floats(f"{key}.target_weights", (len(used),))
    shapes = tuple(
        FbxShape(
            channels[channel],
            fields.whole(f"{key}.shape{i}.vertices", (None,), 0, v),
            fields.floats(f"{key}.shape{i}.offsets", (None, 3)) / (full[i] if abs(full[i]) > 1e-6 else 1.0),
        )
        for i, channel in enumerate(used)
    )
    for part, rows, values in (
        *(("cluster", c.vertices, c.weights) for c in clusters),
        *(("shape", s.vertices, s.offsets) for s in shapes),
    ):
        if len(rows) != len(values):
            raise fields.wrong(f"a {part} has {len(values)} values for {len(rows)} vertices", key)
    triangles, polygons = _fans(fields, key, v)
    between = sum(fields.numbers(entry, "between", 1 << 31))
    linear = entry.get("linear") is True
    return FbxMesh(
        fields.name(entry, "name"), vertices, triangles, polygons, clusters, shapes, between, linear
    )


def _fans(fields: _Fields, key: str, vertices: int) -> tuple[I64, int]:
    """(triangles [F, 3], number of polygons with more than three corners), in the order of the faces."""
    indices = fields.whole(f"{key}.indices", (None,), 0, vertices)
    faces = fields.whole(f"{key}.faces", (None, 2), 0, None)
    first, corners = faces.T
    if ((first > len(indices)) | (corners > len(indices) - first)).any():
        raise fields.wrong("has a face that reads beyond its corners", key)
    count = np.maximum(corners - 2, 0)
    face = np.repeat(np.arange(len(faces)), count)
    step = np.arange(len(face)) - np.repeat(np.cumsum(count) - count, count)
    at = first[face]
    triangles: I64 = (
        indices[np.stack([at, at + step + 1, at + step + 2], axis=1)] if len(face) else np.zeros((0, 3), int)
    )
    return triangles, int(np.count_nonzero(corners > 3))


class _Fields:
    """Checked access to the arrays that scene.py wrote."""

    def __init__(self, file: str, arrays: Mapping[str, Array]):
        self.file = file
        self._arrays = arrays
        try:
            header = json.loads(bytes(arrays["header"].astype(np.uint8)))
        except (KeyError, ValueError, RecursionError):
            raise self.wrong("is missing", "header") from None
        if not isinstance(header, dict):
            raise self.wrong("is not a JSON object", "header")
        self.header: dict[str, Any] = header

    def wrong(self, message: str, field: str) -> AvatarError:
        return AvatarError(message, file=self.file, field=field)

    def floats(self, name: str, shape: tuple[int | None, ...]) -> F64:
        array = self._array(name, "f", shape)
        if not (np.abs(array) <= MAX_NUMBER).all():
            raise self.wrong("holds a value that is not a finite number, or too large", name)
        return array.astype(np.float64)

    def whole(self, name: str, shape: tuple[int | None, ...], least: int, limit: int | None) -> I64:
        """Whole numbers of at least `least` and below `limit`."""
        array = self._array(name, "iu", shape).astype(np.int64)
        if array.size and (int(array.min()) < least or (limit is not None and int(array.max()) >= limit)):
            raise self.wrong(
                f"holds values {int(array.min())}..{int(array.max())}, but there are {limit}", name
            )
        return array

    def _array(self, name: str, kinds: str, shape: tuple[int | None, ...]) -> Array:
        array = self._arrays.get(name)
        fits = array is not None and array.ndim == len(shape) and array.dtype.kind in kinds
        if (
            array is None
            or not fits
            or any(want is not None and size != want for size, want in zip(array.shape, shape, strict=True))
        ):
            raise self.wrong("is missing, or has another shape", name)
        return array

    def entries(self, key: str) -> list[Mapping[str, Any]]:
        found = self.header.get(key)
        if not isinstance(found, list) or not all(isinstance(entry, dict) for entry in found):
            raise self.wrong("is not a list", key)
        return found

    def names(self, entry: Mapping[str, Any], key: str) -> tuple[str, ...]:
        found = entry.get(key)
        if not isinstance(found, list) or not all(isinstance(name, str) for name in found):
            raise self.wrong("is not a list of names", key)
        return tuple(found)

    def name(self, entry: Mapping[str, Any], key: str) -> str:
        return self.names({key: [entry.get(key)]}, key)[0]

    def number(self, entry: Mapping[str, Any], key: str) -> float:
        value = entry.get(key)
        if not isinstance(value, (int, float)):
            raise self.wrong("is not a number", key)
        return float(value)

    def numbers(self, entry: Mapping[str, Any], key: str, limit: int) -> list[int]:
        found = entry.get(key)
        if not isinstance(found, list) or not all(type(i) is int and 0 <= i < limit for i in found):
            raise self.wrong("is not a list of indices", key)
        return found
