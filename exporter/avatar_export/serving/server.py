"""Serves files and two WebSockets on one port, with the library `websockets`.

Why this library: it is the usual one for WebSockets in Python, has no dependencies, and its `process_request` answers
plain requests on the same port, so that the page needs one address only. `http.server` and WebSockets on a second port
would need two, and a second check of origins. The library has one time limit for an answer and for its end, whether the
client reads or not: so it is set to none, and `_Connection` looks after what every connection does.
"""

from __future__ import annotations

import asyncio
import logging
import socket
from collections.abc import Awaitable, Callable, Mapping
from contextlib import suppress
from typing import Any, ClassVar

from websockets.asyncio.server import Server, ServerConnection, serve
from websockets.datastructures import Headers
from websockets.exceptions import ConnectionClosed
from websockets.http11 import Request, Response
from websockets.protocol import State

from avatar_export.serving.access import Asked, Door
from avatar_runtime.io.errors import AvatarError

LOOPBACK, EVERYWHERE = "127.0.0.1", "0.0.0.0"
IDLE = 5.0  # seconds: a request must have arrived, and a client must hang up after the end of an answer
STALLED = 60.0  # seconds in which a client takes nothing of an answer
LOOK = 1.0  # seconds between two looks at a connection
MOST_CONNECTIONS = 128
# Connections that are accepted at a time: a request is read before MOST_CONNECTIONS others come.
ACCEPTED = 16
QUEUE = 1024  # connections that wait to be accepted
SEND_BUFFER = 1 << 17  # bytes in the system: small, so that one sees how much a slow client takes
LARGEST_MESSAGE = 64 << 10  # bytes of one WebSocket message
Handler = Callable[[ServerConnection], Awaitable[None]]


class _Connection(ServerConnection):
    """A connection that is cut when nothing comes, when an answer is over, and when there are too many."""

    room: ClassVar[dict[_Connection, None]]  # every open connection of the server, the oldest first
    known = False  # whether it showed the token
    _left = 0  # bytes of the answer that the system has not taken yet
    _moved = 0.0  # when something happened last

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        super().connection_made(transport)
        self.room[self] = None
        self._moved = self.loop.time()
        self.loop.call_later(LOOK, self._look)
        if len(self.room) > MOST_CONNECTIONS:
            # Who lacks the token makes room for who may have it.
            next((one for one in self.room if not one.known), self).cut()

    def connection_lost(self, exc: Exception | None) -> None:
        self.room.pop(self, None)
        super().connection_lost(exc)

    def cut(self) -> None:
        """Ends the connection; the system still delivers what it has taken."""
        self.room.pop(self, None)
        self.transport.abort()

    def _look(self) -> None:
        if self not in self.room:
            return
        left, now = self.transport.get_write_buffer_size(), self.loop.time()
        # An open WebSocket; pings of the library find dead ones.
        if left != self._left or self.state is State.OPEN:
            self._left, self._moved = left, now
        if now - self._moved > (STALLED if left else IDLE):
            self.cut()
        else:
            self.loop.call_later(LOOK, self._look)


def listening_socket(port: int, lan: bool) -> socket.socket:
    """A socket that listens on this machine only, or on its local networks; port 0 takes a free one.

    Raises AvatarError if the port is in use.
    """
    listening = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
    try:
        listening.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        listening.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, SEND_BUFFER)  # its connections inherit it
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

    def process(connection: ServerConnection, request: Request) -> Response | None:
        assert isinstance(connection, _Connection)
        connection.known = door.knows(asked(request))
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

    class Connection(_Connection):
        room: ClassVar[dict[_Connection, None]] = {}

    serving = await serve(
        handle,
        sock=listening,
        backlog=ACCEPTED,
        process_request=process,
        create_connection=Connection,
        server_header=None,
        compression=None,
        open_timeout=None,
        close_timeout=None,
        max_size=LARGEST_MESSAGE,
        logger=logger,
    )
    listening.listen(QUEUE)
    return serving


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

    return Asked(
        request.method, request.path, header("Host"), header("Origin"), header("Range"), header("If-Range")
    )


def local_address() -> str | None:
    """This machine's address in its local network, or None without one. Nothing is sent."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.connect(("192.0.2.1", 9))  # an address for documentation; it only chooses the network card
            found: str = probe.getsockname()[0]
        except OSError:
            return None
    return None if found.startswith("127.") else found
