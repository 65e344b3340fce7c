"""The whole of `avatar-export view`: loads the avatars, serves the page, tells it what changes, until it is stopped."""

from __future__ import annotations

import asyncio
import secrets
import signal
import socket
import webbrowser
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager, closing, suppress
from dataclasses import dataclass
from functools import partial

from avatar_export.live.receiver import Receiver
from avatar_export.notes.text import text
from avatar_export.serving import access, page, server
from avatar_export.serving.hub import Hub
from avatar_export.serving.session import Shown, compact, session
from avatar_export.serving.sources import Source, Stamp
from avatar_export.serving.talk import talk_files
from avatar_export.serving.watch import watch

Say = Callable[[str], None]
TOKEN_BYTES = 16


@dataclass(frozen=True)
class Voice:
    """Where lines for a person or a script go."""

    address: Say  # addresses of the page, which a script may read
    say: Say
    steps: Callable[[], AbstractContextManager[Say]]  # shows the progress of long work


@dataclass(frozen=True)
class Choices:
    """What a user asks of `view`."""

    port: int = 0  # 0: a free one
    lan: bool = False
    open: bool = True


class Viewing:
    """The avatars that are shown now, and the files that the page may load."""

    def __init__(self, avatars: Sequence[Shown], live: bool) -> None:
        self._avatars = {avatar.id: avatar for avatar in avatars}
        self._live = live
        self._page = {
            name: access.File(data, page.content_type(name)) for name, data in page.page_files().items()
        }
        self._talk = {f"talk/{name}": data for name, data in talk_files().items()}

    def replace(self, avatar: Shown) -> None:
        """Shows a newer version of an avatar."""
        self._avatars[avatar.id] = avatar

    def find(self, name: str) -> access.File | None:
        """The file at an address below the token, or None."""
        if name in ("", page.INDEX):
            return self._page[page.INDEX]
        if name == "session.json":
            return access.File(self._session().encode(), page.content_type(name))
        if name in self._talk:
            return access.File(self._talk[name], page.content_type(name))
        folder, _, file = name.partition("/")
        own, dot, suffix = file.partition(".")
        avatar = self._avatars.get(own)
        if avatar is not None and (folder, dot + suffix) == ("packs", ".avatar"):
            return access.File(avatar.pack, page.content_type(file))
        if avatar is not None and avatar.preview and (folder, dot + suffix) == ("previews", ".webp"):
            return access.File(avatar.preview, page.content_type(file))
        return self._page.get(name)

    def _session(self) -> str:
        avatars = list(self._avatars.values())
        packs = [f"packs/{avatar.id}.avatar" for avatar in avatars]
        previews = [f"previews/{avatar.id}.webp" if avatar.preview else None for avatar in avatars]
        talk = {path.removeprefix("talk/"): path for path in self._talk}
        return compact(session(avatars, packs, previews, live=self._live, events=True, talk=talk))


def view(given: Sequence[Source], choices: Choices, voice: Voice, receiver: Receiver | None = None) -> None:
    """Shows avatars until Ctrl+C or a request to end; `receiver` sends them motion.

    Raises AvatarError for a source that is unsound at the start, and for a port that is in use; KeyboardInterrupt for a
    Ctrl+C while they are loaded.
    """
    with closing(server.listening_socket(choices.port, choices.lan)) as listening:
        watched = [(source, source.stamp()) for source in given]
        with voice.steps() as step:

            def progress(line: str) -> None:
                voice.say(line)
                step(line)

            loaded = [
                source.load(progress, noted=lambda note: voice.say(f"warning: {text(note)}"))
                for source in given
            ]
        viewing = Viewing(loaded, receiver is not None)
        asyncio.run(_serve(watched, viewing, listening, choices, voice, receiver))


async def _serve(
    watched: Sequence[tuple[Source, Stamp]],
    viewing: Viewing,
    listening: socket.socket,
    choices: Choices,
    voice: Voice,
    receiver: Receiver | None,
) -> None:
    stop, port = _stopped_by_signals(), listening.getsockname()[1]
    token = secrets.token_urlsafe(TOKEN_BYTES)
    hub = Hub() if receiver is None else Hub(receiver.shown)
    sockets = {access.EVENTS: hub.page}
    if receiver is not None:
        sockets[access.LIVE] = receiver.from_program
    door = access.Door(token, port, choices.lan, sockets, viewing.find)
    serving = await server.start(listening, door, sockets)

    def changed(avatar: Shown) -> None:
        viewing.replace(avatar)
        hub.changed(avatar.id)
        voice.say(f"{avatar.name}: loaded again")

    def message(source: Source, text: str) -> None:
        hub.message(source.id, text)
        if text:
            voice.say(text)

    tasks = [
        asyncio.create_task(watch(source, stamp, changed, partial(message, source)))
        for source, stamp in watched
    ]
    if receiver is not None:
        tasks.append(asyncio.create_task(receiver.run(hub.live)))
    try:
        own = f"http://{server.LOOPBACK}:{port}/{token}/"
        voice.address(own)
        if choices.lan:
            _say_lan(port, token, voice)
        if receiver is not None:
            _say_live(receiver, own, voice.say)
        if choices.open and not await asyncio.to_thread(webbrowser.open, own):
            voice.say("no browser opens here; open the address yourself")
        await stop.wait()
    finally:
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)
        await server.stop(serving)


def _say_lan(port: int, token: str, voice: Voice) -> None:
    local = server.local_address()
    if local is None:
        voice.say("this machine is in no local network; only its own browser reaches the page")
        return
    voice.address(f"http://{local}:{port}/{token}/")
    voice.say("plain http has no WebGPU on other devices; there the page uses WebGL2")
    voice.say("everybody in the local network who knows the address can load these avatars")


def _say_live(receiver: Receiver, own: str, say: Say) -> None:
    local = server.local_address() or server.LOOPBACK
    say(f"live: Live Link Face: send to {local}, port {receiver.ports.live_link}")
    say(f"live: VMC (OSC) with ARKit names: send to {local}, port {receiver.ports.osc}")
    say(f"live: JSON: {own.replace('http', 'ws', 1)}{access.LIVE}")


def _stopped_by_signals() -> asyncio.Event:
    """An event that Ctrl+C and a request to end set, where the system lets them; elsewhere KeyboardInterrupt comes."""
    stop, loop = asyncio.Event(), asyncio.get_running_loop()
    for number in (signal.SIGINT, signal.SIGTERM):
        with suppress(NotImplementedError):
            loop.add_signal_handler(number, stop.set)
    return stop
