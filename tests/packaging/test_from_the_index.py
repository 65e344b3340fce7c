"""Installs as a user makes them, from a package index: minutes, so `make test-more` runs them."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.packaging.environments import Environment, empty
from tests.released import DATA
from tools import dist

pytestmark = pytest.mark.more
BUNDLE = DATA / "0.1.0" / "lam.avatar.zip"
VERSIONS = """
import json
from importlib.metadata import distributions
print(*sorted(d.metadata["Name"] for d in distributions() if d.metadata["Name"].startswith("avatar-")))
"""
SEEN_FROM = "import avatar_export, avatar_runtime; print(avatar_export.__file__, avatar_runtime.__file__)"
INSTALLS = {  # how: the distributions that are there then
    "wheels": "avatar-export avatar-export-runtime",
    "sdists": "avatar-export avatar-export-runtime",
    "checkout": "avatar-export",
    "editable": "avatar-export",
}


@pytest.fixture(params=INSTALLS)
def how(request: pytest.FixtureRequest) -> str:
    name: str = request.param
    return name


@pytest.fixture
def installed(how: str, built: dict[str, list[Path]], tmp_path: Path) -> Environment:
    """Own distributions are always given as files: a name asked of an index may be somebody else's there."""
    environment = empty(tmp_path / "env")
    sdists, wheels = zip(*built.values(), strict=True)
    given = {
        "wheels": wheels,
        "sdists": sdists,
        "checkout": (dist.ROOT,),
        "editable": ("--editable", dist.ROOT),
    }
    environment.pip("install", *given[how])
    return environment


def test_it_installs_in_one_command_and_plays(how: str, installed: Environment, tmp_path: Path) -> None:
    installed.pip("check")
    assert installed.script(VERSIONS).strip() == INSTALLS[how]
    from_checkout = str(dist.ROOT) in installed.script(SEEN_FROM)
    assert from_checkout == (how == "editable")
    assert installed.run("avatar-export", "validate", BUNDLE).stdout.endswith("sound\n")
    installed.run("avatar-export", "render", BUNDLE, "--out", tmp_path / "drawn.png", "--size", "64")
    assert (tmp_path / "drawn.png").read_bytes().startswith(b"\x89PNG")


def test_without_its_dependencies_a_wheel_is_refused(wheels: dict[str, Path], tmp_path: Path) -> None:
    """Or the tests of empty environments would say nothing about what a wheel asks for."""
    environment = empty(tmp_path)
    environment.lend(["numpy"])
    with pytest.raises(AssertionError, match="jsonschema"):
        environment.install(wheels["avatar-export-runtime"])
