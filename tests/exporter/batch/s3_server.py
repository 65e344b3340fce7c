"""A real object store for tests: moto's S3 server, and before it a proxy that refuses requests when it is told to."""

from __future__ import annotations

import http.client
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer

import pytest
from moto.server import ThreadedMotoServer
from s3fs import S3FileSystem

BUCKET = "bucket"
SECRET = "a-secret-that-nobody-may-see"
ERRORS = {500: "InternalError", 403: "AccessDenied"}
NOT_PASSED = ("connection", "transfer-encoding", "content-length")

Answer = Callable[[str, str], int | None]  # (method, path of the request) -> an error, or None: pass it on


class Proxy(ThreadingHTTPServer):
    """Passes requests to a store on this machine, unless `answer` says another thing."""

    daemon_threads = True

    def __init__(self, port: int) -> None:
        super().__init__(("127.0.0.1", 0), _Handler)
        self.port, self.seen = port, list[tuple[str, str]]()
        self.answer: Answer = lambda method, path: None

    @property
    def address(self) -> str:
        """Where it listens."""
        return f"http://127.0.0.1:{self.server_port}"


class _Handler(BaseHTTPRequestHandler):
    protocol_version = "HTTP/1.1"
    server: Proxy

    def pass_on(self) -> None:
        body = self.rfile.read(int(self.headers.get("Content-Length") or 0))
        self.server.seen.append((self.command, self.path))
        status = self.server.answer(self.command, self.path)
        if status is not None:
            self._refuse(status)
            return
        store = http.client.HTTPConnection("127.0.0.1", self.server.port, timeout=30)
        store.request(self.command, self.path, body, dict(self.headers.items()))
        found = store.getresponse()
        data = found.read()
        store.close()
        kept = [(name, value) for name, value in found.getheaders() if name.lower() not in NOT_PASSED]
        size = found.getheader("Content-Length") if self.command == "HEAD" else None
        self._send(found.status, kept, data, size)

    do_GET = do_PUT = do_HEAD = do_POST = do_DELETE = pass_on

    def _refuse(self, status: int) -> None:
        text = f"<?xml version='1.0'?><Error><Code>{ERRORS[status]}</Code><Message>no</Message></Error>"
        self._send(status, [("Content-Type", "application/xml")], text.encode())

    def _send(
        self, status: int, headers: list[tuple[str, str]], data: bytes, size: str | None = None
    ) -> None:
        self.send_response(status)
        for name, value in headers:
            self.send_header(name, value)
        self.send_header("Content-Length", size or str(len(data)))
        self.end_headers()
        if self.command != "HEAD":
            self.wfile.write(data)

    def log_message(self, *_: object) -> None:
        """Nothing on standard error."""


@contextmanager
def store_server() -> Iterator[int]:
    """The port of a store on the loopback device, with BUCKET in it."""
    server = ThreadedMotoServer("127.0.0.1", 0, verbose=False)
    server.start()
    _, port = server.get_host_and_port()
    made = http.client.HTTPConnection("127.0.0.1", port)
    made.request("PUT", f"/{BUCKET}")
    assert made.getresponse().read() is not None
    made.close()
    yield port
    server.stop()


@contextmanager
def proxied(port: int, monkeypatch: pytest.MonkeyPatch) -> Iterator[Proxy]:
    """A proxy before a store, to which s3fs talks in the block; what fails is asked once again."""
    proxy = Proxy(port)
    thread = threading.Thread(target=proxy.serve_forever, args=(0.02,), daemon=True)
    thread.start()
    for name, value in {
        "AWS_ENDPOINT_URL": proxy.address,
        "AWS_ACCESS_KEY_ID": "somebody",
        "AWS_SECRET_ACCESS_KEY": SECRET,
        "AWS_DEFAULT_REGION": "us-east-1",
        "AWS_EC2_METADATA_DISABLED": "true",
        "AWS_MAX_ATTEMPTS": "1",
    }.items():
        monkeypatch.setenv(name, value)
    monkeypatch.setattr(S3FileSystem, "retries", 2)
    S3FileSystem.clear_instance_cache()
    try:
        yield proxy
    finally:
        S3FileSystem.clear_instance_cache()
        proxy.shutdown()
        proxy.server_close()
        thread.join()
