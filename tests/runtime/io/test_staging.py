"""Outputs appear whole or not at all: kills at every step, two writers at once, links that lead to themselves."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from avatar_runtime.io import staging
from avatar_runtime.io.errors import AvatarError
from avatar_runtime.io.exchange import exchange
from avatar_runtime.io.staging import followed, heal, move, partial_of, staged
from avatar_runtime.io.text_files import write_bytes

KILLED = 9


def put(path: Path, text: str, folder: bool) -> None:
    """One file, or a folder with a folder and a file in it."""
    if folder:
        (path / "inner").mkdir(parents=True)
        (path / "inner" / "file").write_text(text)
    else:
        path.write_text(text)


def got(path: Path, folder: bool) -> str:
    return (path / "inner" / "file" if folder else path).read_text()


def dies(*_: object, **__: object) -> Any:
    os._exit(KILLED)


def killed(work: Callable[[], object]) -> None:
    """Runs `work` in a process of its own, which must end by `dies`."""
    child = os.fork()
    if not child:
        try:
            work()
        finally:
            os._exit(0)
    assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == KILLED


def without_exchange(*_: object) -> bool:
    return False


def dying_after(count: int) -> Callable[..., Any]:
    """Path.rename that works `count` times, then kills the process."""
    rename, left = Path.rename, [count]

    def patched(self: Path, target: Path) -> Path:
        if not left[0] and self.exists():
            dies()
        left[0] -= 1
        return rename(self, target)

    return patched


def replacing(out: Path, folder: bool) -> Callable[[], None]:
    def work() -> None:
        with staged(out, force=True) as partial:
            put(partial, "new", folder)

    return work


# kill: what stands in place of functions of staging. `rename`: how often Path.rename works; its first call, which names
# `out` where nothing is, fails.
KILLS: dict[str, dict[str, Any]] = {
    "before the exchange": {"exchange": dies},
    "after the exchange": {"exchange": lambda one, other: exchange(one, other) and dies()},
    "while the older one is removed": {"remove": dies},
    "between two renames": {"exchange": without_exchange, "rename": 2},
    "before two renames": {"exchange": without_exchange, "rename": 1},
    "after two renames": {"exchange": without_exchange, "remove": dies},
    "before anything is synced": {"sync": dies},
}


@pytest.mark.parametrize("name", KILLS)
def test_a_kill_loses_neither_the_older_nor_the_newer_one(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    out = tmp_path / "out"
    put(out, "old", folder=True)
    with monkeypatch.context() as patched:
        for attribute, value in KILLS[name].items():
            if attribute == "rename":
                patched.setattr(Path, "rename", dying_after(value))
            else:
                patched.setattr(staging, attribute, value)
        killed(replacing(out, folder=True))
    heal(out)
    assert got(out, folder=True) == ("new" if name.split()[0] in ("after", "while") else "old")
    assert os.listdir(tmp_path) == ["out"]


@pytest.mark.parametrize("folder", [False, True], ids=["file", "folder"])
@pytest.mark.parametrize("can", [False, True], ids=["renamed", "exchanged"])
def test_an_older_one_is_replaced(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, folder: bool, can: bool
) -> None:
    if not can:
        monkeypatch.setattr(staging, "exchange", without_exchange)
    out = tmp_path / "out"
    put(out, "old", folder)
    replacing(out, folder)()
    assert got(out, folder) == "new" and os.listdir(tmp_path) == ["out"]


def test_what_cannot_be_replaced_is_put_back(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(staging, "exchange", without_exchange)
    rename = Path.rename

    def fails(self: Path, target: Path) -> Path:
        if self.suffix == ".partial":
            raise OSError(13, "Permission denied")
        return rename(self, target)

    out = tmp_path / "out"
    put(out, "old", folder=True)
    monkeypatch.setattr(Path, "rename", fails)
    with pytest.raises(AvatarError, match="cannot be written"):
        replacing(out, folder=True)()
    assert got(out, folder=True) == "old" and os.listdir(tmp_path) == ["out"]


@pytest.mark.parametrize("folder", [False, True], ids=["file", "folder"])
def test_of_two_writers_the_second_is_told(tmp_path: Path, folder: bool) -> None:
    out = tmp_path / "out"
    with (
        pytest.raises(AvatarError, match="written by another process meanwhile"),
        staged(out, force=False) as partial,
    ):
        put(partial, "second", folder)
        other = tmp_path / "other"
        put(other, "first", folder)
        move(other, out, force=False)
    assert got(out, folder) == "first" and os.listdir(tmp_path) == ["out"]


def test_without_hard_links_a_file_is_renamed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def unsupported(*_: object) -> None:
        raise OSError(1, "Operation not permitted")

    monkeypatch.setattr(os, "link", unsupported)
    out = tmp_path / "out"
    write_bytes(out, b"one", force=False)
    with pytest.raises(AvatarError, match="meanwhile"):
        write_bytes(out, b"two", force=False)
    assert out.read_bytes() == b"one"
    write_bytes(out, b"two", force=True)
    assert out.read_bytes() == b"two" and os.listdir(tmp_path) == ["out"]


@pytest.mark.parametrize("exists", [False, True], ids=["new", "replaced"])
def test_everything_is_on_the_disk_before_it_gets_its_name(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, exists: bool
) -> None:
    out, done = tmp_path / "out", []
    if exists:
        put(out, "old", folder=True)
    fsync = os.fsync

    def noted(descriptor: int) -> None:
        path = Path(os.readlink(f"/proc/self/fd/{descriptor}"))
        done.append(
            (path.name if path.name in ("inner", "file") else path.suffix, out.exists() and not exists)
        )
        fsync(descriptor)

    monkeypatch.setattr(os, "fsync", noted)
    replacing(out, folder=True)()
    assert sorted(done[:-1]) == sorted([("file", False), ("inner", False), (".partial", False)])
    assert done[-1] == ("", not exists)  # the folder that holds the name, last


def test_a_link_that_leads_to_itself_is_refused(tmp_path: Path) -> None:
    (tmp_path / "loop").symlink_to("loop")
    for path in (tmp_path / "loop", tmp_path / "loop" / "inner"):
        with pytest.raises(AvatarError, match="is a link that leads to itself; name another"):
            followed(path)
    (tmp_path / "link").symlink_to("real")
    assert followed(tmp_path / "link") == tmp_path.resolve() / "real"


def test_files_of_processes_that_live_are_left_alone(tmp_path: Path) -> None:
    out = tmp_path / "out"
    names = {f".out.{os.getppid()}.partial", f".out.{os.getppid()}.old", ".out.x.old", ".other.1.old"}
    for name in names:
        (tmp_path / name).write_text("")
    heal(out)
    assert {path.name for path in tmp_path.iterdir()} == names
    partial_of(out).write_text("of an earlier process of this number")
    heal(out)
    assert {path.name for path in tmp_path.iterdir()} == names
