"""The project for work on the Unity package: hand-written files are links, made files are real."""

from __future__ import annotations

import os
import shutil
from pathlib import Path

import pytest
from tools.unity_project import lay_out

from avatar_export.players import unity

ROOT = Path(__file__).parents[3]
WRITTEN = ROOT / "players" / "unity"
NAME = "com.avatar-export.player"


@pytest.fixture
def checkout(tmp_path: Path) -> Path:
    """A copy of the hand-written files: .meta files are written beside them."""
    return Path(shutil.copytree(WRITTEN, tmp_path / "checkout", ignore=shutil.ignore_patterns("*.meta")))


@pytest.fixture
def package(checkout: Path, tmp_path: Path) -> Path:
    """The package in the project."""
    return lay_out(checkout, tmp_path / "project")


def files(folder: Path) -> dict[str, bytes]:
    """All files, links followed."""
    paths = (Path(at, name) for at, _, names in os.walk(folder, followlinks=True) for name in names)
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in paths}


def test_it_is_a_project_in_which_unity_finds_what_the_package_holds(
    package: Path, unity_package: Path
) -> None:
    project = package.parents[1]
    assert files(package) == files(unity_package)
    assert package.name == NAME and (project / "Assets").is_dir()
    version = (project / "ProjectSettings/ProjectVersion.txt").read_text("utf-8")
    assert version == "m_EditorVersion: 2022.3.0f1\n"
    assert NAME in (project / "Packages/manifest.json").read_text("utf-8")


def test_edits_and_new_files_land_in_the_checkout(package: Path, checkout: Path) -> None:
    for name in ("Core/New.cs", "Shaders/Resources/AvatarExport/New.shader", "Runtime/New/New.cs"):
        (package / name).parent.mkdir(exist_ok=True)
        (package / name).write_text("// new\n", "utf-8")
        assert (checkout / name).read_text("utf-8") == "// new\n"
    with (package / "Core" / "LoadedAvatar.cs").open("a", encoding="utf-8") as file:
        file.write("// edited\n")
    assert (checkout / "Core" / "LoadedAvatar.cs").read_text("utf-8").endswith("// edited\n")
    assert (package / "README.md").is_symlink()


def test_again_it_keeps_the_users_files_and_drops_what_is_gone(package: Path, checkout: Path) -> None:
    project, meta = package.parents[1], package / "Core" / "LoadedAvatar.cs.meta"
    kept = {project / "Packages/manifest.json": "{}", project / "Assets/Mine.unity": "mine"}
    kept[meta] = meta.read_text("utf-8") + "MonoImporter:\n"
    for path, text in kept.items():
        path.write_text(text, "utf-8")
    (package / "Made/old.hlsl").write_text("// no longer made\n", "utf-8")
    (package / "Made/activate.hlsl").write_text("// edited\n", "utf-8")
    (package / "Gone").symlink_to(checkout / "Gone")
    assert lay_out(checkout, project) == package
    assert all(path.read_text("utf-8") == text for path, text in kept.items())
    assert not (package / "Made/old.hlsl").exists() and not (package / "Gone").is_symlink()
    assert (package / "Made/activate.hlsl").read_bytes() == unity.unity_made(checkout)["Made/activate.hlsl"]
