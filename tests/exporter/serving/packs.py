"""Small packs with any name, and a server in a thread of its own."""

from __future__ import annotations

import asyncio
import json
import socket
import threading
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import cache
from io import BytesIO
from typing import Any

from PIL import Image

from avatar_export.live.receiver import Receiver
from avatar_export.packing.steps import Fineness
from avatar_export.packing.write import pack
from avatar_export.serving import access, server
from avatar_export.serving.hub import Hub
from avatar_export.serving.run import Viewing
from avatar_export.serving.session import Shown, shown
from tests.avatars import surface_avatar

TOKEN = "a-token_of.22-letters"
HOSTILE = (
    '</script><script>alert("1")</script>',
    "\"><img src=x onerror='alert(1)'>",
    "../../../etc/passwd",
    "HEADING TILES <title>x</title> {}",
    "<!--<script>",
    "&lt;&amp;\u2028\u2029'`${x}",
    "محمد 🙂 Ä",
    "packs",
)


def _picture() -> bytes:
    out = BytesIO()
    Image.linear_gradient("L").convert("RGBA").save(out, "WEBP")
    return out.getvalue()


PICTURE = _picture()


@cache
def packed(name: str = "Head", license: str | None = None) -> bytes:
    """A pack of a small avatar of that name."""
    avatar = surface_avatar()
    provenance = {**avatar.provenance, "licence": license}
    return pack([replace(avatar, name=name, provenance=provenance)], Fineness(), preview=PICTURE).file


def of(identity: str, name: str = "Head", license: str | None = None) -> Shown:
    """The same as an avatar of a session."""
    return shown(identity, packed(name, license), identity)


@dataclass
class Running:
    """A server that runs."""

    port: int
    viewing: Viewing
    hub: Hub
    loop: asyncio.AbstractEventLoop

    @property
    def start(self) -> str:
        return f"/{TOKEN}/"

    @property
    def events(self) -> str:
        return f"ws://127.0.0.1:{self.port}{self.start}events"

    def call(self, function: Any, *arguments: Any) -> None:
        """Calls a function in the server's loop."""
        self.loop.call_soon_threadsafe(function, *arguments)

    def raw(self, request: bytes, wait: float = 5.0) -> bytes:
        """What comes back on a connection of its own until it is closed."""
        with socket.create_connection(("127.0.0.1", self.port), timeout=wait) as one:
            one.sendall(request)
            parts = []
            try:
                while part := one.recv(1 << 16):
                    parts.append(part)
            except ConnectionResetError:
                pass
            return b"".join(parts)

    def get(
        self, path: str, method: str = "GET", headers: Mapping[str, str | None] | None = None
    ) -> tuple[int, dict[str, str], bytes]:
        """(status, headers in lower case, body) of a request; a header None is left out."""
        all_headers = {"Host": f"127.0.0.1:{self.port}", **(headers or {})}
        lines = [f"{name}: {value}" for name, value in all_headers.items() if value is not None]
        raw = self.raw("\r\n".join([f"{method} {path} HTTP/1.1", *lines, "", ""]).encode("latin-1"))
        head, _, body = raw.partition(b"\r\n\r\n")
        first, *rest = head.decode("latin-1").split("\r\n")
        return int(first.split()[1]), {k.lower(): v for k, v in (r.split(": ", 1) for r in rest)}, body

    def session(self) -> Any:
        return json.loads(self.get(f"{self.start}session.json")[2])


@contextmanager
def running(avatars: list[Shown], lan: bool = False, receiver: Receiver | None = None) -> Iterator[Running]:
    """A server of these avatars on a free port of this machine."""
    listening = server.listening_socket(0, False)
    port, loop = listening.getsockname()[1], asyncio.new_event_loop()
    viewing = Viewing(avatars, receiver is not None)
    hub = Hub() if receiver is None else Hub(receiver.shown)
    sockets = {"events": hub.page} | ({} if receiver is None else {"live": receiver.from_program})
    door = access.Door(TOKEN, port, lan, sockets, viewing.find)
    ready, end = threading.Event(), asyncio.Event()

    async def serve() -> None:
        serving = await server.start(listening, door, sockets)
        receiving = None if receiver is None else asyncio.create_task(receiver.run(hub.live))
        ready.set()
        await end.wait()
        if receiving is not None:
            receiving.cancel()
            await asyncio.gather(receiving, return_exceptions=True)
        await server.stop(serving)

    thread = threading.Thread(target=loop.run_until_complete, args=(serve(),))
    thread.start()
    assert ready.wait(5)
    try:
        yield Running(port, viewing, hub, loop)
    finally:
        loop.call_soon_threadsafe(end.set)
        thread.join(10)
        loop.close()
        listening.close()
