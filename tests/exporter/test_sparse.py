"""Dense to sparse rows: what is kept, and that a stream of blocks gives the same as all at once."""

from __future__ import annotations

import numpy as np
import pytest

from avatar_export.sparse import SparseRowsBuilder, exceeds, sparse_rows
from avatar_runtime.checks.arrays import check_sparse


def values(rows: int = 9, columns: int = 5) -> dict[str, np.ndarray]:
    rng = np.random.default_rng(2)
    mean = rng.normal(size=(rows, columns, 3)).astype("f4") * 1e-3
    quat = rng.normal(size=(rows, columns, 4)).astype("f4") * 1e-3
    drop = rng.random((2, rows, columns)) < 0.6
    mean[drop[0]] = 0
    quat[drop[1]] = 0
    mean[4], quat[4] = 0, 0
    return {"mean": mean, "quat_wxyz": quat}


THRESHOLDS = {"mean": 1e-3, "quat_wxyz": 2e-3}


def test_an_entry_is_kept_if_any_value_of_any_attribute_is_above_its_threshold() -> None:
    dense = values()
    rows = sparse_rows(dense, THRESHOLDS)
    check_sparse(rows, "x", 9, 5, {"mean": (3,), "quat_wxyz": (4,)})
    entry = 0
    for r in range(9):
        assert rows.row_ptr[r] == entry
        for c in range(5):
            if max(abs(dense["mean"][r, c])) > 1e-3 or max(abs(dense["quat_wxyz"][r, c])) > 2e-3:
                assert rows.column[entry] == c
                for name in dense:
                    np.testing.assert_array_equal(rows.values[name][entry], dense[name][r, c])
                entry += 1
    assert rows.entries == entry and 0 < entry < 45


def test_a_stream_of_blocks_gives_the_same() -> None:
    dense = values()
    whole = sparse_rows(dense, THRESHOLDS)
    builder = SparseRowsBuilder(12, 5, {"mean": (3,), "quat_wxyz": (4,)}, THRESHOLDS)
    for start, stop in ((0, 2), (2, 2), (2, 7), (7, 9)):
        builder.append({name: np.asfortranarray(v[start:stop]) for name, v in dense.items()})
    builder.append_empty(2)
    rows = builder.finish()
    check_sparse(rows, "x", 11, 5, {"mean": (3,), "quat_wxyz": (4,)})
    assert rows.row_ptr.tolist() == [*whole.row_ptr, *[whole.entries] * 2]
    np.testing.assert_array_equal(rows.column, whole.column)
    for name in dense:
        np.testing.assert_array_equal(rows.values[name], whole.values[name])


def test_a_block_may_have_fewer_columns() -> None:
    builder = SparseRowsBuilder(1, 5, {"w": ()}, {"w": 0.0})
    builder.append({"w": np.array([[0.0, 2.0, 3.0]])})
    rows = builder.finish()
    assert rows.columns == 5 and rows.column.tolist() == [1, 2] and rows.values["w"].tolist() == [2, 3]


def test_what_is_no_number_is_kept_for_a_check_to_see() -> None:
    rows = sparse_rows({"mean": np.array([[[0, np.nan, 0], [0, 0, 0], [np.inf, 0, 0]]])}, {"mean": 0.5})
    assert rows.column.tolist() == [0, 2]
    assert exceeds(np.array([[np.nan, -1.0, 1.0, 0.5]]), 0.5).tolist() == [[True, True, True, False]]


def test_exact_zeros_of_either_sign_are_dropped_and_the_smallest_number_is_kept() -> None:
    tiny = np.float32(1e-45)
    assert sparse_rows({"w": np.array([[0.0, -0.0, tiny, -tiny]], "f4")}, {"w": 0.0}).column.tolist() == [
        2,
        3,
    ]


def test_mistakes_of_the_caller() -> None:
    with pytest.raises(ValueError, match="65537 columns"):
        SparseRowsBuilder(1, 65537, {"w": ()}, {"w": 0.0})
    with pytest.raises(ValueError, match="thresholds"):
        SparseRowsBuilder(1, 1, {"w": ()}, {})
    builder = SparseRowsBuilder(2, 2, {"w": ()}, {"w": 0.0})
    for shape in ((1, 3), (3, 2), (1, 2, 1)):
        with pytest.raises(ValueError, match=r"expected|announced"):
            builder.append({"w": np.zeros(shape)})
