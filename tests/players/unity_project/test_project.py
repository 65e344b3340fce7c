"""The project for work on the Unity package: hand-written files are links, made files are real."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from tools.unity_project import ProjectError, lay_out

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


def test_made_files_are_real_and_not_in_the_checkout(package: Path, checkout: Path) -> None:
    made = unity.unity_made(checkout)
    assert len(made) > 40
    for name in made:
        assert not any(path.is_symlink() for path in (package / name, *(package / name).parents)), name
    assert not (checkout / "Made").exists()
    assert unity.hand_written(checkout) == unity.hand_written(WRITTEN)  # .meta files beside them are none
    assert b"version" not in (checkout / unity.MANIFEST).read_bytes()


def test_no_include_leaves_a_folder_that_is_a_link(package: Path, checkout: Path) -> None:
    """On the disk `link/..` is beside what the link points at, so such an include begins at the project."""
    texts = [path for kind in ("*.hlsl", "*.compute", "*.shader") for path in checkout.rglob(kind)]
    found = [
        (path, name) for path in texts for name in re.findall(r'#include "(.+?)"', path.read_text("utf-8"))
    ]
    assert len(found) >= 8
    for path, name in found:
        place = package.parents[1] / name if name.startswith(f"Packages/{NAME}/") else path.parent / name
        assert place.is_file(), f"{path.name}: {name}"


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


def test_a_new_file_outside_of_the_links_is_named_and_kept(package: Path, checkout: Path) -> None:
    (package / "New").mkdir()
    (package / "New/New.cs").write_text("// new\n", "utf-8")
    with pytest.raises(ProjectError, match=r"New is not in the checkout\. Move it to"):
        lay_out(checkout, package.parents[1])
    assert (package / "New/New.cs").exists() and (package / "Core").is_symlink()


def test_the_command_says_what_is_wrong_in_one_line(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("", "utf-8")
    command = [sys.executable, "-m", "tools.unity_project", str(tmp_path / "file")]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 2 and done.stderr.startswith("unity_project: ") and done.stderr.count("\n") == 1
