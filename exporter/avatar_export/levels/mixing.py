"""Weighted means of the rows of sparse matrices and of the deltas in them."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from avatar_export.levels.clusters import summed
from avatar_runtime.avatar import F32, F64, I64, Blendshapes, SparseRows
from avatar_runtime.rotation import matrix_from_quat, quat_multiply

CONJUGATE = np.array([1.0, -1.0, -1.0, -1.0])


def mixed_rows(sparse: SparseRows, share: F64, into: I64, count: int) -> SparseRows:
    """[count] rows: row c is the sum of share[i] * row i over the i with into[i] = c; -1 drops a row."""
    row = entry_rows(sparse)
    kept = into[row] >= 0
    key = into[row[kept]] * max(sparse.columns, 1) + sparse.column[kept]
    unique, slot = np.unique(key, return_inverse=True)
    weight = share[row[kept]]
    values = {}
    for name, value in sparse.values.items():
        width = int(np.prod(value.shape[1:]))
        flat = value[kept].reshape(len(slot), width) * weight[:, None]
        total = summed(flat, slot, len(unique))
        values[name] = total.reshape(len(unique), *value.shape[1:]).astype(np.float32)
    ends = np.searchsorted(unique, np.arange(count + 1) * max(sparse.columns, 1))
    column = (unique % max(sparse.columns, 1)).astype(np.uint16)
    return SparseRows(ends.astype(np.uint32), column, values, sparse.columns)


def mixed_blendshapes(
    shapes: Blendshapes, share: F64, into: I64, old_quat: F32, new_quat: F64
) -> Blendshapes:
    """The blendshapes of merged Gaussians; `old_quat` [N, 4] and `new_quat` [count, 4] are those they add to.

    A delta of a quaternion is kept as the turn that it adds, and a delta of log scales as a stretch in space, because
    merged Gaussians have other axes than their parts.
    """
    count = len(new_quat)
    geometry = _with(shapes.geometry, "quat_wxyz", _turns(shapes.geometry, old_quat))
    appearance = _with(shapes.appearance, "log_scale", _stretches(shapes.appearance, old_quat))
    geometry, appearance = (mixed_rows(part, share, into, count) for part in (geometry, appearance))
    turned = quat_multiply(geometry.values["quat_wxyz"], new_quat[entry_rows(geometry)])
    axes = matrix_from_quat(new_quat)[entry_rows(appearance)]
    stretch = appearance.values["log_scale"].reshape(-1, 3, 3)
    along = np.einsum("eji,ejk,eki->ei", axes, stretch, axes)
    return Blendshapes(
        _with(geometry, "quat_wxyz", turned),
        _with(appearance, "log_scale", along),
        mixed_rows(shapes.correctives, share, into, count),
        mixed_rows(shapes.late_morphs, share, into, count),
    )


def entry_rows(sparse: SparseRows) -> I64:
    """[E] the row of every entry."""
    ptr = sparse.row_ptr.astype(np.int64)
    return np.repeat(np.arange(sparse.rows), ptr[1:] - ptr[:-1])


def _turns(geometry: SparseRows, quat: F32) -> npt.NDArray[np.float64]:
    """[E, 4] delta times the inverse of the quaternion that it adds to."""
    q = quat[entry_rows(geometry)].astype(np.float64)
    inverse = q * CONJUGATE / np.maximum(np.sum(q * q, axis=1, keepdims=True), 1e-24)
    result: F64 = quat_multiply(geometry.values["quat_wxyz"].astype(np.float64), inverse)
    return result


def _stretches(appearance: SparseRows, quat: F32) -> npt.NDArray[np.float64]:
    """[E, 9] R diag(delta) R^T, row-major."""
    axes = matrix_from_quat(unit(quat))[entry_rows(appearance)]
    delta = appearance.values["log_scale"]
    stretch: F64 = np.einsum("eij,ej,ekj->eik", axes, delta, axes).reshape(-1, 9)
    return stretch


def unit(quat: npt.NDArray[np.floating]) -> F64:
    """[..., 4] of length 1."""
    q = quat.astype(np.float64)
    result: F64 = q / np.maximum(np.linalg.norm(q, axis=-1, keepdims=True), 1e-12)
    return result


def _with(sparse: SparseRows, name: str, value: npt.NDArray[np.floating]) -> SparseRows:
    return SparseRows(
        sparse.row_ptr, sparse.column, {**sparse.values, name: value.astype(np.float32)}, sparse.columns
    )
