"""The built viewer page in browsers: as it is served, as one file, and with packets that arrive."""

from __future__ import annotations

import json
import re
import socket
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from threading import Thread

import pytest
from bench.pack_avatars import AVATARS

from avatar_export.ops.active_sh import with_active_sh
from avatar_export.packing.write import pack
from avatar_export.serving import talk
from tests.commands import Run
from tests.exporter.commands.test_view import view
from tests.exporter.live.senders import live_link_packets
from tests.measured import Measure
from tests.players.web import CHROMIUM, LIMIT_S, OTHERS, WEB, environment_of, in_browsers, node, run_node_test

PAGE = Path(__file__).parents[2] / "exporter" / "avatar_export" / "viewer_page"
PACKS = Path(__file__).parents[1] / "data" / "packs" / "1.0"
PACKETS = 20
BACKEND = "?backend=webgl2&play=0"  # a software GPU loses its WebGPU device when a page presents
COVERED = 0.1  # of the page: a head that fills it covers more


@pytest.fixture(scope="module")
def head(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("head")
    source = with_active_sh(AVATARS["head_blendshapes"].load(folder))
    exact = None  # what is seen of it, which decides on the steps, takes long to measure
    (folder / "head.avatar").write_bytes(pack([source], exact).file)
    return folder / "head.avatar"


@contextmanager
def visit(browser: str, address: str, *arguments: str) -> Iterator[subprocess.Popen[str]]:
    """A browser at an address; its lines say what it sees."""
    environment = environment_of(browser)
    command = [node(), str(WEB / "tests" / "visit.mjs"), address, *arguments]
    with subprocess.Popen(command, env=environment, stdout=subprocess.PIPE, text=True) as process:
        try:
            yield process
            assert process.wait(LIMIT_S) == 0
        finally:
            process.kill()


def line(process: subprocess.Popen[str]) -> dict[str, object]:
    assert process.stdout is not None
    said: dict[str, object] = json.loads(process.stdout.readline())
    assert "error" not in said, said
    return said


def test_the_page_is_what_the_sources_make(tmp_path: Path) -> None:
    """`node build.mjs page` writes it; the wheel holds it, so that users need no Node."""
    command = [node(), "build.mjs", "page", "--out", str(tmp_path)]
    subprocess.run(command, cwd=WEB, check=True, timeout=LIMIT_S)
    made = {path.name: path.read_bytes() for path in tmp_path.iterdir()}
    assert made == {path.name: path.read_bytes() for path in PAGE.iterdir() if path.suffix != ".py"}
    subprocess.run(
        [node(), "build.mjs", "tracker", "--out", str(tmp_path)], cwd=WEB, check=True, timeout=LIMIT_S
    )
    assert (tmp_path / talk.TRACKER).read_bytes() == talk.talk_files()[talk.TRACKER]


def test_types_are_sound() -> None:
    compiler = str(WEB / "node_modules" / "typescript" / "bin" / "tsc")
    for project in (".", "viewer"):
        command = [node(), compiler, "--noEmit", "-p", project]
        done = subprocess.run(command, cwd=WEB, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stdout


MORE = {
    "memory.test.mjs": {"LONG": "1"},
    "element_life.test.mjs": {"LONG": "1"},
    "element.test.mjs": {},
    "adapters.test.mjs": {"ADAPTERS": "all"},
    "viewer.test.mjs": {},
}
BROWSER_TESTS = [
    *((CHROMIUM, path.name, {}) for path in sorted((WEB / "tests").glob("*.test.mjs"))),
    *(
        pytest.param(browser, name, more, marks=pytest.mark.players)
        for browser in (CHROMIUM, *OTHERS)
        for name, more in MORE.items()
        if more or browser != CHROMIUM
    ),
]


@pytest.mark.parametrize(("browser", "name", "more"), BROWSER_TESTS)
def test_a_browser_finds_it_sound(browser: str, name: str, more: dict[str, str]) -> None:
    """The page as a person uses it, engines, memory; with MORE WebGPU, which is slow in software, and all options."""
    run_node_test(name, environment_of(browser), **more)


@in_browsers
def test_packets_of_the_recording_move_the_avatar(browser: str, head: Path, measured: Measure) -> None:
    """Live Link Face packets by UDP -> `view --live` -> the page's picture."""
    with (
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender,
        view(head, "--live", "--live-port", 0, "--osc-port", 0) as one,
    ):
        assert one.process.stderr is not None
        port = int(one.process.stderr.readline().rpartition(" ")[2])
        with visit(browser, one.address + BACKEND, "live") as page:
            first = line(page)
            assert float(str(first["covered"])) > COVERED, first
            for packet in live_link_packets()[:PACKETS]:
                sender.sendto(packet, ("127.0.0.1", port))
            assert "changed" in line(page)
        code, _, err = one.end()
    median = re.search(r"packet to picture (\d+) ms \(median\)", err)
    assert code == 0 and median, err
    if browser == CHROMIUM:
        measured("web webgl2, live, packet to picture, median ms", float(median[1]))


@in_browsers
def test_a_published_folder_opens_under_its_title(browser: str, head: Path, run: Run, tmp_path: Path) -> None:
    """Twice: published anew, the page shows the new title."""
    site = tmp_path / "site"
    handler = partial(SimpleHTTPRequestHandler, directory=str(site))
    with ThreadingHTTPServer(("127.0.0.1", 0), handler) as server:
        Thread(target=server.serve_forever, daemon=True).start()
        for title in ("Ada", "Ada's <head>"):
            assert run("publish", head, "-o", site, "--title", title, "--force")[0] == 0
            with visit(browser, f"http://127.0.0.1:{server.server_port}/index.html{BACKEND}") as page:
                first = line(page)
            assert float(str(first["covered"])) > COVERED and first["ready"] == title, first
        server.shutdown()


def test_published_pages_are_for_everybody(run: Run, tmp_path: Path) -> None:
    """Presenting, inspecting, embedded, loading, failed, a gallery, one file: what a visitor does, and axe."""
    joints, surface = (PACKS / f"{name}.avatar" for name in ("joints", "surface"))
    for *given, out in ((joints, "one"), (joints, surface, "two"), (joints, "--single", "one.html")):
        assert run("publish", *given, "-o", tmp_path / out)[0] == 0
    for name in ("published", "access"):
        run_node_test(f"pages/{name}.test.mjs", environment_of(CHROMIUM), SITES=str(tmp_path))


@in_browsers
def test_one_file_opens_by_double_click(browser: str, head: Path, run: Run, tmp_path: Path) -> None:
    single = tmp_path / "head.html"
    assert run("publish", head, "-o", single, "--single")[0] == 0
    with visit(browser, single.as_uri() + BACKEND) as page:
        first = line(page)
    assert float(str(first["covered"])) > COVERED, first
