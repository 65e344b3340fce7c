"""What `drop` may replace in a project, and what a kill, a full disk or a link leaves there."""

from __future__ import annotations

import errno
import json
import os
import shutil
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path

import pytest

from avatar_export.drop.placing import DROPPED, Delivery, Plan, mend, place, planned
from avatar_runtime.io.errors import AvatarError
from tests.exporter.drop.projects import UNITY
from tests.folders import contents, lay
from tests.session.rights import as_anybody

BASE = "Packages/com.x.player"
PACK = "Assets/Avatars/head.avatar"


def player(version: bytes, *more: str) -> dict[str, bytes]:
    """A player of a few files: one that never changes, others that do, and `more`."""
    paths = ("package.json", "package.json.meta", "Core.meta", "Core/Pack.cs", "Core/Pack.cs.meta", *more)
    return {"LICENSE.md": b"MIT", **{path: path.encode() + version for path in paths}}


OLD = Delivery(BASE, player(b"1", "Core/Old.cs", "Core/Old.cs.meta"), {PACK: b"pack 1"}, "Assets")
NEW = Delivery(BASE, player(b"2", "Core/New.cs", "Core/New.cs.meta"), {PACK: b"pack 2"}, "Assets")
MINE = {  # of the user, in a project into which something was dropped
    f"{PACK}.meta": b"guid of the pack",
    "Assets/Avatars.meta": b"guid of a folder",
    "Assets/Scenes/Mine.unity": b"scene",
    f"{BASE}/Core/Mine.cs": b"my script",
    f"{BASE}/Core/Mine.cs.meta": b"guid of my script",
}


def put(project: Path, delivery: Delivery, force: bool = False) -> Plan:
    mend(project, delivery)
    plan = planned(project, delivery, force)
    place(project, delivery, plan)
    return plan


def files_of(delivery: Delivery) -> dict[str, bytes]:
    made = {path: data for path, data in delivery.files.items() if data is not None}
    return {f"{delivery.folder}/{path}": data for path, data in delivery.player.items()} | made


def found(project: Path) -> dict[str, bytes]:
    return {p: d for p, d in contents(project).items() if p not in UNITY and p != DROPPED.mark}


@pytest.fixture
def project(tmp_path: Path) -> Path:
    return lay(tmp_path / "game", UNITY)


def changed(plan: Plan) -> dict[str, str]:
    return {path: word for path, word in plan.words.items() if word != "same"}


def test_the_first_time_and_what_was_deleted(project: Path) -> None:
    plan = put(project, OLD)
    assert found(project) == files_of(OLD) and set(changed(plan).values()) == {"new"}
    assert set(json.loads((project / DROPPED.mark).read_text())["files"]) == set(files_of(OLD))
    held = contents(project)
    assert {path: held[path] for path in UNITY} == {path: text.encode() for path, text in UNITY.items()}
    (project / BASE / "Core/Pack.cs").unlink()
    (project / PACK).unlink()
    put(project, OLD)
    assert contents(project) == held


def test_again_with_the_same_changes_nothing(project: Path) -> None:
    """And needs no rights; a plan changes nothing either."""
    put(project, OLD)
    before = {path: path.stat().st_mtime_ns for path in project.rglob("*")}
    planned(project, Delivery(BASE, NEW.player, {PACK: None}), False)
    project.chmod(0o555)
    try:
        assert changed(as_anybody(lambda: put(project, OLD))) == {}
    finally:
        project.chmod(0o755)
    assert {path: path.stat().st_mtime_ns for path in project.rglob("*")} == before


def test_again_updates_both_and_keeps_what_is_the_users(project: Path) -> None:
    put(project, OLD)
    lay(project, MINE)
    (project / BASE / "Binaries/Empty").mkdir(parents=True)
    kept = (project / BASE / "LICENSE.md").stat().st_mtime_ns
    plan = put(project, NEW)
    assert found(project) == {**files_of(NEW), **MINE} and plan.kept == []
    assert changed(plan)[f"{BASE}/Core/Old.cs"] == "remove"
    assert (project / BASE / "Binaries/Empty").is_dir()
    assert (project / BASE / "LICENSE.md").stat().st_mtime_ns == kept, "an engine builds again what is newer"


def test_what_the_user_changed_is_named_and_kept_unless_forced(project: Path) -> None:
    put(project, OLD)
    edits = {f"{BASE}/Core/Pack.cs": b"my line", f"{BASE}/Core/Old.cs": b"my other line", PACK: b"my pack"}
    lay(project, edits)
    for _ in range(2):  # it stays the user's
        assert sorted(put(project, NEW).kept) == sorted(edits)
        meta = {f"{BASE}/Core/Old.cs.meta": b"Core/Old.cs.meta1"}
        assert found(project) == {**files_of(NEW), **edits, **meta}, "a meta stays with its file"
    assert put(project, NEW, force=True).kept == []
    assert found(project) == files_of(NEW)


def test_a_folder_that_the_player_no_longer_has_stays_for_what_is_the_users(project: Path) -> None:
    more = {"Extra.meta": b"guid", "Extra/a.cs": b"a", "Extra/a.cs.meta": b"guid of a"}
    put(project, Delivery(BASE, {**OLD.player, **more}, OLD.files))
    lay(project, {f"{BASE}/Extra/Mine.cs": b"mine"})
    put(project, OLD)
    stays = {f"{BASE}/Extra/Mine.cs": b"mine", f"{BASE}/Extra.meta": b"guid"}
    assert found(project) == {**files_of(OLD), **stays}
    shutil.rmtree(project / BASE / "Extra")
    put(project, OLD)
    assert found(project) == files_of(OLD)


@pytest.mark.parametrize("force", [False, True])
def test_a_changed_meta_stays_without_a_word(project: Path, force: bool) -> None:
    """Unity writes them anew, with the user's import settings; scenes refer to the GUID in them."""
    put(project, OLD)
    metas = {f"{BASE}/Core/Pack.cs.meta": b"settings", f"{BASE}/Core/Old.cs.meta": b"settings"}
    lay(project, metas)
    assert put(project, NEW, force).kept == []
    assert found(project) == {**files_of(NEW), f"{BASE}/Core/Pack.cs.meta": b"settings"}, (
        "a meta goes with its file"
    )


def test_a_pack_is_followed_where_the_user_moved_it(project: Path) -> None:
    put(project, OLD)
    moved = project / "Assets/People/Anna.avatar"
    moved.parent.mkdir()
    (project / PACK).rename(moved)
    for delivery in (NEW, OLD):
        plan = put(project, delivery)
        assert plan.at[PACK] == "Assets/People/Anna.avatar"
        assert not (project / PACK).exists() and moved.read_bytes() == delivery.files[PACK]
    (moved.parent / "Copy.avatar").write_bytes(moved.read_bytes())
    put(project, NEW)
    assert (project / PACK).read_bytes() == b"pack 2", "two places: nobody knows which is meant"
    assert moved.read_bytes() == b"pack 1"


def test_a_player_that_was_not_dropped_is_refused_unless_forced(project: Path) -> None:
    lay(project, {f"{BASE}/package.json": b"copied by hand", f"{BASE}/Mine.cs": b"mine"})
    before = found(project)
    with pytest.raises(AvatarError, match=r"com\.x\.player: holds files that `drop` did not put there"):
        put(project, NEW)
    assert found(project) == before
    put(project, NEW, force=True)
    assert found(project) == {**files_of(NEW), f"{BASE}/Mine.cs": b"mine"}
    put(project, Delivery(BASE, NEW.player, {"Assets/Avatars/body.avatar": b"body"}))
    assert found(project)[PACK] == b"pack 2", "another avatar stays"


LINKS = {  # where a link is: the message
    "Packages": "Packages: is a link or no folder",
    BASE: "player: is a link or no folder",
    f"{BASE}/Core": "Core: is a link or no file",
    f"{BASE}/package.json": "package.json: is a link or no file",
    f"{BASE}/more": "more: is a link or no file",  # beside the player's files
    "Assets": "Assets: is a link or no folder",
    "Assets/Avatars": "Avatars: is a link or no folder",
    PACK: "head.avatar: is a link or a folder",
    DROPPED.mark: "avatar-export-drop.json: is not a plain file",
}


@pytest.mark.parametrize("dropped", [False, True])
@pytest.mark.parametrize("path", LINKS)
def test_links_that_lead_out_are_refused(project: Path, tmp_path: Path, path: str, dropped: bool) -> None:
    if dropped:
        put(project, OLD)
    at, outside = project / path, tmp_path / "outside"
    at.parent.mkdir(parents=True, exist_ok=True)
    if at.exists():
        at.rename(outside)
    else:
        outside.mkdir()
        (outside / "file").write_text("mine")
    at.symlink_to(outside)
    before = contents(tmp_path)
    with pytest.raises(AvatarError, match=LINKS[path]):
        put(project, NEW, force=True)
    assert contents(tmp_path) == before and at.is_symlink()
    at.unlink()
    os.mkfifo(at)
    with pytest.raises(AvatarError, match=LINKS[path]):
        put(project, NEW, force=True)


def listing(path: str, hashes: object) -> str:
    return json.dumps({"format": "avatar-export-drop", "files": {path: hashes}})


OUTSIDE = ("../x", "a/../../x", "/etc/passwd", "a//b", "a\\..\\x", "C:/x", ".", "", "a/", "a\nb", "x/..")


@pytest.mark.parametrize(
    ("mark", "message"),
    [
        ("{", "is not JSON"),
        ("{}", "holds no list"),
        *((listing(path, ["0" * 64]), "which `drop` never writes") for path in OUTSIDE),
        (listing("a/b c.d", 7), "has no list of SHA-256"),
    ],
)
def test_an_unsound_list_is_refused(project: Path, mark: str, message: str) -> None:
    lay(project, {DROPPED.mark: mark})
    before = contents(project)
    with pytest.raises(AvatarError, match=message):
        put(project, NEW, force=True)
    assert contents(project) == before


@pytest.mark.parametrize("dropped", [False, True])
@pytest.mark.parametrize("fails", ["Core/New.cs2", "pack 2", '"files": {'])
def test_a_full_disk_changes_nothing(
    project: Path, monkeypatch: pytest.MonkeyPatch, dropped: bool, fails: str
) -> None:
    if dropped:
        put(project, OLD)
        lay(project, MINE)
    before, write = contents(project), Path.write_bytes

    def full(path: Path, data: bytes) -> int:
        if fails.encode() in data:
            write(path, data[:3])
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        return write(path, data)

    monkeypatch.setattr(Path, "write_bytes", full)
    with pytest.raises(AvatarError, match=r"game: cannot be written \(No space left on device\)"):
        put(project, NEW)
    assert contents(project) == before
    assert (project / "Assets/Avatars").exists() == dropped


@pytest.mark.parametrize("dropped", [False, True])
@pytest.mark.parametrize("shut", ["", "Packages", "Assets"])
def test_a_folder_that_may_not_be_written(project: Path, shut: str, dropped: bool) -> None:
    if dropped and shut == "Assets":
        shut = "Assets/Avatars"
        put(project, Delivery(BASE, NEW.player, OLD.files))  # the player is what it will be
    elif dropped:
        put(project, OLD)
    before = contents(project)
    (project / shut).chmod(0o555)
    try:
        with pytest.raises(AvatarError, match=r"game: cannot be written \(Permission denied\)"):
            as_anybody(lambda: put(project, NEW))
    finally:
        (project / shut).chmod(0o755)
    assert contents(project) == before


def test_two_that_drop_at_once_do_not_mix(project: Path) -> None:
    put(project, OLD)
    other = project / f".{DROPPED.mark}.{os.getppid()}.partial"
    other.mkdir()
    with pytest.raises(AvatarError, match=f"another process .*{other.name}"):
        put(project, NEW)
    other.rmdir()
    assert found(project) == files_of(OLD)


KILLED = """
import os, sys
from pathlib import Path
from avatar_runtime.io import staging
from tests.exporter.drop import test_placing as t
from tests.exporter.drop.projects import UNITY
from tests.folders import lay
from tests.session.kills import killed_before

os.fsync = lambda file: None  # a kill, unlike a power cut, loses nothing that was written
if sys.argv[2] == "steps":
    staging.exchange = lambda one, other: False  # as on Windows
for first in (False, True):
    at = 0
    while True:
        project = lay(Path(sys.argv[1]) / f"{first}{at}", UNITY)
        if not first:
            t.put(project, t.OLD)
            lay(project, t.MINE)
        killed = killed_before(at, lambda: t.put(project, t.NEW))
        t.check_whole(project, first, sys.argv[2] == "steps")
        if not killed:
            break
        t.put(project, t.NEW)
        found = t.found(project)
        assert found == {**t.files_of(t.NEW), **({} if first else t.MINE)}, (first, at, found)
        at += 1
    print(at)
"""


def check_whole(project: Path, first: bool, steps: bool) -> None:
    """Each of player and pack is old or new, with the user's files beside it, after a kill at any moment."""
    mine: Mapping[str, bytes] = {} if first else MINE
    held = {path: data for path, data in found(project).items() if not path.startswith(".avatar-export-drop")}
    for start in (f"{BASE}/", PACK):
        own, old, new, of_user = (
            {path: data for path, data in files.items() if path.startswith(start)}
            for files in (held, files_of(OLD), files_of(NEW), mine)
        )
        whole = [{**new, **of_user}, {} if first else {**old, **of_user}]
        assert own in whole or (steps and start != PACK and not own), (start, own)
    assert [p for p, d in mine.items() if not p.startswith(BASE) and held[p] != d] == []


@pytest.mark.parametrize("way", ["exchange", "steps"])
def test_a_kill_at_any_moment_leaves_player_and_pack_whole(tmp_path: Path, way: str) -> None:
    """Killed before each change of the disk; the next run finishes the work and leaves nothing over."""
    said = subprocess.check_output([sys.executable, "-c", KILLED, tmp_path, way], text=True)
    assert min(map(int, said.split())) > 20, "every change was a moment of a kill"
