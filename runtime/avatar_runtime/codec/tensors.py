"""The tensors of blendshapes.safetensors and rig.safetensors, both directions.

A `SparseRows` called S is stored as S.row_ptr, S.column and one S.ATTRIBUTE each.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from avatar_runtime.avatar import Avatar, Blendshapes, Rig, SparseRows
from avatar_runtime.io.errors import AvatarError

Tensors = dict[str, npt.NDArray[Any]]

GAUSSIAN_SPARSE = {
    "geometry": ("mean", "quat_wxyz"),
    "appearance": ("log_scale", "opacity_logit", "sh"),
    "correctives": ("mean",),
    "late_morphs": ("mean",),
    "skin": ("weight",),
}
RIG_SPARSE = {
    "morphs": ("position",),
    "correctives": ("position",),
    "late_morphs": ("position",),
    "skin": ("weight",),
}
RIG_DENSE = {  # name -> type, number of axes
    "vertices": (np.float32, 2),
    "triangles": (np.uint32, 2),
    "parents": (np.int32, 1),
    "rest_local": (np.float32, 3),
    "inverse_bind_matrix": (np.float32, 3),
    "joint_basis": (np.float32, 3),
    "corrective_joints": (np.int32, 1),
    "anchor_vertices": (np.uint32, 1),
}


def gaussian_tensors(avatar: Avatar) -> Tensors:
    """What blendshapes.safetensors holds."""
    parts = {
        name: avatar.skin if name == "skin" else getattr(avatar.blendshapes, name) for name in GAUSSIAN_SPARSE
    }
    return _sparse_tensors(parts)


def rig_tensors(rig: Rig) -> Tensors:
    """What rig.safetensors holds; joint names stand in the manifest."""
    tensors = _sparse_tensors({name: getattr(rig, name) for name in RIG_SPARSE})
    return tensors | {name: getattr(rig, name) for name in RIG_DENSE}


def read_gaussian_tensors(
    tensors: Tensors, expressions: int, features: int, late: int, joints: int, file: str
) -> tuple[Blendshapes, SparseRows]:
    """Inverse of `gaussian_tensors`. Raises AvatarError for a missing tensor; `check_avatar` checks the shapes."""
    columns = {
        "geometry": expressions,
        "appearance": expressions,
        "correctives": features,
        "late_morphs": late,
    }
    parts = _read_sparse(tensors, GAUSSIAN_SPARSE, columns | {"skin": joints}, file)
    return Blendshapes(**{k: v for k, v in parts.items() if k != "skin"}), parts["skin"]


def read_rig_tensors(
    tensors: Tensors, joint_names: tuple[str, ...], expressions: int, late: int, file: str
) -> Rig:
    """Inverse of `rig_tensors`. Raises AvatarError for a missing or mistyped tensor."""
    dense: dict[str, Any] = {}
    for name, (dtype, axes) in RIG_DENSE.items():
        dense[name] = array = tensor(tensors, name, file)
        if array.dtype != dtype or array.ndim != axes:
            got = f"{array.dtype} of {array.ndim} axes"
            raise AvatarError(f"is {got}, expected {np.dtype(dtype)} of {axes}", file=file, field=name)
    columns = {
        "morphs": expressions,
        "correctives": 9 * dense["corrective_joints"].size,
        "late_morphs": late,
        "skin": len(joint_names),
    }
    parts: dict[str, Any] = dict(_read_sparse(tensors, RIG_SPARSE, columns, file))
    return Rig(joint_names=joint_names, **dense, **parts)


def _sparse_tensors(parts: Mapping[str, SparseRows]) -> Tensors:
    tensors: Tensors = {}
    for name, sparse in parts.items():
        tensors[f"{name}.row_ptr"] = sparse.row_ptr
        tensors[f"{name}.column"] = sparse.column
        tensors |= {f"{name}.{attribute}": value for attribute, value in sparse.values.items()}
    return tensors


def _read_sparse(
    tensors: Tensors, layout: Mapping[str, tuple[str, ...]], columns: Mapping[str, int], file: str
) -> dict[str, SparseRows]:
    return {
        name: SparseRows(
            tensor(tensors, f"{name}.row_ptr", file),
            tensor(tensors, f"{name}.column", file),
            {attribute: tensor(tensors, f"{name}.{attribute}", file) for attribute in attributes},
            columns[name],
        )
        for name, attributes in layout.items()
    }


def tensor(tensors: Tensors, name: str, file: str) -> npt.NDArray[Any]:
    """tensors[name]. Raises AvatarError if it is missing."""
    if name not in tensors:
        raise AvatarError("tensor is missing", file=file, field=name)
    return tensors[name]
