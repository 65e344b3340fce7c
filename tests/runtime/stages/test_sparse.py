"""combine and gather against loops over dense matrices in float64."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from avatar_runtime.avatar import SparseRows
from avatar_runtime.checks.arrays import check_sparse
from avatar_runtime.stages.sparse import combine, gather
from tests.golden import Array

SHAPES = {"scalar": (), "mean": (3,), "sh": (4, 3)}


def random_rows(seed: int, rows: int, columns: int, density: float) -> SparseRows:
    rng = np.random.default_rng(seed)
    used = rng.uniform(size=(rows, columns)) < density
    entries = int(used.sum())
    values = {name: rng.normal(size=(entries, *shape)).astype(np.float32) for name, shape in SHAPES.items()}
    row_ptr = np.concatenate([[0], np.cumsum(used.sum(axis=1))]).astype(np.uint32)
    sparse = SparseRows(row_ptr, np.nonzero(used)[1].astype(np.uint16), values, columns)
    check_sparse(sparse, "random", rows, columns, SHAPES)
    return sparse


def dense_sum(sparse: SparseRows, name: str, table: Array) -> tuple[Array, Array]:
    """(sum over a row's entries of value * table[column], the same of absolute values)."""
    value = sparse.values[name].astype(np.float64)
    trailing = np.broadcast_shapes(value.shape[1:], table.shape[1:])
    total, size = np.zeros((2, sparse.rows, *trailing))
    for row in range(sparse.rows):
        for entry in range(int(sparse.row_ptr[row]), int(sparse.row_ptr[row + 1])):
            term = value[entry] * table[sparse.column[entry]].astype(np.float64)
            total[row] += term
            size[row] += np.abs(term)
    return total, size


def close(got: Array, want: tuple[Array, Array], entries: int) -> None:
    """Within what rounding of that many float32 sums and products can do."""
    total, size = want
    assert got.dtype == np.float32 and got.shape == total.shape
    assert (np.abs(got - total) <= (entries + 1) * 2**-24 * size).all()


sizes = st.tuples(
    st.integers(0, 1000), st.integers(1, 9), st.integers(1, 40), st.sampled_from([0.0, 0.1, 0.5, 1.0])
)


@given(sizes)
def test_combine_meets_dense_loops(size: tuple[int, int, int, float]) -> None:
    seed, rows, columns, density = size
    sparse = random_rows(seed, rows, columns, density)
    rng = np.random.default_rng(seed + 1)
    weights = (rng.normal(size=columns) * (rng.uniform(size=columns) < 0.6)).astype(np.float32)
    got = combine(sparse, weights)
    assert list(got) == list(SHAPES)
    for name, shape in SHAPES.items():
        table = weights.reshape(columns, *([1] * len(shape)))
        close(got[name], dense_sum(sparse, name, table), columns)


@given(sizes)
def test_gather_meets_dense_loops(size: tuple[int, int, int, float]) -> None:
    seed, rows, columns, density = size
    sparse = random_rows(seed, rows, columns, density)
    weighted = SparseRows(sparse.row_ptr, sparse.column, {"weight": sparse.values["scalar"]}, columns)
    table = np.random.default_rng(seed).normal(size=(columns, 3, 4)).astype(np.float32)
    value = {"weight": sparse.values["scalar"].reshape(-1, 1, 1)}
    want = dense_sum(SparseRows(sparse.row_ptr, sparse.column, value, columns), "weight", table)
    close(gather(weighted, table), want, columns)


@pytest.mark.parametrize(("rows", "columns"), [(4, 7), (4, 0), (0, 0)])
def test_an_empty_matrix_gives_zeros(rows: int, columns: int) -> None:
    sparse = SparseRows.empty(rows, columns, SHAPES)
    for name, value in combine(sparse, np.ones(columns, np.float32)).items():
        assert value.shape == (rows, *SHAPES[name]) and value.dtype == np.float32 and not value.any()
    skin = SparseRows.empty(rows, columns, {"weight": ()})
    assert gather(skin, np.zeros((columns, 3, 4), np.float32)).shape == (rows, 3, 4)


def test_zero_weights_are_not_read() -> None:
    """So a column of weight 0 has no effect, whatever its values."""
    sparse = SparseRows(
        np.array([0, 2], np.uint32),
        np.array([0, 1], np.uint16),
        {"mean": np.array([[np.nan] * 3, [1, 2, 3]], np.float32)},
        2,
    )
    np.testing.assert_array_equal(combine(sparse, np.array([0, 2], np.float32))["mean"], [[2, 4, 6]])
