"""The containers of the committed golden vectors, and that they hold what the complete vectors hold."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tests.golden import (
    FRAMES,
    GOLDEN,
    Array,
    digest,
    dumps,
    full_rasteriser_case,
    loads,
    rasteriser_case,
    rasteriser_names,
    unpack_full_gaussian_blendshapes,
    unpack_gaussian_blendshapes,
)

RNG = np.random.default_rng(0)


@pytest.mark.parametrize(
    "array",
    [
        RNG.normal(size=(7, 3)).astype(np.float32),
        RNG.normal(size=(3000, 3)),
        RNG.choice(np.array([0, -0.0, np.nan, 1, 2], np.float32), (40, 100)),
        RNG.integers(0, 300, 5000).astype(np.int32),
        np.array(["neutral", "everything"]),
        np.array(3, np.int32),
        np.zeros((0, 4), np.float32),
        np.arange(12, dtype=np.uint8).reshape(3, 4).T,
    ],
    ids=["floats", "doubles", "few words", "two-byte index", "text", "scalar", "empty", "transposed"],
)
def test_packed_arrays_come_back_bit_for_bit(array: Array) -> None:
    got = loads(dumps({"before": np.arange(3), "array": array, "after": np.arange(5)}))
    assert list(got) == ["before", "array", "after"]
    same(got["array"], array)
    np.testing.assert_array_equal(got["after"], np.arange(5))


def test_digest_tells_values_not_signs_of_zero() -> None:
    a = np.array([0.0, 1.0], np.float32)
    assert digest(a) == digest(np.array([-0.0, 1.0], np.float32))
    assert digest(a) != digest(np.nextafter(a, np.float32(2)))
    assert digest(a) != digest(a.astype(np.float64))


def test_the_committed_vectors_stay_small() -> None:
    assert sum(path.stat().st_size for path in GOLDEN.rglob("*") if path.is_file()) < 12_000_000


@pytest.mark.parametrize("name", rasteriser_names())
def test_committed_cases_are_the_sources(name: str) -> None:
    committed, full = rasteriser_case(name), full_rasteriser_case(name)
    for key, array in full.arrays.items():
        if key in committed.digests:
            assert committed.digests[key] == digest(array), key
        elif not key.endswith("_fma"):
            same(committed.arrays[key], array)


def test_committed_blendshapes_are_the_sources(tmp_path: Path) -> None:
    full = unpack_full_gaussian_blendshapes(tmp_path / "full")
    part = unpack_gaussian_blendshapes(tmp_path / "part")
    files = [
        path.relative_to(part.folder) for path in part.folder.rglob("*") if path.suffix not in (".npz", "")
    ]
    for path in files:
        if path.parts[:2] != ("viewer", "fix_chkpnt40000"):
            assert (part.folder / path).read_bytes() == (full.folder / path).read_bytes(), path
    assert {path.parts[0] for path in files} == {"raw", "viewer", "dataset", "body"}
    for ours, theirs in ((part.static(), full.static()), (part.body_model(), full.body_model())):
        assert list(ours) == list(theirs)
        for key, array in ours.items():
            same(array, theirs[key])
    for index in FRAMES:
        theirs = full.frame(index)
        for key, array in part.frame(index).items():
            rows = {"face_": part.face_rows, "mesh_": part.vertex_rows}.get(key[:5], ...)
            same(array, theirs[key][rows])
    for path in sorted(part.viewer.glob("fix_chkpnt40000/*.npy")):
        array = np.load(full.viewer / "fix_chkpnt40000" / path.name)
        same(np.load(path), np.take(array, part.face_rows, axis=1 if path.stem == "pos_t" else 0))


def same(got: Array, want: Array) -> None:
    assert (got.dtype, got.shape) == (want.dtype, want.shape)
    assert got.tobytes() == np.ascontiguousarray(want).tobytes()
