"""Which project a folder is, and whether the player supports its version."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from pathlib import Path

import pytest

from avatar_export.drop.hosts import HOSTS, project_at
from avatar_export.drop.steps import Place
from avatar_runtime.io.errors import AvatarError
from tests.exporter.drop.projects import GODOT, NPM, UNITY, UNREAL, WEB
from tests.folders import lay

PACKAGE = {"name": "com.x.player", "unity": "2022.3", "peerDependencies": {"three": "~0.187.0"}}
PLAYER = {
    "package.json": json.dumps(PACKAGE).encode(),
    "gaussian_avatar.gdextension": b'[configuration]\ncompatibility_minimum = "4.6.3"\n',
}
PROJECTS: dict[str, tuple[Mapping[str, str], str]] = {
    "Unity": (UNITY, "Unity 2022.3.20f1"),
    "Unreal": (UNREAL, "Unreal 5.4"),
    "Godot": (GODOT, "Godot 4.6"),
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


def unity(version: str) -> str:
    return f"m_EditorVersion: {version}"


def unreal(version: str) -> str:
    return json.dumps({"EngineAssociation": version})


def godot(version: str, renderer: str = "forward_plus") -> str:
    features = f'config/features=PackedStringArray("{version}")'
    return f'{features}\n[rendering]\nrenderer/rendering_method="{renderer}"'


def npm(three: object, kind: str = "dependencies") -> str:
    return json.dumps({kind: three})


VERSIONS: list[tuple[Mapping[str, str], str, bool | None, str]] = [
    # project, the text of its version's file, whether it is supported, a word of what is said
    (UNITY, unity("2021.3.5f1"), False, "2022.3"),
    (UNITY, unity("2022.2.21f1"), False, "2022.3"),
    (UNITY, unity("2023.1.0b2"), True, "2022.3 to 6.x"),
    (UNITY, "\ufeff" + unity("6000.3.1f1"), True, ""),
    (UNITY, unity("7000.0.1f1"), None, "newer"),
    (UNREAL, unreal("4.27"), False, "5.4"),
    (UNREAL, unreal("5.3"), False, "5.4"),
    (UNREAL, unreal("5.8"), True, "5.4 to 5.8"),
    (UNREAL, unreal("5.9"), None, "newer"),
    (UNREAL, unreal("6.0"), None, "newer"),
    (UNREAL, unreal("{7E2C1F65-4A5E-8A0B-2D5C-7F9A54321ABC}"), None, "5.4 to 5.8"),  # built from sources
    (GODOT, godot("4.5"), False, "4.6"),
    (GODOT, godot("4.6"), True, ""),
    (GODOT, godot("4.6", "gl_compatibility"), None, "Forward+"),
    (GODOT, godot("4.7", "mobile"), None, "newer"),
    (GODOT, "config_version=4", None, "4.6 and newer"),
    (NPM, npm({"three": "~0.160.1"}), None, "three ~0.160.1"),
    (NPM, npm({"three": "0.190.0"}, "devDependencies"), None, "three 0.190.0"),
    (NPM, npm({"three": "^0.187.1", "vite": "1"}), True, ""),
    (NPM, npm({"three": "latest"}), True, ""),
    (NPM, npm(["three"]), True, ""),
]
VERSION_FILES = ("ProjectSettings/ProjectVersion.txt", "Game.uproject", "project.godot", "package.json")


def with_version(files: Mapping[str, str], text: str) -> dict[str, str]:
    return {**files, next(name for name in VERSION_FILES if name in files): text}


@pytest.mark.parametrize(("files", "text", "known", "said"), VERSIONS)
def test_versions(tmp_path: Path, files: Mapping[str, str], text: str, known: bool | None, said: str) -> None:
    project = project_at(lay(tmp_path, with_version(files, text)))
    support = project.host.support(project.mark, PLAYER)
    assert support.known is known and said in support.text


@pytest.mark.parametrize(
    ("files", "text", "message"),
    [
        (UNITY, "", "ProjectVersion.txt: m_EditorVersion: "),
        (UNREAL, "{", "Game.uproject: holds no JSON object"),
        (NPM, "[1]", "package.json: holds no JSON object"),
    ],
)
def test_a_project_whose_version_cannot_be_read(
    tmp_path: Path, files: Mapping[str, str], text: str, message: str
) -> None:
    project = project_at(lay(tmp_path, with_version(files, text)))
    with pytest.raises(AvatarError, match=re.escape(message)):
        project.host.support(project.mark, PLAYER)


def test_a_folder_that_is_none(tmp_path: Path) -> None:
    lay(tmp_path, {"notes.txt": "mine", "package.json": '{"name": "com.x.tool", "unity": "2022.3"}'})
    with pytest.raises(AvatarError, match="is not a project of a known engine") as refused:
        project_at(tmp_path)
    assert [host.name for host in HOSTS if f"({host.name})" not in str(refused.value)] == []
    with pytest.raises(AvatarError, match="no such folder"):
        project_at(tmp_path / "nowhere")


def test_a_part_of_a_project_names_the_project(tmp_path: Path) -> None:
    game = lay(tmp_path / "game", UNITY)
    for inside in (game / "Assets", game / "Assets/Scenes", game / "ProjectSettings/ProjectVersion.txt"):
        with pytest.raises(AvatarError, match=f"Unity project {game};"):
            project_at(inside)


def test_a_folder_above_a_project_names_it(tmp_path: Path) -> None:
    lay(tmp_path / "one", UNREAL)
    with pytest.raises(AvatarError, match=re.escape(f"{tmp_path / 'one'} (Unreal);")):
        project_at(tmp_path)
    for name in ("two", "three", "zero"):
        lay(tmp_path / name, WEB)
    with pytest.raises(AvatarError, match=r"one \(Unreal\), .*three \(web\), .*two \(web\), \.\.\.;"):
        project_at(tmp_path)


def test_a_project_inside_a_project_decides_itself(tmp_path: Path) -> None:
    game = lay(tmp_path, {**UNITY, **{f"Assets/StreamingAssets/{path}": text for path, text in WEB.items()}})
    assert project_at(game / "Assets/StreamingAssets").host.name == "web"
    lay(game, {"index.html": "<p>", "package.json": "{}", "Tool/package.json": "{}"})
    assert project_at(game).host.name == "Unity"
    assert project_at(game / "Tool").host.name == "npm"


BLUEPRINTS = {"Game.uproject": '{"EngineAssociation": "5.5"}'}


@pytest.mark.parametrize(
    ("files", "words"),
    [
        (UNREAL, ["Open Game.uproject", "C++ toolchain"]),
        (BLUEPRINTS, ["Tools > New C++ Class", "C++ toolchain"]),
        (NPM, ["npm install ./avatar-export-player.tgz", 'src="./head.avatar"']),
        ({**NPM, "pnpm-lock.yaml": ""}, ["pnpm add ./avatar-export-player.tgz", 'src="./head.avatar"']),
    ],
)
def test_steps_follow_the_project(tmp_path: Path, files: Mapping[str, str], words: list[str]) -> None:
    project = project_at(lay(tmp_path, files))
    text = "\n".join(project.host.steps(Place(project.folder, project.mark, "head.avatar")))
    assert [word for word in words if word not in text] == []
