"""Imports point down: train -> export -> runtime -> shaders -> schema. Heavy libraries keep to a room."""

from __future__ import annotations

import importlib
import subprocess
import sys
from functools import cache
from pathlib import Path

import pytest

from tools import structure

ROOT = Path(__file__).parents[1]
# package: (folder, what it may import besides the standard library)
# fmt: off
FLOORS: dict[str, tuple[str, set[str]]] = {
    "avatar_schema": ("schema", {
        "jsonschema",
    }),
    "avatar_shaders": ("engine_shaders", {
        "avatar_schema",
    }),
    "avatar_runtime": ("runtime", {
        "avatar_schema", "avatar_shaders", "_moderngl", "llvmlite", "moderngl", "numba", "numpy", "onnx",
        "onnxruntime",
    }),
    "avatar_export": ("exporter", {
        "avatar_runtime", "avatar_schema", "avatar_shaders", "cv2", "dask", "distributed", "fsspec", "numpy", "PIL",
        "pxr", "pygltflib", "pythonosc", "rich", "typer", "ufbx", "websockets", "yaml",
    }),
    "avatar_trainer": ("trainer", {
        "avatar_export", "avatar_runtime", "avatar_schema", "cv2", "gsplat", "llvmlite", "lpips", "mediapipe", "numba",
        "numpy", "onnx", "PIL", "rich", "tensorboard", "threadpoolctl", "torch", "trimesh", "typer", "yaml",
    }),
}
# fmt: on
HEAVY: dict[str, tuple[str, ...]] = {  # library: the folders that may import it
    "torch": ("trainer/avatar_trainer",),
    "tensorboard": ("trainer/avatar_trainer",),
    "cv2": ("exporter/avatar_export/playing", "trainer/avatar_trainer/film"),
    "mediapipe": ("trainer/avatar_trainer/film",),
    "_moderngl": ("runtime/avatar_runtime/backends/gl",),
    "moderngl": ("runtime/avatar_runtime/backends/gl",),
    "numba": ("runtime/avatar_runtime/backends/cpu", "trainer/avatar_trainer"),
    "llvmlite": ("runtime/avatar_runtime/backends/cpu", "trainer/avatar_trainer"),
    "onnx": ("runtime/avatar_runtime/enhance", "trainer/avatar_trainer"),
    "onnxruntime": ("runtime/avatar_runtime/enhance",),
    "pxr": ("exporter/avatar_export/writers/usd",),
    "pythonosc": ("exporter/avatar_export/live",),
    "websockets": ("exporter/avatar_export/live", "exporter/avatar_export/serving"),
    "dask": ("exporter/avatar_export/batch",),
    "distributed": ("exporter/avatar_export/batch",),
    "fsspec": ("exporter/avatar_export/batch",),
}
SAMPLES_THAT_TRAIN = ("asm", "capture", "closeups.py", "films", "trained.py")  # rooms and files of samples/


@cache
def by_path() -> dict[Path, structure.Module]:
    """Every module, by its file."""
    return {module.path: module for module in structure.modules().values()}


def imports(file: Path) -> frozenset[str]:
    """Top-level names of every import in a file, wherever it stands."""
    return frozenset(name.partition(".")[0] for name, _ in by_path()[file].imports)


@pytest.mark.parametrize("package", FLOORS)
def test_imports_point_down(package: str) -> None:
    folder, allowed = FLOORS[package]
    files = sorted((ROOT / folder / package).rglob("*.py"))
    assert files
    for file in files:
        extra = imports(file) - sys.stdlib_module_names - allowed - {package}
        assert not extra, f"{file.relative_to(ROOT)} may not import {sorted(extra)}"


def public_names(package: str) -> set[str]:
    """What the `__init__` of a package lists in `__all__`."""
    return set(getattr(importlib.import_module(package), "__all__", ()))


def test_the_trainer_uses_public_names_of_the_floors_below() -> None:
    """Names and whole modules that a package lists in `__all__`; a deeper path is private to its floor."""
    known = structure.modules()
    for module in known.values():
        if not module.name.startswith("avatar_trainer"):
            continue
        for source, names in module.imports:
            if not source.startswith(("avatar_schema", "avatar_runtime", "avatar_export")):
                continue
            where = f"{module.path.relative_to(ROOT)}: {source}"
            assert names and known[source].path.name == "__init__.py", (
                f"{where} is no package; import a name of one"
            )
            private = {name.rpartition(".")[2] for name in names} - public_names(source)
            assert not private, f"{where} does not list {sorted(private)} in __all__"


def test_what_a_package_lists_exists() -> None:
    for module in structure.modules().values():
        if module.name.partition(".")[0] in FLOORS and module.path.name == "__init__.py":
            for name in public_names(module.name):
                if f"{module.name}.{name}" not in structure.modules():
                    getattr(importlib.import_module(module.name), name)


def test_heavy_libraries_keep_to_their_room() -> None:
    for folder, _ in FLOORS.values():
        for file in (ROOT / folder).rglob("*.py"):
            heavy = HEAVY.keys() & imports(file)
            outside = {name for name in heavy if not {ROOT / room for room in HEAVY[name]} & {*file.parents}}
            assert not outside, f"{file.relative_to(ROOT)} imports {outside}"
    for room in {room for rooms in HEAVY.values() for room in rooms}:
        assert any((ROOT / room).glob("*.py")), f"{room} is gone"


def test_only_programs_and_the_gl_backend_of_the_runtime_know_the_shaders() -> None:
    rooms = {ROOT / "runtime/avatar_runtime/backends/gl", ROOT / "runtime/avatar_runtime/program"}
    for file in (ROOT / "runtime").rglob("*.py"):
        assert rooms & {*file.parents} or "avatar_shaders" not in imports(file), file.relative_to(ROOT)


def test_heavy_libraries_are_loaded_only_where_they_are_needed() -> None:
    program = (
        "import sys, avatar_export.cli, avatar_export.checks.bundle, avatar_runtime.backends, avatar_shaders.__main__;"
        "import avatar_trainer.head;"  # for who has NumPy alone
        f"print(*set({[*HEAVY]}) & sys.modules.keys())"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, check=True, text=True)
    assert done.stdout.split() == []


def test_samples_need_the_base_install_only() -> None:
    allowed = {"samples", "avatar_export", "avatar_runtime", "avatar_schema"}
    allowed |= {"numpy", "PIL", "pygltflib"}
    for file in (ROOT / "samples").rglob("*.py"):
        trains = file.relative_to(ROOT / "samples").parts[0] in SAMPLES_THAT_TRAIN
        training = {"av", "avatar_trainer", "numba"} if trains else set()  # av: films alone are written
        # The head model is the mesh of the samples, too, and needs NumPy alone.
        with_head = {name for name, _ in by_path()[file].imports} - {"avatar_trainer.head"}
        extra = {name.partition(".")[0] for name in with_head} - sys.stdlib_module_names - allowed - training
        assert not extra, f"{file.relative_to(ROOT)} may not import {sorted(extra)}"
