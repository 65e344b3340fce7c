"""Which project a folder is, and whether the player supports its version."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from pathlib import Path

import pytest

from avatar_export.drop import versions
from avatar_export.drop.hosts import HOSTS, project_at
from avatar_export.drop.steps import Place
from avatar_runtime.io.errors import AvatarError
from tests.exporter.drop.projects import GODOT, NPM, UNITY, UNREAL, WEB, lay

ROOT = Path(__file__).parents[3]
PLAYER = {
    "package.json": json.dumps(
        {"name": "com.x.player", "unity": "2022.3", "peerDependencies": {"three": "~0.187.0"}}
    ).encode()
}
PROJECTS: dict[str, tuple[Mapping[str, str], str]] = {
    "Unity": (UNITY, "Unity 2022.3.20f1"),
    "Unreal": (UNREAL, "Unreal 5.4"),
    "Godot": (GODOT, "Godot 4.4"),
    "npm": (NPM, "npm package shop 1.2.3"),
    "web": (WEB, "web folder with index.html"),
    "web without a first page": ({"about.html": "<p>"}, "web folder with about.html"),
}


@pytest.mark.parametrize("name", PROJECTS)
def test_a_project_is_known_by_what_its_engine_creates(tmp_path: Path, name: str) -> None:
    files, text = PROJECTS[name]
    project = project_at(lay(tmp_path, files))
    assert (project.host.name, project.text()) == (name.split()[0], text)
    assert 1 <= len(project.host.steps(Place(tmp_path, project.mark, "a/b.avatar"))) <= 3


VERSIONS: dict[str, tuple[Mapping[str, str], str, bool | None, str]] = {
    # name: (project, the text of its version's file, whether it is supported, what is said)
    "Unity 2021": (UNITY, "m_EditorVersion: 2021.3.5f1", False, "needs 2022.3 or newer"),
    "Unity 2022.2": (UNITY, "m_EditorVersion: 2022.2.21f1", False, "needs 2022.3 or newer"),
    "Unity 2023": (UNITY, "m_EditorVersion: 2023.1.0b2", True, "supports it (2022.3 to 6.x)"),
    "Unity 6.3": (UNITY, "\ufeffm_EditorVersion: 6000.3.1f1", True, "supports it"),
    "Unity 7": (UNITY, "m_EditorVersion: 7000.0.1f1", None, "newer than the player knows"),
    "Unreal 4": (UNREAL, '{"EngineAssociation": "4.27"}', False, "needs 5.4 or newer"),
    "Unreal 5.3": (UNREAL, '{"EngineAssociation": "5.3"}', False, "needs 5.4 or newer"),
    "Unreal 5.8": (UNREAL, '{"EngineAssociation": "5.8"}', True, "supports it (5.4 to 5.8)"),
    "Unreal 5.9": (UNREAL, '{"EngineAssociation": "5.9"}', None, "newer than the player knows"),
    "Unreal 6": (UNREAL, '{"EngineAssociation": "6.0"}', None, "newer than the player knows"),
    "Unreal of sources": (
        UNREAL,
        '{"EngineAssociation": "{7E2C1F65-4A5E-8A0B-2D5C-7F9A54321ABC}"}',
        None,
        "does not say its version; the player is for 5.4 to 5.8",
    ),
    "Godot 4.2": (GODOT, 'config/features=PackedStringArray("4.2")', None, "looked at for 4.4 and newer"),
    "Godot of old": (GODOT, "config_version=4", None, "no player for Godot yet, so the rig is put there"),
    "npm, an old three": (NPM, '{"dependencies": {"three": "~0.160.1"}}', None, "has three ~0.160.1"),
    "npm, a new three": (
        NPM,
        '{"devDependencies": {"three": "0.190.0"}}',
        None,
        "has three 0.190.0. npm installs",
    ),
    "npm, the three": (NPM, '{"dependencies": {"three": "^0.187.1", "vite": "1"}}', True, "supports it"),
    "npm, any three": (NPM, '{"dependencies": {"three": "latest"}}', True, "supports it"),
    "npm, odd": (NPM, '{"dependencies": ["three"]}', True, "supports it"),
}
FILES = {
    "Unity": "ProjectSettings/ProjectVersion.txt",
    "Unreal": "Game.uproject",
    "Godot": "project.godot",
    "npm": "package.json",
}


@pytest.mark.parametrize("name", VERSIONS)
def test_versions(tmp_path: Path, name: str) -> None:
    files, text, known, said = VERSIONS[name]
    project = project_at(lay(tmp_path, {**files, FILES[re.split("[ ,]", name)[0]]: text}))
    support = project.host.support(project.mark, PLAYER)
    assert support.known is known and said in support.text


@pytest.mark.parametrize(
    ("files", "message"),
    [
        ({**UNITY, FILES["Unity"]: ""}, "ProjectVersion.txt: m_EditorVersion: has no such line"),
        ({**UNREAL, FILES["Unreal"]: "{"}, "Game.uproject: holds no JSON object"),
        ({**NPM, FILES["npm"]: "[1]"}, "package.json: holds no JSON object"),
    ],
)
def test_a_project_whose_version_cannot_be_read(
    tmp_path: Path, files: Mapping[str, str], message: str
) -> None:
    project = project_at(lay(tmp_path, files))
    with pytest.raises(AvatarError, match=re.escape(message)):
        project.host.support(project.mark, PLAYER)


PAGES = {
    "unity": "players/unity/Documentation~/index.md",
    "unreal": "players/unreal/README.md",
    "godot": "docs/engines/godot.md",
}


def test_the_versions_are_those_of_the_pages() -> None:
    oldest, newest = versions.UNREAL
    said = {name: " ".join((ROOT / page).read_text("utf-8").split()) for name, page in PAGES.items()}
    assert f"For Unreal Engine {oldest} to {newest}." in said["unreal"]
    package = json.loads((ROOT / "players/unity/package.json").read_text("utf-8"))
    assert f"For Unity {package['unity']} to 6.x" in said["unity"]
    assert f"Godot {versions.GODOT} and later" in said["godot"]


def test_a_folder_that_is_none(tmp_path: Path) -> None:
    (tmp_path / "notes.txt").write_text("mine")
    with pytest.raises(AvatarError) as refused:
        project_at(tmp_path)
    assert (
        "is not a project of a known engine; looked for ProjectSettings/ProjectVersion.txt (Unity), "
        in str(refused.value)
    )
    for host in HOSTS:
        assert f"({host.name})" in str(refused.value)
    with pytest.raises(AvatarError, match="no such folder"):
        project_at(tmp_path / "nowhere")


def test_a_part_of_a_project_names_the_project(tmp_path: Path) -> None:
    game = lay(tmp_path / "game", UNITY)
    for inside in (game / "Assets", game / "Assets/Scenes", game / "ProjectSettings/ProjectVersion.txt"):
        with pytest.raises(AvatarError, match=f"lies in the Unity project {game}; give that folder"):
            project_at(inside)


def test_a_folder_above_a_project_names_it(tmp_path: Path) -> None:
    lay(tmp_path / "one", UNREAL)
    with pytest.raises(
        AvatarError, match=re.escape(f"but holds {tmp_path / 'one'} (Unreal); give that folder")
    ):
        project_at(tmp_path)
    for name in ("two", "three", "zero"):
        lay(tmp_path / name, WEB)
    with pytest.raises(
        AvatarError, match=r"one \(Unreal\), .*three \(web\), .*two \(web\), \.\.\.; give that"
    ):
        project_at(tmp_path)


def test_a_project_inside_a_project_decides_itself(tmp_path: Path) -> None:
    game = lay(tmp_path, {**UNITY, **{f"Assets/StreamingAssets/{path}": text for path, text in WEB.items()}})
    assert project_at(game / "Assets/StreamingAssets").host.name == "web"
    lay(game, {"index.html": "<p>", "package.json": "{}", "Tool/package.json": "{}"})
    assert project_at(game).host.name == "Unity"
    assert project_at(game / "Tool").host.name == "npm"


def test_a_package_of_unity_is_no_npm_project(tmp_path: Path) -> None:
    lay(tmp_path, {"package.json": '{"name": "com.x.tool", "unity": "2022.3"}'})
    with pytest.raises(AvatarError, match="is not a project of a known engine"):
        project_at(tmp_path)


def steps(folder: Path, asset: str) -> str:
    project = project_at(folder)
    return "\n".join(project.host.steps(Place(project.folder, project.mark, asset)))


def test_steps_follow_the_project(tmp_path: Path) -> None:
    classes = lay(tmp_path / "classes", UNREAL)
    assert "Open Game.uproject and answer Yes" in steps(classes, "Avatars/head.avatar")
    blueprints = lay(tmp_path / "blueprints", {"Game.uproject": '{"EngineAssociation": "5.5"}'})
    assert "Tools > New C++ Class" in steps(blueprints, "Avatars/head.avatar")
    for folder in (classes, blueprints):
        assert "a C++ toolchain" in steps(folder, "Avatars/head.avatar")
    shop = lay(tmp_path / "shop", NPM)
    assert "npm install ./avatar-export-player.tgz" in steps(shop, "public/head.avatar")
    assert 'load("/head.avatar")' in steps(shop, "public/head.avatar")
    lay(shop, {"pnpm-lock.yaml": ""})
    assert "pnpm add ./avatar-export-player.tgz" in steps(shop, "head.avatar")
    assert 'load("./head.avatar")' in steps(shop, "head.avatar")
