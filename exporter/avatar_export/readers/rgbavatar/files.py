"""The files of an RGBAvatar run: model.ply with its bases and its network, config.yaml, and the mesh's UVs.

Facts of LinzhouLi/RGBAvatar 27c2ba8 (model/gaussian.py, model/binding.py): bases stand basis by basis, xyz_b_{3 b + i},
rot_b_{4 b + i}, f_dc_b_{3 b + i}; `weight_module` is the network's parameters layer by layer, weight [out, in] before
bias, followed by zeros; face_id and face_bary_0..2 say which triangle carries a Gaussian.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from avatar_export.formats.archive import Archive
from avatar_export.formats.casts import as_float32, as_float64
from avatar_export.formats.npy import parse_npy
from avatar_export.formats.point_cloud import PointCloud, first_file, has_property, read_ply
from avatar_runtime.avatar import F32, F64, Gaussians
from avatar_runtime.codec import ply
from avatar_runtime.io.errors import AvatarError
from avatar_runtime.io.whole_files import read_bytes

NAME, CONFIG = "model.ply", "config.yaml"
MODULE, FACE, BARYCENTRIC = "weight_module", "face_id", ("face_bary_0", "face_bary_1", "face_bary_2")
MARKS = (MODULE, "xyz_b_0")  # properties that no other system's .ply has
UVS, UV_FACES, EYELIDS = "uvs", "uv_faces", ("l_eyelid", "r_eyelid")
HIDDEN = 128  # units of each of the two hidden layers
INPUTS = 129  # num_basis_in of the released configurations
MAX_CONFIG_BYTES = 1 << 16
MAX_ARRAY_BYTES = 1 << 28
LARGEST = 1e12  # number in an array of the body model's file
PAGE = "docs/researcher/rgbavatar.md"

Layer = tuple[F64, F64]  # weight [out, in], bias [out]


@dataclass(frozen=True)
class Network:
    """From driving values to the weights of the bases: linear layers with ReLU between them."""

    layers: tuple[Layer, ...]

    @property
    def linear(self) -> bool:
        """Whether it is one linear layer (use_mlp_proj: False)."""
        return len(self.layers) == 1

    @property
    def inputs(self) -> int:
        """How many driving values it takes."""
        return int(self.layers[0][0].shape[1])

    def weights(self, values: F64) -> F64:
        """The weights of the bases [..., K] of driving values [..., inputs]."""
        for index, (weight, bias) in enumerate(self.layers):
            values = values @ weight.T + bias
            if index < len(self.layers) - 1:
                values = np.maximum(values, 0)
        return values


@dataclass(frozen=True)
class Model:
    """The Gaussians of N rows, local to the frames of their triangles, with K bases."""

    gaussians: Gaussians
    mean_basis: F32  # [N, K, 3]
    quat_basis: F32  # [N, K, 4]
    dc_basis: F32  # [N, K, 3]
    triangle: F64  # [N] as stored
    barycentric: F32  # [N, 3]
    network: Network


def located(path: Path) -> PointCloud | None:
    """The model.ply of a run folder, or a .ply of this system; None for anything else. Never raises."""
    file = path / NAME if path.is_dir() else path
    if file.suffix.lower() != ".ply" or not file.is_file():
        return None
    cloud = PointCloud(file, (file.parent,))
    return cloud if all(has_property(cloud, mark) for mark in MARKS) else None


def config_file(cloud: PointCloud) -> Path | None:
    """The run's config.yaml, if there is one."""
    return first_file([cloud.file.parent / CONFIG])


def read_model(cloud: PointCloud) -> Model:
    """The Gaussians, bases and network. Raises AvatarError for missing properties and unsound numbers."""
    rows = read_ply(cloud)
    file = cloud.file
    if FACE not in rows.properties or any(name not in rows.properties for name in BARYCENTRIC):
        raise AvatarError(
            f"is missing; it says which triangle carries a Gaussian: write the file anew with save_ply of the "
            f"release ({PAGE})",
            file=file,
            field=f"property {FACE}",
        )
    gaussians = ply.gaussians(rows, file)
    count = sum(name.startswith("xyz_b_") for name in rows.properties)
    if count % 3 or not count:
        raise AvatarError(f"has {count} properties, expected 3 for each basis", file=file, field="xyz_b_*")
    bases = count // 3
    mean, quat, dc = (
        _columns(rows, [f"{name}_{k}" for k in range(bases * width)], file).reshape(-1, bases, width)
        for name, width in (("xyz_b", 3), ("rot_b", 4), ("f_dc_b", 3))
    )
    return Model(
        Gaussians(
            gaussians.mean,
            gaussians.log_scale,
            gaussians.quat_wxyz,
            gaussians.opacity_logit,
            np.ascontiguousarray(gaussians.sh[:, :1]),
        ),
        mean,
        quat,
        dc,
        as_float64(rows.properties[FACE]),
        _columns(rows, BARYCENTRIC, file),
        _network(_columns(rows, [MODULE], file)[:, 0], bases, config_file(cloud), file),
    )


def read_uv_corners(path: Path, triangles: int) -> F64:
    """[F, 3, 2] the texture coordinates of the triangles' corners, of the .npz of the body model.

    Raises AvatarError if it has none, or others than its triangles need.
    """
    uvs = _array(path, UVS, 2)
    faces = _array(path, UV_FACES, 3)
    if uvs is None or faces is None:
        raise AvatarError(
            f"is missing; the frames of the triangles need the mesh's texture coordinates: write {UVS} and {UV_FACES} "
            f"into the file, as {PAGE} shows",
            file=path,
            field=UVS if uvs is None else UV_FACES,
        )
    if len(faces) != triangles or not ((faces >= 0) & (faces < len(uvs)) & (faces == np.floor(faces))).all():
        raise AvatarError(
            f"has {len(faces)} rows of indices into {len(uvs)} {UVS}, but the mesh has {triangles} triangles, each of "
            "which needs one row",
            file=path,
            field=UV_FACES,
        )
    corners: F64 = uvs[faces.astype(np.int64)]
    return corners


def read_eyelid_shapes(path: Path, vertices: int) -> list[F32]:
    """[V, 3] offsets of the left and the right eyelid of the .npz of the body model; [] if it has none.

    Raises AvatarError for other shapes.
    """
    shapes = [_array(path, name, 3) for name in EYELIDS]
    found = [as_float32(shape) for shape in shapes if shape is not None]
    if found and [len(shape) for shape in found] != [vertices, vertices]:
        raise AvatarError(f"are not two arrays [{vertices}, 3]", file=path, field=" and ".join(EYELIDS))
    return found


def read_eyelid_weights(path: Path, frames: int) -> F64:
    """[T, 2] `eyelids` of a flame_param.npz, which the released code's tracking has; zeros without it."""
    found = _array(path, "eyelids", 2) if path.suffix.lower() == ".npz" else None
    if found is None:
        return np.zeros((frames, 2))
    if len(found) != frames:
        raise AvatarError(f"has {len(found)} frames, other arrays have {frames}", file=path, field="eyelids")
    return found


def _columns(rows: ply.Ply, names: Sequence[str], file: Path) -> F32:
    missing = [name for name in names if name not in rows.properties]
    if missing:
        raise AvatarError("is missing", file=file, field=f"property {missing[0]}")
    values = np.stack([rows.properties[name] for name in names], axis=1).astype(np.float32)
    if not np.isfinite(values).all():
        row, column = (int(at[0]) for at in np.nonzero(~np.isfinite(values)))
        raise AvatarError("is not finite", file=file, field=f"{names[column]}[{row}]")
    return values


def _network(column: F32, bases: int, config: Path | None, file: Path) -> Network:
    """The network of `weight_module` [N]. Without config.yaml its size says which of the two it is."""
    text = "" if config is None else read_bytes(config, MAX_CONFIG_BYTES).decode("utf-8", "replace")
    inputs = _setting(text, "num_basis_in", r"[0-9]{1,4}")
    for name in ("use_blend", "use_weight_proj"):
        if _setting(text, name, r"\w+").lower() == "false":
            raise AvatarError(
                "is False; only runs whose bases are weighted by the network are read",
                file=config,
                field=name,
            )
    template = _setting(text, "template_type", r"\w+")
    if template not in ("", "Flame"):
        raise AvatarError(f"is {template!a}; only FLAME is read", file=config, field="template_type")
    width = int(inputs or INPUTS)
    linear, deep = ((width, bases),), ((width, HIDDEN), (HIDDEN, HIDDEN), (HIDDEN, bases))
    used = int(np.flatnonzero(column)[-1]) + 1 if column.any() else 0
    said = _setting(text, "use_mlp_proj", r"\w+").lower()
    shapes = linear if said == "false" or (not said and used <= _size(linear)) else deep
    if not _size(shapes) >= used or _size(shapes) > len(column):
        raise AvatarError(
            f"holds {used} numbers of {len(column)}, but {width} inputs and {bases} bases need {_size(shapes)}"
            + (f" with use_mlp_proj {said}" if said else ""),
            file=file,
            field=MODULE,
        )
    layers, at = [], 0
    for size_in, size_out in shapes:
        weight = column[at : at + size_in * size_out].astype(np.float64).reshape(size_out, size_in)
        at += size_in * size_out
        layers.append((weight, column[at : at + size_out].astype(np.float64)))
        at += size_out
    return Network(tuple(layers))


def _size(shapes: Sequence[tuple[int, int]]) -> int:
    return sum((size_in + 1) * size_out for size_in, size_out in shapes)


def _setting(text: str, name: str, pattern: str) -> str:
    """The value of a line `name: value`, "" without one. The file is searched, not evaluated."""
    found = re.search(rf"^[ \t]*{name}[ \t]*:[ \t]*({pattern})[ \t]*(?:#.*)?$", text, re.MULTILINE)
    return found[1] if found else ""


def _array(path: Path, name: str, width: int) -> F64 | None:
    """Finite numbers [rows, width] of an .npz; None if it has no such array. A leading axis of 1 is dropped."""
    with Archive(path) as archive:
        if f"{name}.npy" not in archive.names:
            return None
        source = parse_npy(archive.read(f"{name}.npy", MAX_ARRAY_BYTES), path, name)
    shape = source.shape[1:] if len(source.shape) == 3 and source.shape[0] == 1 else source.shape
    if len(shape) != 2 or shape[1] != width or source.dtype.kind not in "fiu":
        raise AvatarError(
            f"is {source.dtype}{list(source.shape)}, expected numbers [any, {width}]", file=path, field=name
        )
    values: F64 = as_float64(source.read().reshape(shape))
    if not (np.abs(values) <= LARGEST).all():  # False for NaN
        raise AvatarError(f"holds NaN, an infinity or a number above {LARGEST:g}", file=path, field=name)
    return values
