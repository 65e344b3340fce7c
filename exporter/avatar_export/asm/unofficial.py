"""Models of the unofficial ASM code (LiuLinyun/ASM-unofficial 734ca75, MIT): the files from which its training starts.

    rig_info.json                 bones of a Blender rig and the transform of its mesh
    mu_face.obj                   the mesh, with texture coordinates; 1 unit is 1 cm
    inited_gmm_params_KN.pkl      pi [J, K], mu [J, K, 2], scale_tril [J, K, 3] as its optimiser holds them

It differs from the paper: the only parent of all bones is a root that is never posed, so here they are all roots. A
bone is at its head, and the position of its *tail* on the mesh moves it. Weights are softplus(W) / sum softplus(W).
Its start is not at rest: each bone is off by the distance from its tail to the nearest vertex. The neutral here is at
rest.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np

from avatar_export.asm.check import MOST_BONES, check_face
from avatar_export.asm.model import AsmFace, Binding, Take, Template
from avatar_export.formats.casts import as_float64
from avatar_export.formats.json_text import parse_json
from avatar_export.formats.npy import RowSource
from avatar_export.formats.obj import LARGEST_INDEX, MAX_BYTES, TriangleMesh, read_obj
from avatar_export.formats.pickle.arrays import arrays_of, read_pickle
from avatar_runtime.avatar import F64, I64
from avatar_runtime.io.errors import AvatarError
from avatar_runtime.io.ownership import of_file
from avatar_runtime.io.whole_files import opened, read_bytes

RIG, MESH, PARAMETERS = "rig_info.json", "mu_face.obj", re.compile(r"inited_gmm_params_K([0-9]{1,2})\.pkl")
DATA = "data"  # the folder of the repository that holds them
ROOT_BONE = "face"  # has no weight and no pose
UNITS = 100.0  # of the mesh, per metre
MAX_JSON_BYTES = 16 << 20
FPS = 30.0  # of the neutral, which is one frame


def detect(folder: Path) -> bool:
    """Whether a folder, or its data/, holds the three files; never raises."""
    try:
        _files(folder)
    except (AvatarError, OSError):
        return False
    return True


def files_of(folder: Path) -> dict[str, Path]:
    """The files that `read_folder` reads, by name."""
    return {path.name: path for path in _files(folder)}


def read_folder(folder: Path, units: float | None = None) -> AsmFace:
    """The model with the fewest Gaussians per bone (the paper's default is 2), at rest, in metres.

    `units` of the mesh per metre. Raises AvatarError for a file that is missing, unsound or inconsistent with the
    others; nothing of the pickle is run.
    """
    rig_file, mesh_file, parameter_file = _files(folder)
    bones = _read_bones(rig_file)
    mesh = read_obj(mesh_file)
    uv, kept = _vertex_uv(mesh_file, mesh)
    template = _template(bones, mesh, uv, kept, UNITS if units is None else units)
    binding = _read_binding(parameter_file, template)
    shape = (1, len(template.bone_names), 3)
    neutral = Take("neutral", FPS, np.zeros(shape), np.zeros(shape), np.ones(shape))
    with of_file(folder):
        return check_face(AsmFace("ASM unofficial", template, binding, (neutral,)))


def _files(folder: Path) -> tuple[Path, Path, Path]:
    for place in (folder, folder / DATA):
        if (place / RIG).is_file() and (place / MESH).is_file():
            sized = [(int(m[1]), p) for p in place.iterdir() if (m := PARAMETERS.fullmatch(p.name))]
            if sized:
                return place / RIG, place / MESH, min(sized)[1]
    raise AvatarError(f"has no {RIG}, {MESH} and inited_gmm_params_KN.pkl", file=folder)


class _Bones:
    """Names, bind matrices [J, 4, 4] and tails [J, 3] of the rig, in units and axes of the mesh."""

    def __init__(self, path: Path, document: Any) -> None:
        self.path = path
        face, rig = self._table(document, "mu_face"), self._table(document, "metarig")
        bones = {k: b for k, b in self._table(rig, "bones").items() if k != ROOT_BONE}
        if not 0 < len(bones) <= MOST_BONES:
            raise AvatarError(
                f"has {len(bones)} bones; 1 to {MOST_BONES} are supported", file=path, field="bones"
            )
        world = self._numbers(face, "mu_face", "matrix_world", (4, 4))
        if not abs(np.linalg.det(world)) > 1e-12:
            raise AvatarError("has no inverse", file=path, field="mu_face.matrix_world")
        to_mesh = np.linalg.solve(world, self._numbers(rig, "metarig", "matrix_world", (4, 4)))
        self.names = tuple(bones)
        self.bind = to_mesh @ np.stack([self._numbers(b, k, "matrix", (4, 4)) for k, b in bones.items()])
        tails = np.stack([self._numbers(b, k, "tail", (3,)) for k, b in bones.items()])
        self.tail: F64 = tails @ to_mesh[:3, :3].T + to_mesh[:3, 3]

    def _table(self, value: Any, key: str) -> dict[str, Any]:
        found = value.get(key) if isinstance(value, dict) else None
        if not isinstance(found, dict):
            raise AvatarError("is missing or not an object", file=self.path, field=key)
        return found

    def _numbers(self, value: Any, bone: str, key: str, shape: tuple[int, ...]) -> F64:
        field = f"{bone[:40]}.{key}"
        try:
            array = np.array(value[key], np.float64)
        except (KeyError, TypeError, ValueError, OverflowError):
            raise AvatarError("is missing or not an array of numbers", file=self.path, field=field) from None
        if array.shape != shape or not np.isfinite(array).all() or np.abs(array).max() > 1e12:
            raise AvatarError(f"expected {list(shape)} finite numbers", file=self.path, field=field)
        return array


def _read_bones(path: Path) -> _Bones:
    document = parse_json(read_bytes(path, MAX_JSON_BYTES), path)
    return _Bones(path, document)


def _template(bones: _Bones, mesh: TriangleMesh, uv: F64, order: I64, units: float) -> Template:
    """psi^0 is the bone's head after its tail was moved to the nearest vertex, as the code does."""
    vertices = mesh.vertices.astype(np.float64)
    nearest = np.array([np.argmin(((vertices - tail) ** 2).sum(axis=1)) for tail in bones.tail], np.uint32)
    position = bones.bind[:, :3, 3] + vertices[nearest] - bones.tail
    return Template(
        vertices=(vertices / units).astype(np.float32),
        triangles=mesh.triangles[order],
        uv=uv.astype(np.float32),
        bone_names=bones.names,
        parents=np.full(len(bones.names), -1, np.int32),
        rest_position=(position / units).astype(np.float32),
        rest_linear=(bones.bind[:, :3, :3] / units).astype(np.float32),
        anchor_vertex=nearest,
        weight_rule="softplus",
    )


def _read_binding(path: Path, template: Template) -> Binding:
    arrays = arrays_of(read_pickle(path), path)
    bones = len(template.bone_names)
    pi = _parameters(arrays, "pi", path)
    if pi.ndim != 2 or len(pi) != bones or not 0 < pi.shape[1] <= 64:
        raise AvatarError(
            f"expected [{bones}, K], one row per bone of {RIG}, got {list(pi.shape)}", file=path, field="pi"
        )
    mu, tril = _parameters(arrays, "mu", path), _parameters(arrays, "scale_tril", path)
    for name, array, last in (("mu", mu, 2), ("scale_tril", tril, 3)):
        if array.shape != (*pi.shape, last):
            raise AvatarError(f"expected {[*pi.shape, last]}, got {list(array.shape)}", file=path, field=name)
    soft = np.logaddexp(0.0, pi)
    total = soft.sum(axis=1, keepdims=True)
    if not (total > 0).all():
        bone = template.bone_names[int(np.argmin(total))]
        raise AvatarError(f"gives no weight to bone {bone[:40]}", file=path, field="pi")
    first, second = np.logaddexp(0.0, tril[..., 0]), np.logaddexp(0.0, tril[..., 1])
    below = tril[..., 2]  # L = [[first, 0], [below, second]]
    covariance = np.stack([first * first, first * below, below * below + second * second], axis=-1)
    zeta = template.uv.astype(np.float64)[template.anchor_vertex]
    return Binding(zeta, soft / total, mu, covariance)


def _parameters(arrays: dict[str, RowSource], name: str, path: Path) -> F64:
    if name not in arrays or arrays[name].dtype.kind != "f":
        raise AvatarError("is missing or does not hold floats", file=path, field=name)
    if max(arrays[name].shape, default=0) > MOST_BONES or len(arrays[name].shape) > 3:
        raise AvatarError(f"has shape {list(arrays[name].shape)}", file=path, field=name)
    values: F64 = as_float64(arrays[name].read())
    if not (np.abs(values) < 1e12).all():  # False for NaN
        raise AvatarError("holds NaN, an infinity or a number above 1e12", file=path, field=name)
    return values


def _vertex_uv(path: Path, mesh: TriangleMesh) -> tuple[F64, I64]:
    """(uv of each vertex [V, 2], the triangles, reordered).

    A vertex on a seam has several uv; the code takes that of its first corner in the file. Triangles with a corner of
    another uv then lie across the chart and must not be found before the triangles under them: they come last.
    """
    with opened(path, MAX_BYTES) as file:
        places, corner = _corner_uv(file, path, len(mesh.triangles))
    vertex = mesh.triangles.reshape(-1).astype(np.int64)
    used, first = np.unique(vertex, return_index=True)
    uv = np.zeros((len(mesh.vertices), 2))
    uv[used] = places[corner[first]]
    across = (uv[vertex] != places[corner]).any(axis=1).reshape(-1, 3).any(axis=1)
    return uv, np.argsort(across, kind="stable")


def _index(word: bytes) -> int:
    """An index of an .obj as a row. Raises ValueError for an invalid one."""
    index = int(word)
    if abs(index) >= LARGEST_INDEX:
        raise ValueError(word)
    return index


def _corner_uv(lines: Iterable[bytes], path: Path, triangles: int) -> tuple[F64, I64]:
    """(texture coordinates [T, 2], row of each corner [3 F]) of an .obj whose faces are known to be triangles."""
    places: list[tuple[float, float]] = []
    corner: list[int] = []
    for number, line in enumerate(lines, 1):
        words = line.partition(b"#")[0].split(None, 4)
        try:
            if words and words[0] == b"vt":
                places.append((float(words[1]), float(words[2])))
            elif words and words[0] == b"f":
                found = [_index(word.split(b"/")[1]) for word in words[1:]]
                corner.extend(row - 1 if row > 0 else len(places) + row for row in found)
        except (ValueError, IndexError):
            raise AvatarError(
                "has no texture coordinate: 'vt u v' and faces 'v/vt' are needed",
                file=path,
                field=f"line {number}",
            ) from None
    rows, uv = np.array(corner, np.int64), np.array(places, np.float64).reshape(-1, 2)
    if len(rows) != 3 * triangles or ((rows < 0) | (rows >= len(uv))).any() or not np.isfinite(uv).all():
        raise AvatarError("has corners without a valid texture coordinate", file=path)
    return uv, rows
