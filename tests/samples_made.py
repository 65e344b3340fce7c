"""The conformance samples, made once a run for all workers."""

from __future__ import annotations

from pathlib import Path

import pytest
from samples.make import make_body, make_gaussian_blendshapes, make_lam, make_splatting_head

from avatar_export.options import ReadOptions
from avatar_export.readers.table import read
from avatar_runtime.avatar import Avatar
from tests.session.shared_folder import made_once


@pytest.fixture(scope="session")
def sample_blendshapes(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder with model/ (both forms), body/, dataset/, driving.json; no field of the model is zero."""
    return made_once(
        tmp_path_factory,
        "sample_blendshapes",
        lambda folder: make_gaussian_blendshapes(folder, full=True, form="both"),
    )


@pytest.fixture(scope="session")
def sample_lam(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A LAM zip without zero fields."""
    return made_once(tmp_path_factory, "sample_lam", lambda folder: make_lam(folder, full=True))


@pytest.fixture(scope="session")
def sample_splatting_head(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder with run/ (SH degree 0), body/, flame_params.json, driving.json; it looks like a person."""
    return made_once(
        tmp_path_factory, "sample_splatting_head", lambda folder: make_splatting_head(folder, 4000)
    )


@pytest.fixture(scope="session")
def sample_splatting_head_sh3(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The same of a coarse head with an identity shape, SH degree 3 and no field that is zero."""
    return made_once(
        tmp_path_factory,
        "sample_splatting_head_sh3",
        lambda folder: make_splatting_head(folder, sh_degree=3, full=True),
    )


@pytest.fixture(scope="session")
def sample_body(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder with run/ and CesiumMan.glb."""
    return made_once(tmp_path_factory, "sample_body", lambda folder: make_body(folder, 4000))


@pytest.fixture(scope="session")
def blendshapes_avatar(sample_blendshapes: Path) -> Avatar:
    return read(sample_blendshapes / "model", ReadOptions(dataset=sample_blendshapes))


@pytest.fixture(scope="session")
def lam_avatar(sample_lam: Path) -> Avatar:
    return read(sample_lam)


@pytest.fixture(scope="session")
def splatting_head_avatar(sample_splatting_head: Path) -> Avatar:
    return read_head(sample_splatting_head)


@pytest.fixture(scope="session")
def splatting_head_sh3_avatar(sample_splatting_head_sh3: Path) -> Avatar:
    return read_head(sample_splatting_head_sh3)


@pytest.fixture(scope="session")
def body_avatar(sample_body: Path) -> Avatar:
    return read(sample_body / "run", ReadOptions(rig=sample_body / "CesiumMan.glb"))


def read_head(folder: Path) -> Avatar:
    """The head of a folder that make_splatting_head wrote."""
    files = {"body_model": folder / "body" / "body_model.npz", "poses": folder / "flame_params.json"}
    return read(folder / "run", ReadOptions(**files))
