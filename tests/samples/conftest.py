"""Sample checkpoints, made once for all tests of this folder."""

from __future__ import annotations

from pathlib import Path

import pytest
from samples.capture.head import blinking_head
from samples.make import make_gaussian_blendshapes, make_lam

from avatar_trainer.head import BodyModel, Head, build_body_model


@pytest.fixture(scope="session")
def conformance(sample_blendshapes: Path) -> Path:
    """The conformance avatar of Gaussian Blendshapes, both layouts."""
    return sample_blendshapes


@pytest.fixture(scope="session")
def plain(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A small one that looks like a person, dump layout."""
    return make_gaussian_blendshapes(tmp_path_factory.mktemp("plain"), 2000)


@pytest.fixture(scope="session")
def lam_zip(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return make_lam(tmp_path_factory.mktemp("lam"))


@pytest.fixture(scope="session")
def head() -> Head:
    """The head that captures show."""
    return blinking_head()


@pytest.fixture(scope="session")
def body(head: Head) -> BodyModel:
    """The body model of its every vertex."""
    return build_body_model(head)
