"""Who may ask the server for what: a table of addresses in memory, and checks before it.

Nothing is looked up on the disk, so no address leads to another file. The address begins with a random token, so that
other pages and programs cannot guess it. Host must be this machine by number or as localhost, since a hostile page may
let its own name point at 127.0.0.1 (DNS rebinding). Origin, which browsers send with WebSockets and requests of other
sites, must be the page's own. The answers forbid framing, guessing of types, and loading from anywhere else.
"""

from __future__ import annotations

import hmac
import ipaddress
import re
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from http import HTTPStatus

EVENTS, LIVE = "events", "live"
METHODS = ("GET", "HEAD")
PLAIN = "text/plain; charset=utf-8"
RANGE = re.compile("bytes *= *([0-9]{0,18})-([0-9]{0,18})")  # one range; of several the whole file is given


@dataclass(frozen=True)
class Asked:
    """What of a request decides. A header that came more than once is None in no field: its values are joined."""

    method: str
    path: str  # as it came, with the query
    host: str | None
    origin: str | None
    range: str | None = None
    if_range: str | None = None  # a version that the range is of; files have none here


@dataclass(frozen=True)
class File:
    """What an address gives."""

    data: bytes
    type: str


@dataclass(frozen=True)
class Answer:
    """A status, headers and a body; for a WebSocket that may open, `socket` names it and nothing else counts."""

    status: HTTPStatus
    headers: Mapping[str, str]
    body: bytes
    socket: str | None = None


@dataclass(frozen=True)
class Door:
    """The checks of one server."""

    token: str
    port: int
    lan: bool  # whether addresses of the local network are this machine, too
    sockets: Collection[str]  # names of WebSockets below the token
    find: Callable[[str], File | None]  # the file at an address below the token, as "packs/head.avatar"

    def knows(self, asked: Asked) -> bool:
        """Whether the request has the token."""
        start = asked.path.partition("?")[0].removeprefix("/").partition("/")[0]
        return hmac.compare_digest(start.encode("utf-8", "replace"), self.token.encode())

    def answer(self, asked: Asked) -> Answer:
        """The answer to a request."""
        if not self._is_here(asked.host):
            return _refused(HTTPStatus.FORBIDDEN, "Open the address that avatar-export printed.")
        if asked.origin is not None and asked.origin != f"http://{asked.host}":
            return _refused(HTTPStatus.FORBIDDEN, "Pages of other sites may not use this address.")
        if asked.method not in METHODS:
            return _refused(
                HTTPStatus.METHOD_NOT_ALLOWED, "Only GET and HEAD.", {"Allow": ", ".join(METHODS)}
            )
        path = asked.path.partition("?")[0]
        name = path.removeprefix("/").partition("/")[2]
        if not self.knows(asked):
            return _refused(HTTPStatus.NOT_FOUND, "Nothing is here.")
        if path == f"/{self.token}":
            return _refused(HTTPStatus.PERMANENT_REDIRECT, "", {"Location": f"/{self.token}/"})
        if name in self.sockets:
            return Answer(HTTPStatus.SWITCHING_PROTOCOLS, {}, b"", name)
        file = self.find(name)
        if file is None:
            return _refused(HTTPStatus.NOT_FOUND, "Nothing is here.")
        headers = {"Content-Type": file.type, "Accept-Ranges": "bytes", **safe_headers(f"ws://{asked.host}")}
        return _part(file.data, asked, headers)

    def _is_here(self, host: str | None) -> bool:
        name, colon, port = (host or "").rpartition(":")
        if not colon or port != str(self.port):
            return False
        if name in ("localhost", "127.0.0.1"):
            return True
        if not self.lan:
            return False
        try:
            return ipaddress.ip_address(name).is_private  # a number: no name server had a say
        except ValueError:
            return False


def safe_headers(socket: str) -> dict[str, str]:
    """Headers of every answer; `socket` is the origin of the page's own WebSockets."""
    policy = (
        "default-src 'none'; script-src 'self' 'wasm-unsafe-eval' blob:; worker-src 'self' blob:; "
        f"connect-src 'self' {socket} blob: data:; img-src 'self' blob: data:; media-src blob:; "
        "style-src 'self' 'unsafe-inline'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
    )
    return {
        "Content-Security-Policy": policy,
        "Cross-Origin-Resource-Policy": "same-origin",
        "X-Content-Type-Options": "nosniff",
        "Referrer-Policy": "no-referrer",  # the address holds the token
        "Cache-Control": "no-store",
        "Connection": "close",
    }


def _part(data: bytes, asked: Asked, headers: Mapping[str, str]) -> Answer:
    """The whole of a file, or the range that was asked for (RFC 9110, section 14)."""
    size = len(data)
    if asked.method == "HEAD":
        return Answer(HTTPStatus.OK, {"Content-Length": str(size), **headers}, b"")
    found = RANGE.fullmatch((asked.range or "").strip().lower())
    if found is None or found.groups() == ("", "") or asked.if_range is not None:
        return Answer(HTTPStatus.OK, {"Content-Length": str(size), **headers}, data)
    first, last = found.groups()
    if first and last and int(last) < int(first):
        return Answer(HTTPStatus.OK, {"Content-Length": str(size), **headers}, data)
    start = int(first) if first else max(0, size - int(last))
    end = min(size, int(last) + 1) if first and last else size
    if start >= end:
        said = {"Content-Length": "0", "Content-Range": f"bytes */{size}", **headers}
        return Answer(HTTPStatus.REQUESTED_RANGE_NOT_SATISFIABLE, said, b"")
    said = {"Content-Length": str(end - start), "Content-Range": f"bytes {start}-{end - 1}/{size}", **headers}
    return Answer(HTTPStatus.PARTIAL_CONTENT, said, data[start:end])


def _refused(status: HTTPStatus, text: str, more: Mapping[str, str] | None = None) -> Answer:
    body = f"{text}\n".encode()
    headers = {
        "Content-Type": PLAIN,
        "Content-Length": str(len(body)),
        **safe_headers("'self'"),
        **(more or {}),
    }
    return Answer(status, headers, body)
