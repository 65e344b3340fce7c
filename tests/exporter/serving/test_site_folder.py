"""What `publish` may replace in a folder, and what a full disk or a link leaves there."""

from __future__ import annotations

import errno
import hashlib
import json
import os
import re
from pathlib import Path
from typing import Any

import pytest

from avatar_export.serving.site_folder import MARK, addressed, write_site
from avatar_runtime.io.errors import AvatarError
from tests.folders import contents as everything
from tests.folders import lay

MINE = {
    ".git/config": b"[core]",
    "CNAME": b"example.org",
    "packs/mine.avatar": b"mine",
    "head/notes.txt": b"n",
}


def page(*loaded: str) -> bytes:
    return "".join(f'<a href="{address}">\n' for address in loaded).encode()


def gallery(version: bytes, names: tuple[str, ...]) -> dict[str, bytes]:
    """A site of several pages: each loads a pack and the viewer, the first page links the others."""
    viewer = addressed("viewer/viewer.js", b"viewer " + version)
    files = {viewer: b"viewer " + version}
    for name in names:
        pack = addressed(f"packs/{name}.avatar", name.encode() + version)
        files[pack] = name.encode() + version
        files[f"{name}/index.html"] = page(f"../{pack}", f"../{viewer}")
    return {**files, "index.html": page(*(f"{name}/index.html" for name in names), viewer)}


OLD = gallery(b"1", ("head", "body"))
NEW = gallery(b"2", ("head", "hand"))


def contents(out: Path) -> dict[str, bytes]:
    return {path: data for path, data in everything(out).items() if path != MARK}


def listed(out: Path) -> Any:
    return json.loads((out / MARK).read_text())["files"]


def broken(out: Path) -> list[str]:
    """Pages that load something that is not there, or not with the contents that its name says."""
    wrong = []
    for path in out.rglob("index.html"):
        for address in re.findall(r'href="([^"]+)"', path.read_text()):
            target = path.parent / address
            named = target.name.split(".")[-2]
            whole = target.is_file() and (
                target.name == "index.html"
                or hashlib.sha256(target.read_bytes()).hexdigest().startswith(named)
            )
            wrong += [] if whole else [f"{path.relative_to(out)}: {address}"]
    return wrong


def test_a_folder_is_written_and_its_list_names_every_file(tmp_path: Path) -> None:
    out = tmp_path / "site"
    assert write_site(out, OLD, False) == []
    assert contents(out) == OLD and not broken(out)
    assert listed(out) == {path: [hashlib.sha256(data).hexdigest()] for path, data in OLD.items()}
    with pytest.raises(AvatarError, match="site: exists; pass --force"):
        write_site(out, NEW, False)
    (tmp_path / "empty").mkdir()
    write_site(tmp_path / "empty", OLD, False)
    assert contents(tmp_path / "empty") == OLD


def test_what_is_not_listed_stays(tmp_path: Path) -> None:
    write_site(tmp_path, OLD, False)
    lay(tmp_path, MINE)
    (tmp_path / "drafts").mkdir()
    assert write_site(tmp_path, NEW, True) == []
    assert contents(tmp_path) == {**NEW, **MINE} and (tmp_path / "drafts").is_dir()
    assert not (tmp_path / "body").exists(), "folders that became empty go"
    assert set(listed(tmp_path)) == set(NEW)


def test_a_listed_file_that_the_user_changed_is_kept_and_named(tmp_path: Path) -> None:
    write_site(tmp_path, OLD, False)
    [pack] = [path for path in OLD if path.startswith("packs/body")]
    (tmp_path / pack).write_bytes(b"another body")
    for _ in range(2):
        assert write_site(tmp_path, NEW, True) == [pack], "it stays the user's"
        assert contents(tmp_path) == {**NEW, pack: b"another body"}
    lay(tmp_path, {"head/index.html": b"my own words", pack: b"of a page that has gone"})
    assert write_site(tmp_path, NEW, True, overwrite=True) == [pack]
    assert contents(tmp_path)["head/index.html"] == NEW["head/index.html"]
    (tmp_path / pack).unlink()
    os.mkfifo(tmp_path / pack)
    assert write_site(tmp_path, NEW, True) == [pack], "it is not read"


def test_a_page_that_is_kept_finds_what_it_loads(tmp_path: Path) -> None:
    write_site(tmp_path, OLD, False)
    edited = OLD["head/index.html"] + b"my own words\n"
    (tmp_path / "head/index.html").write_bytes(edited)
    assert write_site(tmp_path, NEW, True) == ["head/index.html"]
    assert not broken(tmp_path)
    assert contents(tmp_path) == {**OLD, **NEW, "head/index.html": edited}
    (tmp_path / "head/index.html").unlink()
    assert write_site(tmp_path, NEW, True) == []
    assert contents(tmp_path) == NEW, "what only the kept page loaded goes with it"


def test_a_file_of_the_user_is_not_overwritten(tmp_path: Path) -> None:
    write_site(tmp_path, OLD, False)
    before = contents(tmp_path)
    lay(tmp_path, {"hand/index.html": b"mine"})
    with pytest.raises(AvatarError, match=r"hand/index\.html: is not a file that was published here"):
        write_site(tmp_path, NEW, True)
    assert contents(tmp_path) == {**before, "hand/index.html": b"mine"}


FORMAT = "avatar-export-site"
NO_LIST = "holds no list of the published files"


@pytest.mark.parametrize(
    ("mark", "message"),
    [
        (None, "exists and is not a published folder"),
        ("{}", NO_LIST),
        ("[]", NO_LIST),
        ("\0", "is not JSON"),
        ("[" * 100_000, "is not JSON"),
        (json.dumps({"format": FORMAT, "generator": "avatar-export 0.9"}), "older avatar-export"),
        (json.dumps({"files": {}}), NO_LIST),
        (json.dumps({"format": FORMAT, "files": {"index.html": 7}}), "has no list of SHA-256"),
        (json.dumps({"format": FORMAT, "files": {"index.html": ["x"]}}), "has no list of SHA-256"),
    ],
)
def test_a_folder_without_a_sound_list_is_refused(tmp_path: Path, mark: str | None, message: str) -> None:
    lay(tmp_path, {**MINE, "index.html": b"mine"})
    if mark is not None:
        (tmp_path / MARK).write_text(mark)
    with pytest.raises(AvatarError, match=message) as refused:
        write_site(tmp_path, NEW, True)
    assert mark is None or "(.git, CNAME)" in str(refused.value)
    assert contents(tmp_path) == {**MINE, "index.html": b"mine"}


SECRET = hashlib.sha256(b"secret").hexdigest()


@pytest.mark.parametrize(
    "path",
    ["../secret", "packs/../../secret", "/etc/passwd", "{outside}", "C:\\secret", "packs\\..\\secret", "packs//x",
     ".", "", "packs/..", "packs/.", "../index.html", "packs/a/b", ".git/config", "CNAME",
     "index.html\n", "packs/a\0b", "a/b/index.html",
     "~/secret", "file:///secret"],
)  # fmt: skip
def test_a_list_may_name_nothing_else(tmp_path: Path, path: str) -> None:
    out = tmp_path / "site"
    lay(tmp_path, dict.fromkeys(("secret", "index.html", "site/CNAME", "site/.git/config"), b"secret"))
    text = {"format": FORMAT, "files": {path.format(outside=tmp_path / "secret"): [SECRET]}}
    (out / MARK).write_text(json.dumps(text))
    before = contents(tmp_path)
    with pytest.raises(AvatarError, match="which `publish` never writes"):
        write_site(out, NEW, True)
    assert contents(tmp_path) == before


@pytest.mark.parametrize("link", ["packs", "packs/secret", "index.html", "head"])
def test_links_lead_nowhere(tmp_path: Path, link: str) -> None:
    """A listed file behind a link is outside of the folder, whatever its hash: it is not read as ours, nor written."""
    out, outside = tmp_path / "site", tmp_path / "outside"
    lay(outside, {"secret": b"secret", "index.html": b"secret"})
    write_site(out, {"viewer/x": b"x"}, False)
    whole_folder = "/" not in link and link != "index.html"
    (out / link).parent.mkdir(exist_ok=True)
    (out / link).symlink_to(outside if whole_folder else outside / "secret")
    paths = {"packs/secret", "head/index.html", "index.html"}
    (out / MARK).write_text(json.dumps({"format": FORMAT, "files": {path: [SECRET] for path in paths}}))
    before = contents(outside)
    for files in (NEW, {"viewer/y": b"y"}):
        try:
            kept = write_site(out, files, True)
            assert any(path.startswith(link) for path in kept)
        except AvatarError as error:
            assert "is not a file that was published here" in str(error)
    assert contents(outside) == before and (out / link).is_symlink()


@pytest.mark.parametrize("begun", [True, False])
def test_a_full_disk_changes_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, begun: bool) -> None:
    out = tmp_path / "site"
    if begun:
        write_site(out, OLD, False)
    write = Path.write_bytes

    def full(path: Path, data: bytes) -> int:
        if NEW["index.html"] == data:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        return write(path, data)

    monkeypatch.setattr(Path, "write_bytes", full)
    before = everything(tmp_path)
    with pytest.raises(AvatarError, match=r"site: cannot be written \(No space left on device"):
        write_site(out, NEW, True)
    assert out.exists() == begun and everything(tmp_path) == before
