"""The command itself, into projects as each engine creates them."""

from __future__ import annotations

import io
import json
import tarfile
from collections.abc import Mapping
from pathlib import Path
from types import SimpleNamespace

import pytest
from tools.godot import build

from avatar_export.drop import contents as drop_contents
from avatar_export.drop.placing import DROPPED
from avatar_export.notes.note import fact
from avatar_export.packing.choices import Choices
from avatar_export.players import assemble as assembling
from avatar_export.players.assemble import assemble
from avatar_export.serving.site_folder import MARK
from avatar_runtime.avatar import Avatar
from avatar_schema.version import __version__
from tests import bundles
from tests.commands import Refused, Run
from tests.exporter.drop.projects import GODOT, NPM, UNITY, UNREAL, WEB
from tests.exporter.serving.packs import packed
from tests.folders import contents, lay
from tests.session.rights import as_anybody

Files = Mapping[str, str]

PLAYER = "Packages/com.avatar-export.player"


@pytest.fixture
def pack(tmp_path: Path) -> Path:
    return lay(tmp_path, {"head.avatar": packed()}) / "head.avatar"


@pytest.fixture
def small(monkeypatch: pytest.MonkeyPatch) -> None:
    """Players of two files each: what they hold is not the matter here."""
    package = {"name": "avatar-export-player", "unity": "2022.3", "peerDependencies": {"three": ">=0.187.0"}}
    files = {"package.json": json.dumps(package).encode(), "dist/index.js": b"export {};\n"}
    for name in assembling.PLAYERS:
        monkeypatch.setitem(assembling.PLAYERS, name, lambda: dict(files))


def added(project: Path, before: Mapping[str, str]) -> dict[str, bytes]:
    """What was put into a project that began with the files `before`, which must not have changed."""
    held = contents(project)
    assert {path: held.pop(path) for path in before} == {path: text.encode() for path, text in before.items()}
    return held


def test_unity_gets_the_whole_player_and_the_pack(run: Run, pack: Path, tmp_path: Path) -> None:
    project = lay(tmp_path / "game", UNITY)
    code, text, notes = run("drop", pack, "--into", project)
    assert code == 0 and not notes
    held = added(project, UNITY)
    player = {p.removeprefix(f"{PLAYER}/"): data for p, data in held.items() if p.startswith(PLAYER)}
    assert player == assemble("unity"), "file by file what `make dist` packs"
    assert {p for p in held if not p.startswith(PLAYER)} == {"Assets/Avatars/head.avatar", DROPPED.mark}
    assert held["Assets/Avatars/head.avatar"] == packed()
    lines = text.splitlines()
    assert "Unity 2022.3.20f1" in lines[0] and f"{PLAYER}: {len(player)} new" in lines[1]
    assert "Assets/Avatars/head.avatar: new" in lines[2]
    assert [line[:2] for line in lines[4:]] == ["1.", "2.", "3."]


def test_again_after_the_users_change_and_forced(run: Run, small: None, pack: Path, tmp_path: Path) -> None:
    project, player = lay(tmp_path / "game", UNITY), "Packages/avatar-export-player"
    js, words = f"{player}/dist/index.js", ("drop", pack, "--into", project)
    run(*words)
    lay(project, {js: b"mine", "Assets/Avatars/head.avatar.meta": b"guid: 1"})
    pack.write_bytes(packed("Another"))
    code, text, notes = run(*words, "--dry-run")
    assert code == 0 and added(project, UNITY)["Assets/Avatars/head.avatar"] == packed()
    assert [line.split() for line in text.splitlines()[1:]] == [
        ["update", "Assets/Avatars/head.avatar"],
        ["keep", js],
    ]
    assert notes.count("\n") == 1 and js in notes and "--force" in notes
    code, text, again = run(*words)
    assert (code, again) == (0, notes) and f"{player}: 1 kept, 1 unchanged" in text
    held = added(project, UNITY)
    assert held["Assets/Avatars/head.avatar"] == packed("Another")
    assert (held[js], held["Assets/Avatars/head.avatar.meta"]) == (b"mine", b"guid: 1")
    code, text, notes = run(*words, "--force")
    assert code == 0 and not notes and f"{player}: 1 updated, 1 unchanged" in text
    assert added(project, UNITY)[js] == b"export {};\n"


def test_unreal_gets_a_plugin_and_a_file_to_import(run: Run, pack: Path, tmp_path: Path) -> None:
    project = lay(tmp_path / "game", UNREAL)
    code, text, _ = run("drop", pack, "--into", project)
    held = added(project, UNREAL)
    assert code == 0 and "Unreal 5.4" in text and "Avatars/head.avatar" in text
    start = "Plugins/GaussianAvatar/"
    plugin = {path.removeprefix(start): data for path, data in held.items() if path.startswith(start)}
    assert plugin == assemble("unreal") and "GaussianAvatar.uplugin" in plugin
    assert held["Avatars/head.avatar"] == packed()


def test_godot_gets_the_add_on_and_the_pack(built_godot: None, run: Run, pack: Path, tmp_path: Path) -> None:
    project, start = lay(tmp_path / "game", GODOT), "addons/gaussian_avatar/"
    code, text, _ = run("drop", pack, "--into", project)
    held = added(project, GODOT)
    add_on = {path.removeprefix(start): data for path, data in held.items() if path.startswith(start)}
    assert code == 0 and "Godot 4.6" in text and "switch on Gaussian Avatar Player" in text
    assert add_on == assemble("godot") and f'version="{__version__}"' in add_on["plugin.cfg"].decode()
    assert 'name="Gaussian Avatar Player"' in add_on["plugin.cfg"].decode(), "as the steps call it"
    assert {path for path in add_on if path.startswith("bin/")} >= {f"bin/{build.file_name(build.HERE)}"}
    assert held["avatars/head.avatar"] == packed()
    godots = {"avatars/head.avatar.import": b"settings", f"{start}plugin.gd.uid": b"uid://b"}
    lay(project, godots)
    code, text, _ = run("drop", pack, "--into", project)
    assert (
        code == 0 and "avatars/head.avatar: unchanged" in text and added(project, GODOT) == {**held, **godots}
    )


def test_npm_gets_a_tarball_and_the_line_to_run(run: Run, small: None, pack: Path, tmp_path: Path) -> None:
    project = lay(tmp_path / "shop", NPM)
    code, text, _ = run("drop", pack, "--into", project)
    held = added(project, NPM)
    assert code == 0 and set(held) == {"avatar-export-player.tgz", "public/head.avatar", DROPPED.mark}
    with tarfile.open(fileobj=io.BytesIO(held["avatar-export-player.tgz"])) as archive:
        entries = {(e.name, e.mtime, e.uid, e.mode) for e in archive.getmembers()}
        assert entries == {(f"package/{name}", 0, 0, 0o644) for name in ("package.json", "dist/index.js")}
        index = archive.extractfile("package/dist/index.js")
        assert index is not None and index.read() == b"export {};\n"
    assert "npm install ./avatar-export-player.tgz" in text
    code, text, _ = run("drop", pack, "--into", project)
    assert "avatar-export-player.tgz: 1 unchanged" in text, "same files, same bytes"


def test_a_web_folder_gets_a_page(run: Run, pack: Path, tmp_path: Path) -> None:
    project = lay(tmp_path / "site", WEB)
    code, text, notes = run("drop", pack, "--into", project)
    held = added(project, WEB)
    assert code == 0 and {path.split("/")[0] for path in held} == {"head"}
    assert packed() in held.values() and f"head/{MARK}" in held
    assert '<iframe src="head/index.html"' in text and "licence" in notes
    lay(project, {"head/index.html": b"mine", "head/notes.txt": b"mine"})
    code, text, notes = run("drop", pack, "--into", project)
    assert code == 0 and "head/index.html" in notes
    assert "head/index.html: kept" in text and (project / "head/index.html").read_bytes() == b"mine"
    code, text, notes = run("drop", pack, "--into", project, "--force")
    assert "head/index.html" not in notes and added(project, WEB) == {**held, "head/notes.txt": b"mine"}


OLD_UNITY = {**UNITY, "ProjectSettings/ProjectVersion.txt": "m_EditorVersion: 2021.3.5f1\n"}
OLD_UNREAL = {**UNREAL, "Game.uproject": '{"EngineAssociation": "5.3"}'}


@pytest.mark.parametrize(
    ("files", "words", "message"),
    [
        ({"notes.txt": ""}, (), "is not a project of a known engine"),
        ({"game/project.godot": ""}, (), "holds"),
        (OLD_UNITY, (), "2022.3"),
        (OLD_UNREAL, (), "5.4"),
        ({**WEB, "head/mine.txt": "mine"}, (), "is not a published folder"),
        *((UNITY, ("--levels", levels), "--levels") for levels in ("9999999999", "nan", "1,2", "")),
    ],
)
def test_what_is_refused_changes_nothing(
    run: Run, small: None, pack: Path, tmp_path: Path, files: Files, words: tuple[str, ...], message: str
) -> None:
    project = lay(tmp_path / "project", files)
    for more in ((), ("--dry-run",)):
        code, text, error = run("drop", pack, "--into", project, *words, *more)
        assert (code, text) == (2, "") and message in error
    assert added(project, files) == {}


def test_a_source_that_is_unsound_changes_nothing(refused: Refused, small: None, tmp_path: Path) -> None:
    project = lay(tmp_path / "game", UNITY)
    bad = lay(tmp_path, {"bad.avatar": packed()[:900]}) / "bad.avatar"
    for source in (bad, tmp_path / "nowhere", project / "Assets"):
        for dry in ((), ("--dry-run",)):
            refused("drop", source, "--into", project, *dry)
    assert added(project, UNITY) == {}


def test_a_folder_of_a_page_that_is_a_link_is_refused(run: Run, pack: Path, tmp_path: Path) -> None:
    project = lay(tmp_path / "site", WEB)
    run("publish", pack, "-o", tmp_path / "outside")
    (project / "head").symlink_to(tmp_path / "outside")
    before = contents(tmp_path / "outside")
    code, _, error = run("drop", pack, "--into", project, "--force")
    assert code == 2 and "head: is a link" in error
    assert contents(tmp_path / "outside") == before


def test_a_project_that_may_not_be_written(run: Run, small: None, pack: Path, tmp_path: Path) -> None:
    project = lay(tmp_path / "game", UNITY)
    project.chmod(0o555)
    code, _, error = as_anybody(lambda: run("drop", pack, "--into", project))
    assert code == 2 and "cannot be written (Permission denied)" in error
    assert added(project, UNITY) == {}


def test_another_source_is_packed_as_the_engine_wants_it(
    run: Run, small: None, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """How packs are made is tested where it is done, and takes a minute."""
    asked: list[tuple[Avatar, Choices]] = []

    def made(avatar: Avatar, choices: Choices, _: object) -> SimpleNamespace:
        asked.append((avatar, choices))
        return SimpleNamespace(file=packed(avatar.name), notes=(fact("nothing_nearer"),))

    monkeypatch.setattr(drop_contents, "pack_of", made)
    bundle = bundles.write(tmp_path / "bundle")
    for files, frame, path in (
        (UNITY, "left", "Assets/Avatars/anna-bell.avatar"),
        (UNREAL, "right", "Avatars/anna-bell.avatar"),
    ):
        project = lay(tmp_path / frame, files)
        code, text, notes = run("drop", bundle, "--into", project, "--licence", "CC0", "--name", "Anna Bell")
        avatar, choices = asked.pop()
        assert code == 0 and "comes nearer" in notes and f"{path}: new" in text
        assert (choices.handedness, choices.levels) == (frame, (1, 0.5, 0.25))
        assert (avatar.name, avatar.provenance["licence"]) == ("Anna Bell", "CC0")
        assert (project / path).read_bytes() == packed("Anna Bell")
        run("drop", bundle, "--into", project, "--levels", "1,0.3")
        assert asked.pop()[1].levels == (1, 0.3)


def test_an_installation_without_players_says_so(
    refused: Refused, pack: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def missing() -> dict[str, bytes]:
        raise FileNotFoundError("this installation has no files of the unity player")

    monkeypatch.setitem(assembling.PLAYERS, "unity", missing)
    assert "no files of the unity player" in refused("drop", pack, "--into", lay(tmp_path / "game", UNITY))
