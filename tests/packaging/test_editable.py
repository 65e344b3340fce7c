"""What messages tell the user of a checkout to type leaves the install of `make demo` as it is: editable."""

from __future__ import annotations

import shlex
from pathlib import Path

import pytest

from avatar_schema.extras import how_to_install
from tests.packaging.environments import Environment, empty
from tools import dist

SEEN_FROM = "import avatar_schema; print(avatar_schema.__file__)"
HERE = ("--no-index", "--no-deps", "--no-build-isolation")  # what it needs is there


@pytest.fixture
def demo(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Environment:
    """As .venv after `make demo`, without the dependencies."""
    monkeypatch.chdir(dist.ROOT)
    environment = empty(tmp_path)
    environment.lend(["hatchling", "editables"])
    environment.pip("install", *HERE, "--editable", ".")
    return environment


def test_an_extra_comes_and_the_install_stays_editable(demo: Environment) -> None:
    pip, *words = shlex.split(how_to_install("fast"))
    assert pip == "pip"
    demo.pip(words[0], *HERE, *words[1:])
    assert str(dist.ROOT) in demo.script(SEEN_FROM)


def test_a_plain_install_would_put_a_copy_in_its_place(demo: Environment) -> None:
    """Or the test above would say nothing."""
    demo.pip("install", *HERE, ".[fast]")
    assert str(dist.ROOT) not in demo.script(SEEN_FROM)
