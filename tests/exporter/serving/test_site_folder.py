"""What `publish` may replace in a folder, and what a kill leaves there."""

from __future__ import annotations

import errno
import hashlib
import json
import os
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from avatar_export.serving.site_folder import MARK, addressed, write_site
from avatar_runtime.io.errors import AvatarError

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


def lay(out: Path, files: dict[str, bytes]) -> None:
    for name, data in files.items():
        (out / name).parent.mkdir(parents=True, exist_ok=True)
        (out / name).write_bytes(data)


def contents(out: Path) -> dict[str, bytes]:
    """Every file but the list."""
    found = {p.relative_to(out).as_posix(): p.read_bytes() for p in out.rglob("*") if p.is_file()}
    found.pop(MARK, None)
    return found


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
    assert write_site(tmp_path, NEW, True) == [pack]
    assert contents(tmp_path) == {**NEW, pack: b"another body"}
    assert write_site(tmp_path, NEW, True) == [pack], "it stays the user's"


def test_a_changed_file_is_replaced_where_that_is_asked_for(tmp_path: Path) -> None:
    write_site(tmp_path, OLD, False)
    lay(tmp_path, {"head/index.html": b"my own words", "body/index.html": b"of a page that goes"})
    assert write_site(tmp_path, NEW, True, overwrite=True) == ["body/index.html"]
    assert (tmp_path / "head/index.html").read_bytes() == NEW["head/index.html"]


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
    with pytest.raises(
        AvatarError, match=r"hand/index\.html: is not a file that was published here; move it away"
    ):
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
        (
            json.dumps({"format": FORMAT, "generator": "avatar-export 0.9"}),
            f"{NO_LIST}, as of an older avatar-export",
        ),
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
    assert mark is None or "move away what is yours (.git, CNAME), delete the rest" in str(refused.value)
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
    lay(
        tmp_path,
        {
            "secret": b"secret",
            "index.html": b"secret",
            "site/CNAME": b"secret",
            "site/.git/config": b"secret",
        },
    )
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


def test_a_device_in_the_place_of_a_file_is_not_read(tmp_path: Path) -> None:
    write_site(tmp_path, OLD, False)
    [pack] = [path for path in OLD if path.startswith("packs/body")]
    (tmp_path / pack).unlink()
    os.mkfifo(tmp_path / pack)
    assert write_site(tmp_path, NEW, True) == [pack]


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
    with pytest.raises(AvatarError, match=r"site: cannot be written \(No space left on device"):
        write_site(out, NEW, True)
    assert out.exists() == begun and contents(tmp_path) == {
        f"site/{p}": d for p, d in OLD.items() if begun
    } | ({f"site/{MARK}": (out / MARK).read_bytes()} if begun else {})


def test_two_that_publish_at_once_do_not_mix(tmp_path: Path) -> None:
    write_site(tmp_path, OLD, False)
    other = tmp_path / f".{MARK}.{os.getppid()}.partial"
    other.mkdir()
    with pytest.raises(
        AvatarError, match=f"another process publishes here; if none runs, delete {other.name}"
    ):
        write_site(tmp_path, NEW, True)
    other.rmdir()
    assert contents(tmp_path) == OLD


KILLED = """
import sys
from pathlib import Path
from avatar_export.serving import site_folder
from tests.exporter.serving.test_site_folder import NEW, OLD, broken, contents, lay, MINE
from tests.session.kills import killed_before

top = Path(sys.argv[1])
for first in (False, True):
    at = 0
    while True:
        out = top / f"{first}{at}"
        if not first:
            site_folder.write_site(out, OLD, False)
            lay(out, MINE)
        killed = killed_before(at, lambda: site_folder.write_site(out, NEW, not first))
        mine = {} if first else MINE
        assert not broken(out), (first, at, broken(out))
        found = contents(out)
        assert {path: found.get(path) for path in mine} == mine, (first, at)
        if not first:
            assert found["index.html"] in (OLD["index.html"], NEW["index.html"]), (first, at)
        if not killed:
            assert found == {**NEW, **mine}
            break
        assert site_folder.write_site(out, NEW, True) == []
        assert contents(out) == {**NEW, **mine}, (first, at, set(contents(out)) - {*NEW, *mine})
        at += 1
    print(at)
"""


def test_a_kill_at_any_moment_leaves_every_page_whole(tmp_path: Path) -> None:
    """Killed before each change of the disk; the next `publish --force` finishes the work and leaves nothing over."""
    done = subprocess.run(
        [sys.executable, "-c", KILLED, tmp_path], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    again, first = map(int, done.stdout.split())
    assert again > 2 * len(NEW) and first > len(NEW), "every change was a moment of a kill"
