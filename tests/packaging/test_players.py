"""Players in wheels and in archives: what a checkout puts together, byte for byte."""

from __future__ import annotations

import hashlib
import io
import json
import tarfile
import zipfile
from collections.abc import Mapping
from pathlib import Path

import pytest

from avatar_export.players.assemble import PLAYERS, assemble
from avatar_schema.version import __version__
from tests.packaging.environments import empty
from tools import archives, dist

ASSEMBLE = """
import hashlib, json
from avatar_export.players.assemble import PLAYERS, assemble
print(json.dumps({p: {n: hashlib.sha256(d).hexdigest() for n, d in assemble(p).items()} for p in PLAYERS}))
"""
TOPS = {
    "unity": "package",
    "unreal": "GaussianAvatar",
    "native": f"avatar-player-{__version__}",
    "web": "package",
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
def written(built_web: None, tmp_path_factory: pytest.TempPathFactory) -> Path:
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


def test_the_tree_for_unity_is_the_package(written: Path) -> None:
    tree = written / archives.TREE
    files = {
        path.relative_to(tree).as_posix(): path.read_bytes() for path in tree.rglob("*") if path.is_file()
    }
    assert files == assemble("unity")


def test_an_archive_replaces_those_of_other_versions(written: Path) -> None:
    (written / "GaussianAvatar-0.0.9.zip").write_bytes(b"old")
    (written / archives.TREE / "gone.cs").write_bytes(b"old")
    files = archives.write(written)
    assert set(written.iterdir()) == {*files, written / archives.TREE}
    assert not (written / archives.TREE / "gone.cs").exists()
