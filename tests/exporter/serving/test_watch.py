"""Files that change while they are shown."""

from __future__ import annotations

import asyncio
import json
import os
import time
from collections.abc import Awaitable, Callable, Iterator
from contextlib import suppress
from dataclasses import replace
from functools import partial
from pathlib import Path

import pytest
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect

from avatar_export.serving import hub, server
from avatar_export.serving.session import Shown
from avatar_export.serving.sources import sources_of
from avatar_export.serving.watch import watch
from avatar_export.writers.bundle import write_bundle
from tests.avatars import surface_avatar
from tests.exporter.serving.packs import Running, of, packed, running

PERIOD, PATIENCE = 0.03, 0.25


class Log:
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
        told = (log.changed.append, log.lines.append)
        task = asyncio.create_task(watch(source, source.stamp(), *told, period=PERIOD, patience=PATIENCE))
        await act(log)
        task.cancel()
        with suppress(asyncio.CancelledError):
            await task

    asyncio.run(main())
    return log


def test_a_pack_that_is_replaced_or_written_slowly_is_loaded_again(tmp_path: Path) -> None:
    path, third = tmp_path / "head.avatar", packed("Third")
    path.write_bytes(packed())

    async def act(log: Log) -> None:
        (tmp_path / "new").write_bytes(packed("Second"))
        os.replace(tmp_path / "new", path)
        await log.until(partial(log.last_is, "Second"))
        with path.open("wb", buffering=0) as file:
            for start in range(0, len(third), len(third) // 5):
                file.write(third[start : start + len(third) // 5])
                await asyncio.sleep(4 * PERIOD)  # longer than two looks
        await log.until(partial(log.last_is, "Third"))

    log = watched(path, act)
    names = ("Second", "Third")
    assert [(a.id, a.name, a.pack) for a in log.changed] == [("head", name, packed(name)) for name in names]
    assert set(log.lines) == {""}


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
    assert "head.avatar: ends" in log.lines[0] and "no such file" in log.lines[1] and log.lines[2] == ""
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


@pytest.fixture
def here() -> Iterator[Running]:
    with running([of("head")]) as one:
        yield one


def test_a_change_and_lines_reach_every_page(here: Running) -> None:
    with connect(here.events) as a, connect(here.events) as b:
        a.ping().wait(2)
        here.call(here.viewing.replace, of("head", "New"))
        here.call(here.hub.changed, "head")
        here.call(here.hub.message, "head", "is broken")
        for page in (a, b):
            assert json.loads(page.recv(2)) == {"type": "changed", "id": "head"}
            assert json.loads(page.recv(2)) == {"type": "message", "text": "is broken"}
        assert here.session()["avatars"][0]["name"] == "New"
        with connect(here.events) as later:
            assert json.loads(later.recv(2)) == {"type": "message", "text": "is broken"}
        here.call(here.hub.message, "head", "")
        assert json.loads(a.recv(2)) == {"type": "message", "text": ""}


SHOWN = '{"type":"shown","time":%s}'
NONSENSE = ("", "{", "[" * 5_000, SHOWN % '"x"', SHOWN % "1e400", "null", b"\0")


def test_nonsense_from_a_page_is_passed_over(here: Running) -> None:
    with connect(here.events) as page:
        for text in NONSENSE:
            page.send(text)
        here.call(here.hub.changed, "head")
        assert json.loads(page.recv(2))["type"] == "changed"
        page.send("x" * (server.LARGEST_MESSAGE + 1))
        with pytest.raises(ConnectionClosed) as closed:
            page.recv(5)
        assert closed.value.rcvd is not None and closed.value.rcvd.code == 1009


def test_a_page_that_reads_nothing_is_cut_off(here: Running) -> None:
    """Its messages would wait for ever."""
    with connect(here.events, max_queue=1, close_timeout=0.1) as lazy:
        for _ in range(1000):
            here.call(here.hub.message, "head", "x" * 50_000)
        with connect(here.events) as page:
            here.call(here.hub.changed, "head")
            kinds = [json.loads(page.recv(5))["type"] for _ in range(2)]
        assert kinds == ["message", "changed"]
        with pytest.raises(ConnectionClosed) as closed:
            for _ in range(1000):
                lazy.recv(5)
        assert closed.value.rcvd is not None and closed.value.rcvd.code == hub.CLOSED
