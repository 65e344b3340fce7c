"""The pages that are open, and what they hear: see `session` for the messages."""

from __future__ import annotations

import asyncio
import json
from collections.abc import Callable, Mapping
from contextlib import suppress
from typing import Any

from websockets.asyncio.server import ServerConnection

from avatar_export.serving.session import IN_FLIGHT, MOST_A_SECOND, compact

# Seconds after which frames that a page did not acknowledge no longer hold the next one back.
UNANSWERED = 0.25
MOST_WAITING = 64  # messages that a page has not read; one that is slower is cut off
CLOSED = 1013  # WebSocket: try again later
Frame = Callable[[], Mapping[str, Any]]  # makes the message of a live frame: only for frames that are sent


class Hub:
    """Tells every open page what happens: each message once, and of live frames the newest."""

    def __init__(self, shown: Callable[[float], None] = lambda _: None) -> None:
        """`shown` is called with the time of a frame that a page acknowledged."""
        self._pages: set[_Page] = set()
        self._shown = shown
        self._said: dict[str, str] = {}  # by subject, for pages that are opened later

    def changed(self, identity: str) -> None:
        """An avatar's file changed."""
        self._tell({"type": "changed", "id": identity})

    def message(self, subject: str, text: str) -> None:
        """One line about a subject, which replaces the line before it; "" takes it away."""
        if text:
            self._said[subject] = text
        else:
            self._said.pop(subject, None)
        self._tell({"type": "message", "text": self._lines()})

    def live(self, frame: Frame) -> None:
        """The newest live frame."""
        for page in self._pages:
            page.newest = frame
            page.wake.set()

    async def page(self, connection: ServerConnection) -> None:
        """The handler of `./events`: runs until the page is closed."""
        page = _Page()
        self._pages.add(page)
        if self._said:
            page.waiting.append(compact({"type": "message", "text": self._lines()}))
            page.wake.set()
        sender = asyncio.create_task(page.send(connection))
        try:
            async for text in connection:
                time = _shown_time(text)
                if time is not None:
                    # A page acknowledges the newest frame that it drew, not those that it skipped.
                    page.flying = [sent for sent in page.flying if sent > time]
                    page.wake.set()
                    self._shown(time)
        finally:
            self._pages.discard(page)
            sender.cancel()
            with suppress(asyncio.CancelledError):
                await sender

    def _lines(self) -> str:
        return " ".join(self._said.values())

    def _tell(self, message: Mapping[str, Any]) -> None:
        text = compact(message)
        for page in self._pages:
            page.waiting.append(text)
            page.wake.set()


class _Page:
    """What one page has yet to hear."""

    def __init__(self) -> None:
        self.waiting: list[str] = []
        self.newest: Frame | None = None
        self.flying: list[float] = []  # times of frames that were sent and not acknowledged
        self.wake = asyncio.Event()

    async def send(self, connection: ServerConnection) -> None:
        """Sends messages at once; frames not faster than the page shows them."""
        loop = asyncio.get_running_loop()
        sent = 0.0
        with suppress(OSError):
            while True:
                limit = UNANSWERED if self.newest is not None else None
                with suppress(TimeoutError):
                    async with asyncio.timeout(limit):
                        await self.wake.wait()
                self.wake.clear()
                while self.waiting:
                    if len(self.waiting) > MOST_WAITING:  # also after a message that took long to go out
                        await connection.close(CLOSED)
                        return
                    await connection.send(self.waiting.pop(0))
                late = loop.time() - sent > UNANSWERED
                if self.newest is None or (len(self.flying) >= IN_FLIGHT and not late):
                    continue
                await asyncio.sleep(max(0.0, sent + 1 / MOST_A_SECOND - loop.time()))
                frame, self.newest = self.newest, None  # what came during the sleep is newer
                sent = loop.time()
                assert frame is not None
                message = frame()
                self.flying = [*(() if late else self.flying), float(message["time"])]
                await connection.send(compact(message))


def _shown_time(text: str | bytes) -> float | None:
    """The time of a frame that a page says it shows; None for any other message."""
    try:
        said = json.loads(text)
    except (ValueError, RecursionError):
        return None
    if not isinstance(said, dict) or said.get("type") != "shown":
        return None
    time = said.get("time")
    return float(time) if isinstance(time, int | float) and abs(time) < 1e9 else None
