"""The public interface of avatar_runtime: which names it has, that they are documented and typed, what it loads."""

from __future__ import annotations

import ast
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

NAMES = {
    *(
        "Avatar",
        "AvatarError",
        "BACKENDS",
        "Camera",
        "Clip",
        "Driver",
        "DrivingFrame",
        "EnginePose",
        "Frame",
        "Image",
        "Player",
        "Pose",
    ),
    *("Splats", "__version__", "check_avatar", "clip_pose", "default_backend", "engine_clip", "engine_pose"),
    *("joint_rotation", "load", "target_names"),
}
CALLABLES = sorted(NAMES - {"BACKENDS", "__version__"})
EXTRAS = ("numba", "moderngl", "onnx", "onnxruntime", "torch", "PIL", "pygltflib", "pxr")


def test_exactly_these_names_are_public() -> None:
    """A name that disappears breaks its users; a name that is added must be kept."""
    assert set(avatar_runtime.__all__) == NAMES and len(avatar_runtime.__all__) == len(NAMES)
    own = ast.parse(Path(avatar_runtime.__file__).read_text("utf-8"))
    imported = {a.name for node in own.body if isinstance(node, ast.ImportFrom) for a in node.names}
    assert imported - {"annotations"} == NAMES
    assert len(Path(avatar_runtime.__file__).read_text("utf-8").splitlines()) <= 40


def test_the_package_is_marked_as_typed() -> None:
    assert (Path(avatar_runtime.__file__).parent / "py.typed").is_file()


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


@pytest.mark.parametrize("name", CALLABLES)
def test_every_public_function_is_typed(name: str) -> None:
    for function in public_functions(name):
        signature = inspect.signature(function)
        assert signature.return_annotation is not signature.empty, function
        missing = [
            p.name for p in signature.parameters.values() if p.annotation is p.empty and p.name != "self"
        ]
        assert not missing, f"{function}: {missing}"


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
