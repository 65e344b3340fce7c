"""The first state of Gaussian Blendshapes (paper section 3.2, Initialization)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import torch
from torch import Tensor

from avatar_runtime import F64, I64, Rig, SparseRows
from avatar_trainer.systems.common.poisson import Samples, neighbour_distance, poisson_disk
from avatar_trainer.systems.gaussian_blendshapes.mesh import (
    Expressions,
    mask_of,
    quaternion_shift,
    triangle_motion,
)
from avatar_trainer.systems.gaussian_blendshapes.mouth import Cylinder, find_mouth, mouth_interior
from avatar_trainer.systems.gaussian_blendshapes.rows import FACE, LOWER, UPPER, Entries, Rows
from avatar_trainer.tensors import Gaussians

OPACITY = 0.1  # at the start, as 3DGS
SMALLEST_SCALE = 1e-7  # metres


@dataclass(frozen=True)
class Start:
    """The first Gaussians."""

    gaussians: Gaussians  # grey, isotropic, opacity 0.1, identity rotation
    rows: Rows
    triangle: Tensor  # i64[P] of the body mesh, of the face's Gaussians
    barycentric: Tensor  # [P, 3]
    cylinder: Cylinder | None  # that keeps the mouth's; None without a mouth


def start(
    rig: Rig,
    expressions: int,
    face: int,
    mouth: int,
    rules: Mapping[str, str],
    generator: np.random.Generator,
    *,
    sh_degree: int,
    least_mask: float,
    neck: I64,
    density: F64,
    cylinder: Cylinder | None = None,
) -> Start:
    """`face` Gaussians on the neutral mesh and `mouth` in each set of teeth (0: none); the first K = `expressions`
    shapes.

    Nothing is learned where the mask is at most `least_mask`. `neck` [.]: vertices whose motion no mask counts.
    `density` [F]: the density of the first Gaussians on each triangle, in few values. `cylinder`: as `find_mouth`
    takes it.
    """
    found = find_mouth(rig, cylinder) if mouth else None
    skin = ~mouth_interior(rig)
    samples = _face(rig, skin, face, density, generator)
    teeth = () if found is None else found.samples(mouth, generator)
    position = np.concatenate([s.position for s in (samples, *teeth)])
    counts = [face, *([mouth] * len(teeth))]
    return Start(
        gaussians=_grey(position, sh_degree),
        rows=_rows(rig, Expressions.of(rig, expressions), samples, counts, rules, neck, least_mask),
        triangle=torch.from_numpy(samples.triangle),
        barycentric=_tensor(samples.barycentric),
        cylinder=None if found is None else found.cylinder,
    )


def _face(
    rig: Rig, skin: npt.NDArray[np.bool_], count: int, density: F64, generator: np.random.Generator
) -> Samples:
    """`count` points on the triangles of the skin, a Poisson-disk set for each density."""
    vertices, triangles = rig.vertices.astype(np.float64), rig.triangles.astype(np.int64)
    corner = vertices[triangles]
    area = np.linalg.norm(np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]), axis=1) / 2
    sets = [np.flatnonzero(skin & (density == value)) for value in np.unique(density[skin])]
    share = np.cumsum([(area * density)[chosen].sum() for chosen in sets])
    counts = np.diff(np.round(share / share[-1] * count).astype(int), prepend=0)
    return Samples.joined(
        [
            poisson_disk(vertices, triangles, chosen, int(some), generator)
            for chosen, some in zip(sets, counts, strict=True)
            if some
        ]
    )


def _grey(position: F64, sh_degree: int) -> Gaussians:
    """Properties other than the position, as 3DGS begins (Kerbl et al. 2023)."""
    n = len(position)
    scale = np.maximum(neighbour_distance(position), SMALLEST_SCALE)
    return Gaussians(
        mean=_tensor(position),
        log_scale=_tensor(np.repeat(np.log(scale)[:, None], 3, axis=1)),
        quat_wxyz=torch.tensor([1.0, 0, 0, 0]).repeat(n, 1),
        opacity_logit=torch.full((n,), float(np.log(OPACITY / (1 - OPACITY)))),
        sh=torch.zeros(n, (sh_degree + 1) ** 2, 3),
    )


def _rows(
    rig: Rig,
    expressions: Expressions,
    samples: Samples,
    counts: list[int],
    rules: Mapping[str, str],
    neck: I64,
    least_mask: float,
) -> Rows:
    triangles = expressions.triangles
    others = sum(counts[1:])
    weights = samples.interpolate(dense(rig.skin, "weight"), triangles)
    # The released code sums over the corners instead of averaging (transforms.py:164); eyelids use the mean.
    corrective = 3 * samples.mean_of_corners(dense(rig.correctives, "position"), triangles)
    late = samples.mean_of_corners(dense(rig.late_morphs, "position"), triangles)
    init, learned = _entries(rig, expressions, samples, rules, neck, least_mask)
    return Rows(
        group=torch.repeat_interleave(
            torch.tensor([FACE, UPPER, LOWER][: len(counts)]), torch.tensor(counts)
        ),
        skin_weights=_tensor(_padded(weights / weights.sum(axis=1, keepdims=True), others)),
        corrective=_fields(corrective, others),
        late=_fields(late, others),
        init=init.pattern(sum(counts)),
        init_values=_tensor(init.values()),
        learned=learned.pattern(sum(counts)),
        mask=_tensor(learned.values()[:, 0]),
    )


class _Collected:
    """Collects entries column by column, and sorts them by row at the end."""

    def __init__(self, width: int) -> None:
        self._row, self._column, self._values = (
            [np.zeros(0, np.int64)],
            [np.zeros(0, np.int64)],
            [np.zeros((0, width))],
        )

    def add(self, row: I64, column: int, values: F64) -> None:
        """Entries of one column: rising `row` [M], `values` [M, width]."""
        self._row.append(row)
        self._column.append(np.full(len(row), column))
        self._values.append(values)

    def pattern(self, rows: int) -> Entries:
        """The pattern of the entries."""
        ends = np.bincount(np.concatenate(self._row), minlength=rows).cumsum()
        column = np.concatenate(self._column)[self._order()]
        return Entries(torch.from_numpy(np.concatenate([[0], ends])), torch.from_numpy(column))

    def values(self) -> F64:
        """[E, width] in the pattern's order."""
        result: F64 = np.concatenate(self._values)[self._order()]
        return result

    def _order(self) -> I64:
        return np.argsort(np.concatenate(self._row), kind="stable")


def _entries(
    rig: Rig,
    expressions: Expressions,
    samples: Samples,
    rules: Mapping[str, str],
    neck: I64,
    least_mask: float,
) -> tuple[_Collected, _Collected]:
    """(init terms: position and quaternion, where the triangle moves; masks, where something is learned).

    Something is learned where the mask is above `least_mask`; for every face Gaussian and expression where it is
    learned without the mask (rule consistency).
    """
    anchors = np.unique(rig.anchor_vertices.astype(np.int64))
    everywhere = rules["consistency"] != "all"
    init, learned = _Collected(7), _Collected(1)
    for column in range(expressions.count):
        mask = mask_of(expressions.displacement(column, anchors, neck), rules["mask"])[samples.triangle]
        row = np.flatnonzero((mask > least_mask) | everywhere)
        learned.add(row, column, mask[row, None])
        row = np.flatnonzero(expressions.moves(column)[samples.triangle])
        corners = expressions.triangles[samples.triangle[row]]
        before = expressions.vertices[corners]
        after = before + expressions.offsets[column][corners]
        shift, turn = triangle_motion(before, after, samples.position[row], rules["init_position"])
        init.add(row, column, np.concatenate([shift, quaternion_shift(turn)], axis=1))
    return init, learned


def dense(sparse: SparseRows, attribute: str) -> npt.NDArray[np.float32]:
    """[R, columns, ...] of a `SparseRows`."""
    values = sparse.values[attribute]
    out = np.zeros((sparse.rows, sparse.columns, *values.shape[1:]), np.float32)
    row = np.repeat(np.arange(sparse.rows), np.diff(sparse.row_ptr.astype(np.int64)).astype(np.int64))
    out[row, sparse.column] = values
    return out


def _fields(values: F64, rows: int) -> Tensor:
    """[N, F, 3] of the face as [F, N, 3], zeros for `rows` more Gaussians; [0, N, 3] where all is 0."""
    if not values.any():
        return torch.zeros(0, len(values) + rows, 3)
    return _tensor(_padded(values, rows).transpose(1, 0, 2))


def _padded(values: F64, rows: int) -> F64:
    return np.concatenate([values, np.zeros((rows, *values.shape[1:]))])


def _tensor(values: npt.NDArray[np.floating]) -> Tensor:
    return torch.from_numpy(np.ascontiguousarray(values, np.float32))
