"""Everything that receives motion: two UDP ports and a WebSocket, each into one inbox."""

from __future__ import annotations

import asyncio
import json
import logging
import socket
import time
from collections.abc import Callable
from contextlib import ExitStack, closing, suppress
from functools import partial
from pathlib import Path
from typing import Any

from websockets.asyncio.server import ServerConnection

from avatar_export.driving.live_link_udp import parse_packet
from avatar_export.live.inbox import Inbox, LiveFrame, plain
from avatar_export.live.latency import Latency
from avatar_export.live.messages import channels_of, frame_message
from avatar_export.live.ports import Ports
from avatar_export.live.recording import Recorder
from avatar_export.live.vmc import VmcReader
from avatar_runtime.io.errors import AvatarError

REPORT = 10.0  # seconds between two lines about latency, at least
EVERYWHERE = "0.0.0.0"  # a phone sends from the network
Send = Callable[[Callable[[], dict[str, Any]]], None]  # takes what makes the message of a frame
Packet = Callable[[bytes, str], None]  # takes a packet and the sender's address


class Receiver:
    """Motion from the network: frames go to pages, and to a recording."""

    def __init__(self, ports: Ports, say: Callable[[str], None], record: Path | None = None) -> None:
        """Takes both ports. Raises AvatarError for one that is in use, and if `record` cannot be written."""
        self._say = say
        self._send: Send = lambda _: None
        self.inbox = Inbox(self._frame, say)
        self._epoch_ms = 1e3 * (time.time() - self.inbox.now())
        self._vmc = VmcReader(self.inbox)
        self._latency = Latency()
        with ExitStack() as undo:
            wanted = ((ports.live_link, "--live-port"), (ports.osc, "--osc-port"))
            self._sockets = [undo.enter_context(closing(_udp(port, option))) for port, option in wanted]
            self._recorder = None if record is None else _recorder(record)
            undo.pop_all()
        logging.getLogger().addFilter(_is_not_about_osc)  # the library logs to the root

    @property
    def ports(self) -> Ports:
        """The ports that were taken."""
        return Ports(*(int(one.getsockname()[1]) for one in self._sockets))

    async def run(self, send: Send) -> None:
        """Receives, and gives each frame to `send`, until it is cancelled; then closes ports and recording."""
        self._send = send
        loop = asyncio.get_running_loop()
        takers: tuple[Packet, ...] = (self._live_link, self._vmc.packet)
        endings = []
        try:
            for one, take in zip(self._sockets, takers, strict=True):
                transport, _ = await loop.create_datagram_endpoint(partial(_Datagrams, take), sock=one)
                endings.append(transport.close)
            while True:
                await asyncio.sleep(REPORT)
                self._report()
        finally:
            for end in endings:
                end()
            self._report()

    def close(self) -> None:
        """Ends the recording and closes the ports; says what was recorded."""
        logging.getLogger().removeFilter(_is_not_about_osc)
        for one in self._sockets:
            one.close()
        if self._recorder is None:
            return
        recorder, self._recorder = self._recorder, None
        try:
            written = recorder.close()
        except OSError as error:
            raise AvatarError(f"cannot be written ({error.strerror or error})", file=recorder.out) from None
        self._say(
            f"{recorder.out}: {recorder.rows} frames"
            if written
            else "live: nothing came, nothing is recorded"
        )

    def shown(self, frame_time: float) -> None:
        """A page shows the frame of that time."""
        self._latency.add(self.inbox.now() - frame_time)

    async def from_program(self, connection: ServerConnection) -> None:
        """The handler of `./live`: a program sends frames as JSON."""
        sender = "JSON over WebSocket"
        async for text in connection:
            try:
                self.inbox.frame(sender, channels_of(text))
            except AvatarError as error:
                self.inbox.refuse(sender, str(error))
                await connection.send(json.dumps({"type": "message", "text": str(error)}))

    def _live_link(self, data: bytes, sender: str) -> None:
        try:
            packet = parse_packet(data)
        except AvatarError as error:
            self.inbox.refuse(f"Live Link Face at {sender}", error.message)
            return
        if packet.channels is not None:
            who = f"Live Link Face {plain(packet.subject)!r} at {sender}"
            self.inbox.frame(who, packet.channels.tolist(), packet.time)

    def _frame(self, frame: LiveFrame) -> None:
        self._send(partial(frame_message, frame, self._epoch_ms))
        if self._recorder is None:
            return
        try:
            self._recorder.add(frame)
        except OSError as error:
            self._say(f"live: the recording ends ({error.strerror or error})")
            with suppress(OSError):
                self._recorder.close()
            self._recorder = None

    def _report(self) -> None:
        self.inbox.flush()
        line = self._latency.line()
        if line is not None:
            self._say(line)


class _Datagrams(asyncio.DatagramProtocol):
    """Gives each packet to a function."""

    def __init__(self, take: Packet) -> None:
        self._take = take

    def datagram_received(self, data: bytes, address: tuple[str, int]) -> None:
        self._take(data, address[0])


def _udp(port: int, option: str) -> socket.socket:
    one = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    one.setblocking(False)
    try:
        one.bind((EVERYWHERE, port))
    except OSError as error:
        one.close()
        raise AvatarError(
            f"UDP port {port} cannot be used ({error.strerror or error}); another program may receive there",
            field=option,
        ) from None
    return one


def _recorder(out: Path) -> Recorder:
    try:
        return Recorder(out)
    except OSError as error:
        raise AvatarError(f"cannot be written ({error.strerror or error})", file=out) from None


def _is_not_about_osc(record: logging.LogRecord) -> bool:
    """Whether a record is not one of the lines that the OSC library logs for each odd packet."""
    return "pythonosc" not in record.pathname
