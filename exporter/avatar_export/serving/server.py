"""Serves files and two WebSockets on one port, with the library `websockets`.

Why this library: it is the usual one for WebSockets in Python, has no dependencies, and its `process_request` answers
plain requests on the same port, so that the page needs one address only. `http.server` and WebSockets on a second port
would need two, and a second check of origins. The library expects short answers: so the time that it waits for the end
of an answer is long here (SLOWEST), and a time limit for the arrival of a request is our own.
"""

from __future__ import annotations

import asyncio
import logging
import socket
from collections.abc import Awaitable, Callable, Mapping
from contextlib import suppress
from typing import Any

from websockets.asyncio.server import Server, ServerConnection, serve
from websockets.datastructures import Headers
from websockets.exceptions import ConnectionClosed
from websockets.http11 import Request, Response

from avatar_export.serving.access import Asked, Door
from avatar_runtime.io.errors import AvatarError

LOOPBACK, EVERYWHERE = "127.0.0.1", "0.0.0.0"
SLOWEST = 1800.0  # seconds that the download of a pack may take
REQUEST_TIME = 10.0  # seconds in which a request must have arrived
MOST_CONNECTIONS = 256
LARGEST_MESSAGE = 64 << 10  # bytes of one WebSocket message
Handler = Callable[[ServerConnection], Awaitable[None]]


class _Connection(ServerConnection):
    """A connection that is cut if no request arrives, or if there are too many."""

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        super().connection_made(transport)
        if len(self.server.handler_tasks) > MOST_CONNECTIONS:
            self.transport.abort()
            return
        self.loop.call_later(REQUEST_TIME, self._cut)

    def _cut(self) -> None:
        if self.request is None:
            self.transport.abort()


def listening_socket(port: int, lan: bool) -> socket.socket:
    """A socket that listens on this machine only, or on its local networks; port 0 takes a free one.

    Raises AvatarError if the port is in use.
    """
    listening = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
    try:
        listening.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        listening.bind((EVERYWHERE if lan else LOOPBACK, port))
    except OSError as error:
        listening.close()
        raise AvatarError(
            f"port {port} cannot be used ({error.strerror or error}); leave it out to get a free one",
            field="--port",
        ) from None
    return listening


async def start(listening: socket.socket, door: Door, sockets: Mapping[str, Handler]) -> Server:
    """Begins to serve on a socket: the files of `door`, and a handler for each WebSocket by name."""
    logger = logging.getLogger("avatar_export.serving")
    logger.addHandler(logging.NullHandler())
    logger.propagate = False

    def process(_: ServerConnection, request: Request) -> Response | None:
        answer = door.answer(asked(request))
        if answer.socket is not None:
            return None
        return Response(answer.status.value, answer.status.phrase, Headers(answer.headers), answer.body)

    async def handle(connection: ServerConnection) -> None:
        assert connection.request is not None
        name = door.answer(asked(connection.request)).socket
        assert name is not None  # `process` let it pass
        with suppress(ConnectionClosed):
            await sockets[name](connection)

    return await serve(
        handle,
        sock=listening,
        process_request=process,
        create_connection=_Connection,
        server_header=None,
        compression=None,
        open_timeout=SLOWEST,
        close_timeout=SLOWEST,
        max_size=LARGEST_MESSAGE,
        logger=logger,
    )


async def stop(server: Server, patience: float = 1.0) -> None:
    """Ends serving; clients get `patience` seconds to say goodbye."""
    server.close()
    with suppress(TimeoutError):
        async with asyncio.timeout(patience):
            await server.wait_closed()


def asked(request: Request) -> Asked:
    """The parts of a request that decide."""

    def header(name: str) -> str | None:
        values: list[Any] = request.headers.get_all(name)
        return ", ".join(values) if values else None

    return Asked(request.method, request.path, header("Host"), header("Origin"))


def local_address() -> str | None:
    """This machine's address in its local network, or None without one. Nothing is sent."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.connect(("192.0.2.1", 9))  # an address for documentation; it only chooses the network card
            found: str = probe.getsockname()[0]
        except OSError:
            return None
    return None if found.startswith("127.") else found
