"""The npm package as it is put together: complete, with its licences, and as npm itself would pack it."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
from pathlib import Path

import pytest

from avatar_export.players import web
from avatar_export.players.assemble import assemble
from avatar_runtime.io.errors import AvatarError
from avatar_schema.version import __version__
from tests.players.web import WEB


@pytest.fixture(scope="module")
def package(built_web: None) -> dict[str, bytes]:
    return assemble("web")


def test_npm_would_pack_the_same_files(package: dict[str, bytes], tmp_path: Path) -> None:
    for name, data in package.items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_bytes(data)
    command = [str(shutil.which("npm")), "pack", "--dry-run", "--json", "--ignore-scripts"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=True)
    [packed] = json.loads(done.stdout)
    assert packed["filename"] == f"avatar-export-player-{__version__}.tgz"
    assert {file["path"] for file in packed["files"]} == set(package)


def test_what_it_exports_is_in_it(package: dict[str, bytes]) -> None:
    manifest = json.loads(package["package.json"])
    for entry in manifest["exports"].values():
        assert {path.removeprefix("./") for path in entry.values()} <= package.keys()
    assert manifest["version"] == __version__ and list(manifest)[:2] == ["name", "version"]


def test_it_carries_its_licence_and_the_notices_of_what_its_wasm_contains(package: dict[str, bytes]) -> None:
    assert package["LICENSE"] == (WEB.parents[1] / "LICENSE").read_bytes()
    notice, of_all = package["NOTICE.md"].decode(), (WEB.parents[1] / "NOTICE.md").read_text("utf-8")
    for owner in ("Copyright (c) Zig contributors", "Rich Felker"):
        assert owner in notice and owner in of_all


def test_peers_are_the_minors_that_are_tested() -> None:
    manifest = json.loads((WEB / "package.json").read_text("utf-8"))
    for name, wanted in manifest["peerDependencies"].items():
        major, minor, _ = manifest["devDependencies"][name].split(".")
        assert wanted.startswith(f"~{major}.{minor}."), name


def test_an_unbuilt_and_an_outdated_package_are_refused(
    built_web: None, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    shutil.copytree(WEB, tmp_path / "web", ignore=lambda *_: ["node_modules", "tests"], symlinks=True)
    monkeypatch.setattr(web, "folder", lambda _: tmp_path / "web")
    assert web.web_files()
    later = 2 * (tmp_path / "web" / "dist" / "index.js").stat().st_mtime_ns
    os.utime(tmp_path / "web" / "src" / "pose" / "pose.ts", ns=(later, later))
    with pytest.raises(
        AvatarError, match=r"^dist: the web player was built before its sources changed: with Node"
    ):
        web.web_files()
    shutil.rmtree(tmp_path / "web" / "dist")
    with pytest.raises(
        AvatarError, match=r"^dist: the web player is not built: with Node, run `npm ci` and `npm run build`"
    ):
        web.web_files()
