"""What pages are told: over real WebSockets."""

from __future__ import annotations

import json
import threading
import time
from collections.abc import Iterator
from functools import partial

import pytest
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import ClientConnection, connect

from avatar_export.serving import hub, server
from tests.exporter.serving.packs import Running, of, running


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


def flood(here: Running, seconds: float) -> int:
    """Live frames as fast as they go; the time of the last one."""
    end, number = time.monotonic() + seconds, 0
    while time.monotonic() < end:
        for _ in range(20):
            number += 1
            here.call(here.hub.live, partial(dict, type="live", time=number, weights=[0.5] * 52))
        time.sleep(0.001)
    return number


def received(page: ClientConnection, seen: list[int], answer: bool) -> None:
    for text in page:
        said = json.loads(text)
        seen.append(said["time"])
        if answer:
            page.send(json.dumps({"type": "shown", "time": said["time"]}))


@pytest.mark.parametrize(
    ("answer", "most"), [(True, 1.0 * 60 * 1.15 + 2), (False, 1.0 / 0.25 * hub.IN_FLIGHT + 6)]
)
def test_of_a_flood_the_newest_frames_are_sent(here: Running, answer: bool, most: float) -> None:
    """At most 60 a second; a page that does not show them gets fewer, and none waits in a queue."""
    seen: list[int] = []
    with connect(here.events) as page:
        reader = threading.Thread(target=received, args=(page, seen, answer))
        reader.start()
        page.ping().wait(2)
        last = flood(here, 1.0)
        deadline = time.monotonic() + 2
        while seen[-1:] != [last] and time.monotonic() < deadline:
            time.sleep(0.02)
    reader.join(5)
    assert seen[-1] == last > 2000
    assert seen == sorted(set(seen)) and 5 <= len(seen) <= most


NONSENSE = (
    "",
    "{",
    "[" * 5_000,
    '{"type":"shown","time":"x"}',
    '{"type":"shown","time":1e400}',
    "null",
    b"\0",
)


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
