"""The conformance samples, made once a session."""

from __future__ import annotations

from pathlib import Path

import pytest
from samples.make import make_gaussian_blendshapes, make_lam

from avatar_export.read import read
from avatar_export.readers.options import ReadOptions
from avatar_runtime.avatar import Avatar


@pytest.fixture(scope="session")
def sample_blendshapes(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder with model/ (both forms), body/, dataset/, driving.json; no field of the model is zero."""
    return make_gaussian_blendshapes(tmp_path_factory.mktemp("samples"), full=True, form="both")


@pytest.fixture(scope="session")
def sample_lam(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A LAM zip without zero fields."""
    return make_lam(tmp_path_factory.mktemp("samples"), full=True)


@pytest.fixture(scope="session")
def blendshapes_avatar(sample_blendshapes: Path) -> Avatar:
    return read(sample_blendshapes / "model", ReadOptions(dataset=sample_blendshapes))


@pytest.fixture(scope="session")
def lam_avatar(sample_lam: Path) -> Avatar:
    return read(sample_lam)
