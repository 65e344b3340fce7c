"""Fixtures that more than one folder of tests uses."""

from __future__ import annotations

from tests.session import threads  # isort: skip  # before NumPy

import signal

import pytest

from tests.golden import ON, BlendshapesGolden, unpack_gaussian_blendshapes
from tests.session import fuzz

pytest_plugins = [
    "tests.commands",
    "tests.measured",
    "tests.packaging.built_godot",
    "tests.packaging.built_web",
    "tests.samples_made",
    "tests.session.assembled",
    "tests.session.collector",
    "tests.session.cost",
]


def pytest_configure() -> None:
    """Before any test module is imported. Tests in the background of a shell hear Ctrl+C again, and what they start."""
    if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)
    fuzz.load_profile()


@pytest.fixture(scope="session", autouse=True)
def one_thread() -> None:
    """Kernels run on one thread where a test does not say otherwise."""
    threads.use_one()


@pytest.fixture(scope="session")
def blendshapes_golden(tmp_path_factory: pytest.TempPathFactory) -> BlendshapesGolden:
    """The Gaussian Blendshapes vectors."""
    return unpack_gaussian_blendshapes(tmp_path_factory.mktemp("gaussian_blendshapes"))


@pytest.fixture(params=list(ON))
def backend(request: pytest.FixtureRequest) -> str:
    """Each backend that draws both profiles: the released codes' numbers judge them all."""
    name: str = request.param
    return name
