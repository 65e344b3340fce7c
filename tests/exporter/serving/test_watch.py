"""Files that change while they are shown."""

from __future__ import annotations

import asyncio
import os
import time
from collections.abc import Awaitable, Callable
from contextlib import suppress
from dataclasses import replace
from functools import partial
from pathlib import Path

from avatar_export.serving.session import Shown
from avatar_export.serving.sources import Source, sources_of
from avatar_export.serving.watch import watch
from avatar_export.writers.bundle import write_bundle
from tests.avatars import surface_avatar
from tests.exporter.serving.packs import packed

PERIOD, PATIENCE = 0.03, 0.25


class Log:
    """What a watch told."""

    def __init__(self) -> None:
        self.changed: list[Shown] = []
        self.lines: list[str] = []

    async def until(self, ready: Callable[[], object], seconds: float = 5.0) -> None:
        end = time.monotonic() + seconds
        while not ready():
            assert time.monotonic() < end, (self.lines, [a.name for a in self.changed])
            await asyncio.sleep(0.01)

    def last_is(self, name: str) -> bool:
        return [avatar.name for avatar in self.changed][-1:] == [name]


def watched(path: Path, act: Callable[[Log], Awaitable[None]]) -> Log:
    log = Log()
    [source] = sources_of([path])

    async def main() -> None:
        task = asyncio.create_task(
            watch(
                source, source.stamp(), log.changed.append, log.lines.append, period=PERIOD, patience=PATIENCE
            )
        )
        await act(log)
        task.cancel()
        with suppress(asyncio.CancelledError):
            await task

    asyncio.run(main())
    return log


def test_a_pack_that_is_replaced_is_loaded_again(tmp_path: Path) -> None:
    path = tmp_path / "head.avatar"
    path.write_bytes(packed())

    async def act(log: Log) -> None:
        for name in ("Second", "Third"):
            new = tmp_path / "new"
            new.write_bytes(packed(name))
            os.replace(new, path)
            await log.until(partial(log.last_is, name))
        await asyncio.sleep(5 * PERIOD)

    log = watched(path, act)
    assert [(a.id, a.name, a.pack) for a in log.changed] == [
        ("head", "Second", packed("Second")), ("head", "Third", packed("Third")),
    ]  # fmt: skip
    assert set(log.lines) == {""}


def test_a_half_written_file_is_waited_for(tmp_path: Path) -> None:
    path, new = tmp_path / "head.avatar", packed("New")
    path.write_bytes(packed())

    async def act(log: Log) -> None:
        with path.open("wb", buffering=0) as file:
            for start in range(0, len(new), len(new) // 5):
                file.write(new[start : start + len(new) // 5])
                await asyncio.sleep(4 * PERIOD)  # longer than two looks
        await log.until(lambda: log.changed)

    log = watched(path, act)
    assert [a.name for a in log.changed] == ["New"] and set(log.lines) == {""}


def test_a_broken_file_is_one_line_and_the_last_good_one_stays(tmp_path: Path) -> None:
    path = tmp_path / "head.avatar"
    path.write_bytes(packed())

    async def act(log: Log) -> None:
        path.write_bytes(packed()[:3000])
        await log.until(lambda: log.lines)
        await asyncio.sleep(PATIENCE + 4 * PERIOD)
        path.unlink()
        await log.until(lambda: len(log.lines) > 1)
        await asyncio.sleep(PATIENCE + 4 * PERIOD)
        assert not log.changed and len(log.lines) == 2
        path.write_bytes(packed("Mended"))
        await log.until(lambda: log.changed)

    log = watched(path, act)
    assert "head.avatar: ends" in log.lines[0] and log.lines[0].endswith("; the last good one stays")
    assert "head.avatar: no such file or folder" in log.lines[1] and log.lines[2] == ""
    assert [a.name for a in log.changed] == ["Mended"]


def test_a_bundle_that_changes_is_packed_again(tmp_path: Path) -> None:
    path = tmp_path / "bundle"
    write = partial(write_bundle, out=path, preview=False, engine_files=False, reference=False)
    write(surface_avatar(3))

    async def act(log: Log) -> None:
        write(replace(surface_avatar(3), name="Again"), force=True)
        await log.until(lambda: log.changed, 60)

    log = watched(path, act)
    assert [a.name for a in log.changed] == ["Again"]
    assert log.lines == [f"packing {path}", ""]


def test_ids_are_safe_and_different(tmp_path: Path) -> None:
    names = ("head.avatar", "Head.avatar", "../head", "a/b c.avatar.zip", "ÄÖ", "محمد", "packs", "x" * 300)
    found = [source.id for source in sources_of([tmp_path / name for name in names], ("packs",))]
    assert found == ["head", "head-2", "head-3", "b-c", "ao", "avatar", "packs-2", "x" * 48]
    assert Source("a", tmp_path / "gone").stamp() == ()
