"""Players in wheels and in archives: what a checkout puts together, byte for byte."""

from __future__ import annotations

import hashlib
import io
import json
import os
import shutil
import tarfile
import zipfile
from collections.abc import Mapping
from pathlib import Path

import pytest

from avatar_export.players import godot, web
from avatar_export.players.assemble import PLAYERS, assemble
from avatar_runtime.io.errors import AvatarError
from avatar_schema.version import __version__
from tests.folders import lay
from tests.packaging.environments import empty
from tests.players.web import WEB
from tools import archives, dist

ASSEMBLE = """
import hashlib, json
from avatar_export.players.assemble import PLAYERS, assemble
print(json.dumps({p: {n: hashlib.sha256(d).hexdigest() for n, d in assemble(p).items()} for p in PLAYERS}))
"""
TOPS = {
    "unity": "package",
    "unreal": "GaussianAvatar",
    "godot": "addons/gaussian_avatar",
    "web": "package",
    "native": f"avatar-player-{__version__}",
}


def hashes(files: Mapping[str, bytes]) -> dict[str, str]:
    return {name: hashlib.sha256(data).hexdigest() for name, data in files.items()}


def test_installed_wheels_put_every_player_together(wheels: dict[str, Path], tmp_path: Path) -> None:
    """Without the checkout, Node and a network."""
    environment = empty(tmp_path)
    given = dist.distributions().values()
    environment.lend(
        {dist.Requirement(line).name for one in given for line in one.dependencies} - wheels.keys()
    )
    environment.install(*wheels.values())
    found = json.loads(environment.script(ASSEMBLE))
    assert found == {player: hashes(assemble(player)) for player in PLAYERS}


@pytest.fixture(scope="module")
def written(built_godot: None, built_web: None, tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("archives")
    archives.write(out)
    return out


@pytest.mark.parametrize("player", PLAYERS)
def test_an_archive_holds_what_is_put_together(player: str, written: Path) -> None:
    name, end, _ = archives.ARCHIVES[player]
    data = (written / f"{name}-{__version__}{end}").read_bytes()
    expected = {f"{TOPS[player]}/{path}": content for path, content in assemble(player).items()}
    assert unpacked(data, end) == expected
    assert data == archives.ARCHIVES[player][2](assemble(player))


def unpacked(data: bytes, end: str) -> dict[str, bytes]:
    if end == ".zip":
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            return {entry.filename: archive.read(entry) for entry in archive.infolist()}
    with tarfile.open(fileobj=io.BytesIO(data)) as archive:
        assert all(entry.mtime == 0 and not entry.uname for entry in archive)
        return {entry.name: stream.read() for entry in archive if (stream := archive.extractfile(entry))}


@pytest.fixture(scope="module")
def package(built_web: None) -> dict[str, bytes]:
    return assemble("web")


def test_what_it_exports_is_in_it(package: dict[str, bytes]) -> None:
    manifest = json.loads(package["package.json"])
    for entry in manifest["exports"].values():
        assert {path.removeprefix("./") for path in entry.values()} <= package.keys()
    assert manifest["version"] == __version__ and list(manifest)[:2] == ["name", "version"]


def test_it_carries_its_licence_and_the_notices_of_its_wasm_and_its_sample(package: dict[str, bytes]) -> None:
    assert package["LICENSE"] == (WEB.parents[1] / "LICENSE").read_bytes()
    notice, of_all = package["NOTICE.md"].decode(), (WEB.parents[1] / "NOTICE.md").read_text("utf-8")
    for owner in ("Copyright (c) Zig contributors", "Rich Felker", "Lee Perry-Smith", "ICT-FaceKit"):
        assert owner in notice and owner in of_all


SOURCE, LIBRARY = "extension/core.cpp", "bin/libgaussian_avatar.linux.x86_64.so"


@pytest.mark.parametrize(
    ("held", "said"),
    [
        ((LIBRARY, SOURCE), f"was built before its sources changed: {godot.BUILD}"),
        ((SOURCE,), f"is not built: {godot.BUILD}"),
        ((), f"is not built: {godot.BUILD} in a checkout, and install that"),
    ],
)
def test_an_add_on_for_godot_without_its_libraries_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, held: tuple[str, ...], said: str
) -> None:
    root = lay(tmp_path / "godot", dict.fromkeys(("plugin.cfg", *held), "version"))
    for second, name in enumerate(held):
        os.utime(root / name, (second, second))
    monkeypatch.setattr(godot, "folder", lambda _: root)
    with pytest.raises(AvatarError, match=f"^bin: the add-on for Godot {said}$"):
        godot.godot_files()


def test_an_unbuilt_and_an_outdated_package_are_refused(
    built_web: None, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    shutil.copytree(WEB, tmp_path / "web", ignore=lambda *_: ["node_modules", "tests"], symlinks=True)
    monkeypatch.setattr(web, "folder", lambda _: tmp_path / "web")
    assert web.web_files()
    later = 2 * (tmp_path / "web" / "dist" / "index.js").stat().st_mtime_ns
    os.utime(tmp_path / "web" / "src" / "pose" / "pose.ts", ns=(later, later))
    with pytest.raises(AvatarError, match=r"^dist: .* built before its sources changed"):
        web.web_files()
    shutil.rmtree(tmp_path / "web" / "dist")
    with pytest.raises(AvatarError, match=r"^dist: .* is not built"):
        web.web_files()
