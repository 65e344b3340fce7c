"""The public interface of avatar_runtime: which names it has, that they are documented and typed, what it loads."""

from __future__ import annotations

import ast
import importlib
import inspect
import re
import subprocess
import sys
import typing
from importlib.metadata import PackageNotFoundError
from pathlib import Path

import pytest

import avatar_runtime
from avatar_runtime import version
from tests.avatars import full_avatar

CALLABLES = sorted({*avatar_runtime.__all__} - {"BACKENDS", "__version__"})
EXTRAS = ("numba", "moderngl", "onnx", "onnxruntime", "torch", "PIL", "pygltflib", "pxr")


def test_exactly_what_is_imported_is_public() -> None:
    own = ast.parse(Path(avatar_runtime.__file__).read_text("utf-8"))
    imported = [a.name for node in own.body if isinstance(node, ast.ImportFrom) for a in node.names]
    assert sorted(set(imported) - {"annotations"}) == sorted(avatar_runtime.__all__)


def public_functions(name: str) -> list[typing.Any]:
    """The object itself if it is a function, else its own public methods and __init__."""
    value = getattr(avatar_runtime, name)
    if not inspect.isclass(value):
        return [value]
    members = [inspect.unwrap(getattr(value, key)) for key in vars(value) if not key.startswith("_")]
    return [member for member in members if inspect.isfunction(member)]


@pytest.mark.parametrize("name", CALLABLES)
def test_every_public_name_is_documented(name: str) -> None:
    for value in [getattr(avatar_runtime, name), *public_functions(name)]:
        text = inspect.getdoc(value) or ""
        assert len(text) > 20 and not re.match(rf"{name}\(", text), f"{value} has no docstring of its own"


OWN = ("avatar", "backend", "level", "enhance", "light")  # what a player takes that is no option of a backend


def test_player_has_the_options_of_all_backends_with_their_defaults() -> None:
    parameters = inspect.signature(avatar_runtime.Player).parameters
    options = {k: default for row in avatar_runtime.BACKENDS.values() for k, default in row.options.items()}
    gl = avatar_runtime.BACKENDS["gl"]
    assert {name: p.default for name, p in parameters.items() if name not in OWN} == options
    made = inspect.signature(importlib.import_module(gl.module).make).parameters
    assert {name: p.default for name, p in made.items() if name != "avatar"} == gl.options


def test_player_hands_every_option_on(monkeypatch: pytest.MonkeyPatch) -> None:
    parameters = inspect.signature(avatar_runtime.Player).parameters
    given = {name: object() for name in parameters if name not in OWN}
    handed: dict[str, object] = {}
    monkeypatch.setattr("avatar_runtime.player.make_backend", lambda *_, **options: handed.update(options))
    avatar_runtime.Player(full_avatar(), **given)
    assert handed == given


def test_importing_loads_nothing_heavy() -> None:
    program = f"import sys, avatar_runtime; print(*set({EXTRAS}) & sys.modules.keys())"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, check=True, text=True)
    assert done.stdout.split() == []


@pytest.mark.parametrize(
    ("installed", "want"),
    [
        ({"avatar-export-runtime": "2.1", "avatar-export": "2.0"}, "2.1"),
        ({"avatar-export": "2.0"}, "2.0"),
        ({}, version.UNKNOWN),
    ],
)
def test_the_version_is_that_of_the_installed_distribution(
    installed: dict[str, str], want: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    def found(name: str) -> str:
        if name not in installed:
            raise PackageNotFoundError(name)
        return installed[name]

    monkeypatch.setattr(version, "version", found)
    assert version.installed_version() == want
    assert avatar_runtime.__version__
