"""No bytes give the SplattingAvatar reader anything but an avatar or an AvatarError."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from avatar_export.readers.splatting_avatar import reader as splatting_avatar
from tests.exporter.readers import splatting_files
from tests.exporter.readers.splatting_files import (
    put,
    read_run,
    write_splatting_run,
)
from tests.hostile import MANGLING, mangled, only_avatar_errors

A = splatting_files.arrays()

TEXT = json.dumps(splatting_files.document(A))
PLACES: list[tuple[Any, ...]] = [
    *[(key,) for key in ("cano_mesh", "sample_fidxs", "sample_bary", "_xyz", "_rotation")],
    *[(key, row) for key in ("sample_fidxs", "sample_bary", "_xyz", "_rotation") for row in (0, 5, 23)],
    *[
        (key, row, column)
        for key in ("sample_bary", "_xyz", "_rotation")
        for row in (0, 23)
        for column in (0, 2)
    ],
]
VALUES = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=9)
    | st.sampled_from([2**63, -(2**63) - 1, 10**310, 1e308, 1e39, -1e-3, "embedding.obj", "\ud800"]),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=3), inner, max_size=3),
    max_leaves=6,
)  # fmt: skip


@pytest.fixture(scope="module")
def one_run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """For fuzzing: its files are overwritten by each example."""
    return write_splatting_run(tmp_path_factory.mktemp("fuzz"), A, config=None)


def _fuzz(folder: Path, name: str, data: bytes) -> None:
    (folder / name).write_bytes(data)
    assert splatting_avatar.detect(folder)
    only_avatar_errors(lambda: read_run(folder))


@MANGLING
@given(mangled(TEXT.encode()))
def test_mangled_embedding(one_run: Path, data: bytes) -> None:
    _fuzz(one_run, "embedding.json", data)


@MANGLING
@given(st.sampled_from(PLACES), VALUES)
def test_any_value_anywhere_in_the_embedding(one_run: Path, place: tuple[Any, ...], value: Any) -> None:
    document = splatting_files.document(A)
    put(place[0], *place[1:], value)(document) if len(place) > 1 else document.update({place[0]: value})
    _fuzz(one_run, "embedding.json", json.dumps(document).encode())


@pytest.fixture(scope="module")
def other_run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_splatting_run(tmp_path_factory.mktemp("fuzz"), A, config=None)


@MANGLING
@given(mangled(splatting_files.CONFIG.encode()))
def test_mangled_config(other_run: Path, data: bytes) -> None:
    _fuzz(other_run, "config.yaml", data)


@pytest.fixture(scope="module")
def third_run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_splatting_run(tmp_path_factory.mktemp("fuzz"), A, config=None)


@MANGLING
@given(mangled(splatting_files.obj_text().encode()))
def test_mangled_mesh(third_run: Path, data: bytes) -> None:
    _fuzz(third_run, "embedding.obj", data)
