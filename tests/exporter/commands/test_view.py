"""`avatar-export view` and `publish` as a user starts and ends them."""

from __future__ import annotations

import json
import os
import re
import signal
import socket
import subprocess
import sys
import time
import urllib.request
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
from websockets.sync.client import connect

from avatar_export.driving.takes import read_take
from avatar_export.writers.bundle import write_bundle
from tests.avatars import surface_avatar
from tests.commands import Run
from tests.exporter.live.senders import live_link_packets
from tests.exporter.serving.packs import packed


class View:
    def __init__(self, process: subprocess.Popen[str]) -> None:
        assert process.stdout is not None
        self.process = process
        self.address = process.stdout.readline().strip()

    def get(self, path: str = "") -> bytes:
        with urllib.request.urlopen(self.address + path, timeout=5) as answer:
            body: bytes = answer.read()
            return body

    def session(self) -> Any:
        return json.loads(self.get("session.json"))

    def end(self, number: int = signal.SIGINT) -> tuple[int, str, str]:
        """(exit code, the rest of standard output, standard error) after Ctrl+C."""
        start = time.monotonic()
        self.process.send_signal(number)
        out, err = self.process.communicate(timeout=15)
        assert time.monotonic() - start < 10
        return self.process.returncode, out, err


@contextmanager
def view(*arguments: object) -> Iterator[View]:
    command = [sys.executable, "-m", "avatar_export", "view", *map(str, arguments), "--no-open"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        try:
            yield View(process)
        finally:
            process.kill()


@pytest.fixture
def head(tmp_path: Path) -> Path:
    path = tmp_path / "head.avatar"
    path.write_bytes(packed())
    return path


def test_a_pack_is_served_watched_and_ended(head: Path, tmp_path: Path) -> None:
    other = tmp_path / "other.avatar"
    other.write_bytes(packed("Other"))
    with view(head, other) as one:
        assert re.fullmatch(r"http://127[.]0[.]0[.]1:\d+/[^/]{22,}/", one.address), (
            "a token that nobody guesses"
        )
        assert b"<title>" in one.get()
        assert [a["name"] for a in one.session()["avatars"]] == ["Head", "Other"]
        assert one.get("packs/head.avatar") == packed()
        with connect(one.address.replace("http", "ws") + "events") as page:
            page.ping().wait(2)
            head.write_bytes(packed("Mended"))
            assert json.loads(page.recv(10)) == {"type": "message", "text": ""}
            assert json.loads(page.recv(2)) == {"type": "changed", "id": "head"}
            assert one.get("packs/head.avatar") == packed("Mended")
            head.write_bytes(b"\x1f\x8b no pack")
            said = json.loads(page.recv(10))
            assert said["type"] == "message" and "head.avatar" in said["text"]
            assert one.get("packs/head.avatar") == packed("Mended"), "the last good one stays"
            code, out, err = one.end()
    assert (code, out) == (0, "")
    assert ["Mended" in line or str(head) in line for line in err.splitlines()] == [True, True]


def test_motion_is_received_shown_and_recorded(head: Path, tmp_path: Path) -> None:
    out = tmp_path / "take.csv"
    ports = ("--live-port", 0, "--osc-port", 0)
    with (
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender,
        view(head, "--live", *ports, "--record", out) as one,
    ):
        assert one.session()["live"] is True and one.process.stderr is not None
        told = one.process.stderr.readline()
        assert told.startswith("live: Live Link Face: send to ")
        port = int(told.rpartition(" ")[2])
        with connect(one.address.replace("http", "ws") + "events") as page:
            for packet in live_link_packets()[:3]:
                sender.sendto(packet, ("127.0.0.1", port))
                said = json.loads(page.recv(5))
                page.send(json.dumps({"type": "shown", "time": said["time"]}))
            page.ping().wait(2)
            code, _, err = one.end(signal.SIGTERM)
    assert code == 0 and "Traceback" not in err
    assert "packet to picture" in err and err.endswith(f"{out}: 3 frames\n")
    assert len(read_take(out)) == 3


def test_a_bundle_is_packed_and_ctrl_c_ends_it_at_once(tmp_path: Path) -> None:
    bundle = tmp_path / "bundle"
    write_bundle(surface_avatar(3), bundle, preview=False, engine_files=False, reference=False)
    with view(bundle, "--lan") as one:
        [avatar] = one.session()["avatars"]
        assert (avatar["id"], avatar["file"]) == ("bundle", "packs/bundle.avatar")
        assert one.get(avatar["preview"])[8:12] == b"WEBP"
        os.utime(bundle / "gaussians.ply")  # packing begins again
        time.sleep(0.9)
        code, out, err = one.end()
    assert code == 0 and "Traceback" not in err
    assert err.startswith(f"packing {bundle}\n")
    assert "plain http has no WebGPU" in err or "in no local network" in err
    assert out == "" or out.endswith(one.address.rpartition(":")[2][-30:] + "\n")
    assert not list(tmp_path.glob("**/*.partial"))


def test_wrong_calls_are_one_line(head: Path, run: Run, tmp_path: Path) -> None:
    (tmp_path / "cut.avatar").write_bytes(packed()[:3000])
    (tmp_path / "take.csv").write_text("mine")
    with socket.socket() as other:
        other.bind(("127.0.0.1", 0))
        other.listen()
        for arguments, message in (
            ((tmp_path / "cut.avatar",), "cut.avatar: ends"),
            ((tmp_path / "missing.avatar",), "missing.avatar: no such file or folder"),
            ((head, "--port", other.getsockname()[1]), "cannot be used"),
            ((head, "--record", tmp_path / "new.csv"), "nothing to record without --live"),
            ((head, "--live", "--record", tmp_path / "take.csv"), "take.csv: exists"),
        ):
            code, out, err = run("view", *arguments, "--no-open")
            assert (code, out) == (2, "") and message in " ".join(err.replace("│", " ").split())
    assert (tmp_path / "take.csv").read_text() == "mine"


def test_publish_writes_a_folder_a_gallery_and_a_page(head: Path, run: Run, tmp_path: Path) -> None:
    other, site, single = (tmp_path / name for name in ("other.avatar", "site", "one.html"))
    other.write_bytes(packed("Other", "CC0"))
    code, out, err = run("publish", head, "-o", site)
    assert code == 0 and "licence" in err
    (site / "CNAME").write_text("example.org")
    [pack] = (site / "packs").iterdir()
    assert pack.read_bytes() == packed()
    code, out, err = run("publish", head, other, "-o", tmp_path / "both", "--url", "https://example.org/x")
    assert code == 0 and "2 avatars" in out
    assert 'content="https://example.org/x/previews/head.' in (tmp_path / "both" / "index.html").read_text()
    assert run("publish", other, "-o", single, "--single", "--title", "Me")[0] == 0
    assert "<title>Me</title>" in single.read_text()
    new = tmp_path / "x"
    for arguments, message in (
        ((head, "-o", site), "site: exists; pass --force"),
        ((head, "-o", tmp_path), "is not a published folder"),
        ((head, "-o", single, "--single"), "one.html: exists"),
        ((head, other, "-o", new, "--single"), "one file holds one avatar"),
        ((head, "-o", new, "--url", "example.org"), "is not an address"),
        ((head, "-o", new, "--url", 'https://a/"><script>'), "is not an address"),
        ((head, "-o", new, "--url", "https://me:PW@a.org/"), "a password"),
        ((head, "-o", new, "--url", "ftp://me:PW@a.org"), "a password"),
        ((head, "-o", new, "--url", "https:me:PW@a.org"), "a password"),
        ((head, "-o", new, "--single", "--url", "https://a/"), "--single"),
    ):
        code, out, err = run("publish", *arguments)
        assert (code, out) == (2, "") and message in " ".join(err.replace("│", " ").split())
        assert "PW" not in err and not new.exists()
    assert run("publish", head, "-o", tmp_path / "at", "--url", "https://medium.com/@me")[0] == 0
    (site / "index.html").write_text("mine")
    code, _, err = run("publish", other, "-o", site, "--force")
    assert code == 0 and "index.html" in err
    (site / "index.html").unlink()
    assert run("publish", other, "-o", site, "--force")[0] == 0
    assert not pack.exists() and (site / "CNAME").read_text() == "example.org"
