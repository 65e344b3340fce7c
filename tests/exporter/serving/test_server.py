"""The server as its neighbours meet it: raw requests over real sockets."""

from __future__ import annotations

import socket
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import replace
from threading import Event

import pytest
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import connect
from websockets.typing import Origin

from avatar_export.serving import server
from avatar_export.serving.page import FOLDER, page_files
from avatar_runtime.io.errors import AvatarError
from tests.exporter.serving.packs import PICTURE, TOKEN, Running, of, packed, running

KEY = "Sec-WebSocket-Key: MDEyMzQ1Njc4OWFiY2RlZg==\r\nSec-WebSocket-Version: 13"
UPGRADE = f"Upgrade: websocket\r\nConnection: Upgrade\r\n{KEY}"


@pytest.fixture(scope="module")
def here() -> Iterator[Running]:
    with running([of("head"), replace(of("body", "Body"), preview=None)]) as one:
        yield one


def test_the_page_and_its_files(here: Running) -> None:
    for name, data in page_files().items():
        status, headers, body = here.get(here.start + name)
        assert (status, body) == (200, data)
        assert int(headers["content-length"]) == len(data)
    status, headers, body = here.get(here.start)
    assert (status, body) == (200, (FOLDER / "index.html").read_bytes())
    assert headers["content-type"] == "text/html; charset=utf-8"
    assert here.get(here.start + "?avatar=body")[0] == 200
    assert here.get(f"/{TOKEN}")[1]["location"] == here.start
    assert here.get(here.start + "viewer.js")[1]["content-type"] == "text/javascript; charset=utf-8"


def test_the_session_names_each_pack_and_preview(here: Running) -> None:
    said = here.session()
    assert (said["live"], said["events"]) == (False, True)
    head, body = said["avatars"]
    assert [head[key] for key in ("name", "file", "preview", "bytes")] == [
        *("Head", "packs/head.avatar", "previews/head.webp", len(packed()))
    ]
    status, headers, data = here.get(here.start + head["file"])
    assert (status, data, headers["content-type"]) == (200, packed(), "application/octet-stream")
    status, headers, data = here.get(here.start + head["preview"])
    assert (status, data, headers["content-type"]) == (200, PICTURE, "image/webp")
    assert body["preview"] is None and here.get(here.start + "previews/body.webp")[0] == 404


def test_every_answer_forbids_use_by_others(here: Running) -> None:
    for path in ("", "packs/head.avatar", "nothing", "session.json"):
        headers = here.get(here.start + path)[1]
        policy = dict(part.strip().split(" ", 1) for part in headers["content-security-policy"].split(";"))
        assert policy["default-src"] == policy["frame-ancestors"] == "'none'"
        assert policy["script-src"] == "'self' 'wasm-unsafe-eval' blob:"
        assert policy["worker-src"] == "'self' blob:"
        assert headers.items() >= {
            ("cross-origin-resource-policy", "same-origin"),
            ("x-content-type-options", "nosniff"),
            ("cache-control", "no-store"),
            ("referrer-policy", "no-referrer"),
        }
        assert "access-control-allow-origin" not in headers
    assert f"ws://127.0.0.1:{here.port}" in here.get(here.start)[1]["content-security-policy"]


OUTSIDE = (
    *("/", "/index.html", "/session.json", "/packs/head.avatar", "/favicon.ico", f"/{TOKEN[:-1]}/", f"/{TOKEN}x/"),
    *(f"/{TOKEN.upper()}/", f"//{TOKEN}/", f"/x/../{TOKEN}/", f"/{TOKEN}/./", f"/{TOKEN}//", f"/%61{TOKEN[1:]}/"),
    *(
        f"/{TOKEN}/{path}"
        for path in (
            *("..", "../", "../index.html", "packs/../index.html", "packs/%2e%2e/index.html", "%2e%2e/run.py"),
            *("../serving/run.py", "..%2fserving%2frun.py", "..\\serving\\run.py", "....//run.py", "packs"),
            *("packs/", "previews/", "viewer_page/", "packs/head", "packs/head.avatar/", "packs//head.avatar"),
            *("/etc/passwd", "//etc/passwd", "file:///etc/passwd", "C:/Windows/win.ini", "packs/head.avatar%00.js"),
            *("packs/link.avatar", "packs/secret.avatar", "index.html%20", "INDEX.HTML", "viewer.js/..;/index.html"),
        )
    ),
    "http://127.0.0.1/etc/passwd", "*", "?",
)  # fmt: skip


@pytest.mark.parametrize("path", OUTSIDE)
def test_nothing_else_is_served(here: Running, path: str) -> None:
    status, _, body = here.get(path)
    assert (status, body) == (404, b"Nothing is here.\n")


@pytest.mark.parametrize("method", ["POST", "PUT", "DELETE", "OPTIONS", "TRACE", "PATCH", "CONNECT", "get"])
def test_other_methods(here: Running, method: str) -> None:
    status, headers, _ = here.get(here.start, method)
    assert (status, headers["allow"]) == (405, "GET, HEAD")


@pytest.mark.parametrize(
    "host",
    [None, "", "evil.example", "evil.example:PORT", "127.0.0.1", "127.0.0.1:1", "127.0.0.1.evil.example:PORT",
     "localhost.evil.example:PORT", "192.168.1.5:PORT", "0.0.0.0:PORT", "127.0.0.1:PORT@evil.example",
     "evil.example#127.0.0.1:PORT", "[::1]:PORT"],
)  # fmt: skip
def test_other_names_of_this_machine_are_refused(here: Running, host: str | None) -> None:
    """A page of another site may point its own name here (DNS rebinding)."""
    named = None if host is None else host.replace("PORT", str(here.port))
    assert here.get(here.start, headers={"Host": named})[0] == 403
    twice = f"GET {here.start} HTTP/1.1\r\nHost: 127.0.0.1:{here.port}\r\nHost: evil.example\r\n\r\n"
    assert here.raw(twice.encode()).startswith(b"HTTP/1.1 403 ")


def test_localhost_is_this_machine_and_others_only_in_the_network(here: Running) -> None:
    assert here.get(here.start, headers={"Host": f"localhost:{here.port}"})[0] == 200
    hosts = {"192.168.1.5": 200, "10.0.0.7": 200, "evil.example": 403, "8.8.8.8": 403}
    with running([of("head")], lan=True) as one:
        for host, status in hosts.items():
            assert one.get(one.start, headers={"Host": f"{host}:{one.port}"})[0] == status


@pytest.mark.parametrize(
    "origin", ["http://evil.example", "null", "https://127.0.0.1:PORT", "http://localhost:PORT"]
)
def test_other_origins_are_refused(here: Running, origin: str) -> None:
    origin = origin.replace("PORT", str(here.port))
    for path in ("", "session.json", "packs/head.avatar"):
        assert here.get(here.start + path, headers={"Origin": origin})[0] == 403
    with pytest.raises(InvalidStatus) as refused, connect(here.events, origin=Origin(origin)):
        pass
    assert refused.value.response.status_code == 403


def test_a_websocket_needs_token_host_and_origin(here: Running) -> None:
    with connect(here.events, origin=Origin(f"http://127.0.0.1:{here.port}")) as one:
        assert one.ping().wait(2)
    for path in ("/events", f"/{TOKEN}x/events", f"/{TOKEN}/live", f"/{TOKEN}/session"):
        with pytest.raises(InvalidStatus) as refused, connect(f"ws://127.0.0.1:{here.port}{path}"):
            pass
        assert refused.value.response.status_code == 404
    request = f"GET {here.start}events HTTP/1.1\r\nHost: evil.example:{here.port}\r\n{UPGRADE}\r\n\r\n"
    assert here.raw(request.encode()).startswith(b"HTTP/1.1 403 ")
    assert here.get(here.start + "events")[0] == 426  # no WebSocket was asked for


@pytest.mark.parametrize(
    "garbage",
    [b"\0" * 500 + b"\r\n", b"\x16\x03\x01\x02\x00\x01\x00\n", b"GET\r\n\r\n", b"GET / HTTP/9\r\n\r\n", b"x" * 100_000,
     b"GET /" + b"a" * 20_000 + b" HTTP/1.1\r\n\r\n", b"GET / HTTP/1.1\r\n" + b"A: b\r\n" * 2_000 + b"\r\n",
     b"GET / HTTP/1.1\r\nHost: \xff\xfe\r\n\r\n", "GET /ä HTTP/1.1\r\n\r\n".encode()],
)  # fmt: skip
def test_garbage_ends_its_own_connection_only(here: Running, garbage: bytes) -> None:
    answer = here.raw(garbage)
    assert answer[:12] in (b"", *(b"HTTP/1.1 %d" % code for code in (400, 403, 414, 431)))
    assert here.get(here.start)[0] == 200


def request(one: Running, path: str) -> bytes:
    return f"GET {path} HTTP/1.1\r\nHost: 127.0.0.1:{one.port}\r\n\r\n".encode()


def ended(connection: socket.socket) -> bool:
    """Whether the other side has closed: a write is refused, not only that nothing more comes."""
    connection.setblocking(False)
    try:
        for _ in range(2):
            connection.sendall(b"x")
            time.sleep(0.05)
    except OSError:
        return True
    return False


@pytest.mark.parametrize(
    "asks", ["nothing", "half a line", "a wrong token", "a wrong token, a byte at a time"]
)
def test_connections_without_the_token_lock_nobody_out(asks: str) -> None:
    """500 of them, held open; a request with the token is answered."""
    with running([of("head")]) as one, ExitStack() as held:
        line = {"nothing": b"", "half a line": b"GET /"}.get(asks, request(one, "/wrong/"))
        for _ in range(500):
            stranger = held.enter_context(socket.create_connection(("127.0.0.1", one.port), timeout=5))
            with suppress(OSError):  # cut in favour of a newer one
                for part in [line[:9], line[9:]] if asks.endswith("time") else [line]:
                    stranger.sendall(part)
        assert [one.get(one.start)[0] for _ in range(5)] == [200] * 5


@pytest.mark.parametrize("asks", ["", "GET /", "/wrong/", "TOKEN", "TOKENpacks/head.avatar", "TOKENevents"])
def test_idle_and_finished_connections_are_closed(monkeypatch: pytest.MonkeyPatch, asks: str) -> None:
    """Though the client holds them open: with nothing asked, a wrong token, or an answer that is over."""
    assert server.IDLE + 2 * server.LOOK <= 10
    monkeypatch.setattr(server, "IDLE", 0.2)
    monkeypatch.setattr(server, "LOOK", 0.1)
    with running([of("head")]) as one, socket.create_connection(("127.0.0.1", one.port), timeout=5) as held:
        path = asks.replace("TOKEN", one.start)
        held.sendall(request(one, path) if path.startswith("/") else path.encode())
        answer = b""
        while part := held.recv(1 << 16):
            answer += part
        assert bool(answer) == path.startswith("/")
        wait = time.monotonic() + 5
        while not ended(held):
            assert time.monotonic() < wait
            time.sleep(0.1)
        held.close()


def test_those_with_the_token_stay_when_there_are_too_many(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(server, "MOST_CONNECTIONS", 8)
    with running([of("head")]) as one, ExitStack() as held:
        pages = [held.enter_context(connect(one.events)) for _ in range(7)]
        for _ in range(30):
            held.enter_context(socket.create_connection(("127.0.0.1", one.port)))
        assert one.get(one.start)[0] == 200
        assert all(page.ping().wait(2) for page in pages)


@contextmanager
def asking_slowly(one: Running) -> Iterator[socket.socket]:
    """A connection with little room, which has asked for the pack."""
    with socket.socket() as slow:
        slow.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1 << 14)
        slow.connect(("127.0.0.1", one.port))
        slow.settimeout(5)
        slow.sendall(request(one, f"{one.start}packs/head.avatar"))
        yield slow


def test_a_client_that_takes_nothing_is_cut(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(server, "STALLED", 0.3)
    monkeypatch.setattr(server, "LOOK", 0.1)
    cut, is_cut = server._Connection.cut, Event()

    def seen(connection: server._Connection) -> None:
        cut(connection)
        is_cut.set()

    monkeypatch.setattr(server._Connection, "cut", seen)
    large = replace(of("head"), pack=bytes(16 << 20))
    with running([large]) as one, asking_slowly(one) as slow:
        assert is_cut.wait(30)
        size = 0
        with suppress(ConnectionResetError):
            while part := slow.recv(1 << 16):
                size += len(part)
        assert size < 8 << 20


def test_a_slow_reader_gets_a_large_file_whole(monkeypatch: pytest.MonkeyPatch) -> None:
    """Though it takes a hundred times as long as an idle connection may stay."""
    monkeypatch.setattr(server, "IDLE", 0.05)
    monkeypatch.setattr(server, "LOOK", 0.05)
    large = replace(of("head"), pack=bytes(range(256)) * 8_000)
    with running([large]) as one, asking_slowly(one) as slow:
        assert one.get(one.start)[0] == 200, "others are served meanwhile"
        data = b""
        while part := slow.recv(1 << 13):
            data += part
            time.sleep(0.02)
    assert data.partition(b"\r\n\r\n")[2] == large.pack


LAST = len(packed()) - 1


@pytest.mark.parametrize(
    ("asked", "part"),
    [
        ("bytes=0-0", (0, 0)),
        ("bytes=0-99", (0, 99)),
        ("Bytes = 100-", (100, LAST)),
        (f"bytes={LAST}-", (LAST, LAST)),
        ("bytes=-10", (LAST - 9, LAST)),
        (f"bytes=-{10**17}", (0, LAST)),
        (f"bytes=5-{10**17}", (5, LAST)),
        (f"bytes={LAST + 1}-", None),
        ("bytes=-0", None),
        *((f"bytes={whole}", ()) for whole in ("9-5", "-", "0-1,5-6", "a-b", "\u0663-")),
        ("items=0-1", ()),
        ("", ()),
    ],
)
def test_a_range_of_a_file(here: Running, asked: str, part: tuple[int, int] | tuple[()] | None) -> None:
    path = f"{here.start}packs/head.avatar"
    wanted = asked.encode().decode("latin-1")
    status, headers, body = here.get(path, headers={"Range": wanted})
    assert headers["accept-ranges"] == "bytes" and int(headers["content-length"]) == len(body)
    if part is None:
        assert (status, body, headers["content-range"]) == (416, b"", f"bytes */{LAST + 1}")
    elif part == ():
        assert (status, body) == (200, packed()) and "content-range" not in headers
    else:
        first, last = part
        assert (status, body) == (206, packed()[first : last + 1])
        assert headers["content-range"] == f"bytes {first}-{last}/{LAST + 1}"
    assert "default-src 'none'" in headers["content-security-policy"]
    assert here.get(path, headers={"Range": wanted, "If-Range": '"1"'})[::2] == (200, packed())
    assert here.get(path, "HEAD", {"Range": wanted})[::2] == (200, b"")


def test_a_port_in_use_is_one_line(here: Running) -> None:
    with pytest.raises(AvatarError, match=f"--port: port {here.port} cannot be used"):
        server.listening_socket(here.port, False)


def test_pages_stay_open_until_the_server_ends(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(server, "IDLE", 0.1)
    monkeypatch.setattr(server, "LOOK", 0.1)
    with ExitStack() as stack:
        with running([of("head")]) as one:
            page = stack.enter_context(connect(one.events))
            time.sleep(0.6)
            assert page.ping().wait(2)
            start = time.monotonic()
        assert time.monotonic() - start < 4
        with pytest.raises(ConnectionClosed):
            page.recv(timeout=1)
