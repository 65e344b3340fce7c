"""The golden vectors under tests/data/golden: what released code computed, packed small enough to commit.

`pack.py` beside them makes the files; README.md there says where the numbers come from. Two containers: a
`.planes.xz` (this file's own, arrays only) and a `.tar.xz` (files that must keep every byte).
"""

from __future__ import annotations

import hashlib
import io
import json
import lzma
import tarfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from tests.shared_data import shared

GOLDEN = Path(__file__).parent / "data" / "golden"
FRAMES = (0, 1, 2, 3)

Array = npt.NDArray[Any]
# Literal context bits are off: in a byte plane the neighbour before says nothing about the next byte.
PLANES_FILTER = [
    {
        "id": lzma.FILTER_LZMA2,
        "preset": 9 | lzma.PRESET_EXTREME,
        "dict_size": 1 << 24,
        "lc": 0,
        "lp": 0,
        "pb": 0,
    }
]

# backend that the released codes' numbers judge: what stands behind a name in its figures
ON = {"reference": "", "cpu": " on cpu"}


def dumps(arrays: Mapping[str, Array]) -> bytes:
    """Arrays as an xz of byte planes: a line of JSON ([name, dtype, shape, distinct words]), then the data.

    An array of few distinct 4-byte words is stored as the sorted words and an index of 1 or 2 bytes; the
    index and all other arrays are stored plane by plane (all first bytes, all second bytes ...).
    """
    index, parts = [], []
    for name, array in arrays.items():
        data = np.ascontiguousarray(array).reshape(-1)
        distinct = 0
        if data.dtype.itemsize == 4 and data.size > 1024:
            words, inverse = np.unique(data.view(np.uint32), return_inverse=True)
            if len(words) <= min(1 << 16, data.size // 2):
                distinct = len(words)
                parts.append(_planes(words))
                data = inverse.reshape(-1).astype(_index_type(distinct))
        parts.append(_planes(data))
        index.append([name, array.dtype.str, array.shape, distinct])
    head = json.dumps(index, separators=(",", ":")).encode() + b"\n"
    return lzma.compress(head + b"".join(parts), format=lzma.FORMAT_XZ, filters=PLANES_FILTER)


def loads(data: bytes) -> dict[str, Array]:
    """The arrays that `dumps` packed, bit for bit."""
    raw = lzma.decompress(data)
    at = raw.index(b"\n") + 1
    arrays: dict[str, Array] = {}

    def take(dtype: str | np.dtype[Any], count: int) -> Array:
        nonlocal at
        dtype = np.dtype(dtype)
        planes = np.frombuffer(raw, np.uint8, count * dtype.itemsize, at).reshape(dtype.itemsize, count)
        at += planes.size
        return np.ascontiguousarray(planes.T).reshape(-1).view(dtype)

    for name, dtype, shape, distinct in json.loads(raw[: at - 1]):
        count = int(np.prod(shape))
        if distinct:
            words = take("<u4", distinct)
            values = words[take(_index_type(distinct), count)].view(dtype)
        else:
            values = take(dtype, count)
        arrays[name] = values.reshape(shape)
    return arrays


def _planes(data: Array) -> bytes:
    return np.ascontiguousarray(data.view(np.uint8).reshape(data.size, data.dtype.itemsize).T).tobytes()


def _index_type(distinct: int) -> np.dtype[Any]:
    return np.dtype("<u1" if distinct <= 256 else "<u2")


def digest(array: Array) -> str:
    """sha256 of an array's little-endian bytes, row-major; -0 counts as 0, as it does for `==`."""
    canonical = np.ascontiguousarray(array + array.dtype.type(0)).astype(array.dtype.newbyteorder("<"))
    return hashlib.sha256(canonical.tobytes()).hexdigest()


@dataclass(frozen=True)
class RasteriserCase:
    """One case of the reference rasteriser: `arrays` whole, `digests` of arrays too big to commit."""

    name: str
    arrays: dict[str, Array]
    digests: dict[str, str]


def rasteriser_names() -> tuple[str, ...]:
    return tuple(_rasteriser_index())


def rasteriser_case(name: str) -> RasteriserCase:
    """The committed form of a case."""
    arrays = loads((GOLDEN / "rasteriser" / f"{name}.planes.xz").read_bytes())
    return RasteriserCase(name, arrays, _rasteriser_index()[name]["digests"])


def _rasteriser_index() -> dict[str, Any]:
    cases: dict[str, Any] = json.loads((GOLDEN / "rasteriser" / "cases.json").read_text())
    return cases


@dataclass(frozen=True)
class BlendshapesGolden:
    """The Gaussian Blendshapes vectors, unpacked to a folder in the system's own files.

    `raw/` the training output, whole; `viewer/` the folders of the dump; `dataset/` tracked frames;
    `body/` body model, eyelids, anchor faces; `golden/` the numbers to compare with. In the committed form
    the viewer's face arrays and the golden `face_*` hold only `face_rows`, the frames' meshes only
    `vertex_rows`.
    """

    folder: Path
    face_rows: Array  # [N] rows of the 1500 that the dump keeps
    vertex_rows: Array  # [M] rows of the body model's vertices

    @property
    def raw(self) -> Path:
        return self.folder / "raw"

    @property
    def viewer(self) -> Path:
        return self.folder / "viewer"

    @property
    def body(self) -> Path:
        return self.folder / "body"

    def frame_file(self, index: int) -> Path:
        """The tracked frame as the tracker writes it."""
        return self.folder / "dataset" / "checkpoint" / f"{index:05d}.frame"

    def static(self) -> dict[str, Array]:
        """`raw_row_of_kept` (of all 1500), neutral joints, matrices and mesh; all rows."""
        return _read_npz(self.folder / "golden" / "static.npz")

    def frame(self, index: int) -> dict[str, Array]:
        """Inputs and every step of one frame; `face_*` at `face_rows`, meshes at `vertex_rows`."""
        return _read_npz(self.folder / "golden" / f"frame_{index:05d}.npz")

    def body_model(self) -> dict[str, Array]:
        return _read_npz(self.body / "body_model.npz")


def unpack_gaussian_blendshapes(target: Path) -> BlendshapesGolden:
    """The committed vectors, written to the empty folder `target`."""
    source = GOLDEN / "gaussian_blendshapes"
    with tarfile.open(source / "files.tar.xz") as archive:
        archive.extractall(target, filter="data")
    viewer = loads((source / "viewer.planes.xz").read_bytes())
    for name, array in viewer.items():
        path = target / "viewer" / name
        path.parent.mkdir(parents=True, exist_ok=True)
        np.save(path, array)
    np.savez(target / "body" / "body_model.npz", **loads((source / "body_model.planes.xz").read_bytes()))
    (target / "golden").mkdir()
    rows: dict[str, Array] = {}
    files: dict[str, dict[str, Array]] = {}
    for name, array in loads((source / "golden.planes.xz").read_bytes()).items():
        file, _, key = name.rpartition("/")
        (files.setdefault(file, {}) if file else rows)[key] = array
    for file, arrays in files.items():
        np.savez(target / "golden" / f"{file}.npz", **arrays)
    return BlendshapesGolden(target, rows["face_rows"], rows["vertex_rows"])


def _read_npz(path: Path) -> dict[str, Array]:
    with np.load(io.BytesIO(path.read_bytes()), allow_pickle=False) as file:
        return {key: file[key] for key in file.files}


@dataclass(frozen=True)
class SurfaceCase:
    """A checkpoint of SplattingAvatar or GaussianAvatars and where its code puts the Gaussians, in training units."""

    folder: Path  # run/, static.npz, expected/
    poses: Path | None  # head_poses/; None: posed vertices stand in expected/

    @property
    def run(self) -> Path:
        return self.folder / "run"

    def static(self) -> dict[str, Array]:
        return _read_npz(self.folder / "static.npz")

    def pose_names(self) -> list[str]:
        return sorted(path.stem for path in (self.folder / "expected").glob("*.npz"))

    def expected(self, pose: str) -> dict[str, Array]:
        return _read_npz(self.folder / "expected" / f"{pose}.npz")

    def posed_vertices(self, pose: str) -> Array:
        """[V, 3] as the case's mesh has them; heads of the part "face" are a part of the head's vertices."""
        if self.poses is None:
            return self.expected(pose)["posed_vertices"]
        vertices = _read_npz(self.poses / f"{pose}.npz")["vertices"]
        if "face" in self.folder.name:
            vertices = vertices[_read_npz(self.poses / "topology.npz")["face_part_vertices"]]
        return 4 * vertices if "_x4_" in self.folder.name else vertices

    def triangles(self) -> Array:
        if self.poses is None:
            return self.static()["faces"]
        name = "face_part_faces" if "face" in self.folder.name else "faces"
        return _read_npz(self.poses / "topology.npz")[name]


SMALL_SURFACE_CASES = (
    *("splatting_avatar/small_sh0", "splatting_avatar/small_sh3"),
    *("gaussian_avatars/small_sh0", "gaussian_avatars/small_sh3"),
)
HEAD_SURFACE_CASES = (
    *("splatting_avatar/head_m_sh0", "splatting_avatar/head_x4_face_sh3"),
    "gaussian_avatars/head_face_sh3",
)


def unpack_surface_cases(target: Path) -> None:
    """The committed cases, written to the empty folder `target`."""
    with tarfile.open(GOLDEN / "splatting_avatar" / "files.tar.xz") as archive:
        archive.extractall(target, filter="data")


def head_surface_case(name: str) -> SurfaceCase:
    """A case from the optional test data; skips the test where it is absent."""
    root = shared("golden/splatting_avatar")
    return SurfaceCase(root / name, root / "head_poses")
