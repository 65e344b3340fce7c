"""Signals, closed streams and little memory, as a shell or a supervisor meets them."""

from __future__ import annotations

import os
import re
import resource
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from dataclasses import replace
from importlib import import_module
from pathlib import Path
from typing import Any

import pytest

from avatar_export.commands import console, memory
from avatar_export.commands.console import Steps
from avatar_export.commands.memory import EXPORT, MIB, Need, shortage
from avatar_export.writers import bundle, table
from tests.commands import PLAIN, Run

ENDS = {"SIGINT": 130, "SIGTERM": 143, "SIGHUP": 129}


def ended(name: str) -> str:
    return f"avatar-export: ended by {'Ctrl+C' if name == 'SIGINT' else name}\n"


def python(program: str, *words: object, **options: Any) -> subprocess.CompletedProcess[str]:
    streams = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, **options}
    return subprocess.run(
        [sys.executable, "-c", program, *map(str, words)], text=True, check=False, **streams
    )


@pytest.fixture
def handlers() -> Iterator[None]:
    """The handlers of signals are those of before, afterwards, even where the code under test does nothing."""
    before = {name: signal.signal(getattr(signal, name), signal.default_int_handler) for name in ENDS}
    yield
    for name, handler in before.items():
        signal.signal(getattr(signal, name), handler)


@pytest.mark.parametrize("name", ENDS)
@pytest.mark.usefixtures("handlers")
def test_a_signal_leaves_nothing_half_written(
    run: Run, sample_lam: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    def pieces(_: object) -> Any:
        assert list(tmp_path.iterdir())  # something is being written
        signal.raise_signal(getattr(signal, name))
        return [b""]

    broken = tuple(replace(w, pieces=pieces) if w.path == "rig.safetensors" else w for w in table.WRITERS)
    monkeypatch.setattr(bundle, "WRITERS", broken)
    code, out, error = run("convert", sample_lam, "-o", tmp_path / "out", *PLAIN)
    assert (code, out, error) == (ENDS[name], "", ended(name))
    assert not list(tmp_path.iterdir())


class Swallows:
    def __init__(self, name: str) -> None:
        self.name = name

    def __del__(self) -> None:
        signal.raise_signal(getattr(signal, self.name))


@pytest.mark.parametrize("name", ENDS)
@pytest.mark.parametrize("last", [True, False])
@pytest.mark.usefixtures("handlers")
def test_a_signal_that_a_library_swallows_ends_the_process(
    run: Run, monkeypatch: pytest.MonkeyPatch, name: str, last: bool
) -> None:
    """In the middle of the work, or as the last thing that it does."""

    def inspect(*_: object) -> dict[str, Any]:
        Swallows(name)
        if not last:
            threading.Event().wait(20)
        return {}

    monkeypatch.setattr("avatar_export.summary.inspect", inspect)
    began = time.monotonic()
    code, out, error = run("inspect", "x", "--json")
    assert (code, error) == (ENDS[name], ended(name)) and (last or out == "")
    assert time.monotonic() - began < 20


# A native library: an exception that comes while it loads is printed, and then it goes on.
SWALLOWS = """
import os, signal, sys, time
try:
    os.kill(os.getpid(), signal.{name})
    time.sleep(0.3)
except BaseException:
    sys.excepthook(*sys.exc_info())
"""


@pytest.mark.parametrize("name", ENDS)
@pytest.mark.usefixtures("handlers")
def test_a_signal_while_a_module_is_loaded_waits_for_it(
    run: Run, monkeypatch: pytest.MonkeyPatch, tmp_path: Path, name: str
) -> None:
    (tmp_path / "swallows_signals.py").write_text(SWALLOWS.format(name=name))
    monkeypatch.syspath_prepend(tmp_path)
    went_on = []

    def inspect(*_: object) -> dict[str, Any]:
        import_module("swallows_signals")
        threading.Event().wait(20)
        went_on.append(True)
        return {}

    monkeypatch.setattr("avatar_export.summary.inspect", inspect)
    try:
        assert run("inspect", "x") == (ENDS[name], "", ended(name)) and not went_on
    finally:
        sys.modules.pop("swallows_signals", None)


# `convert` that gets a signal before the n-th module of OpenUSD is loaded.
@pytest.mark.usefixtures("handlers")
def test_memory_that_runs_out_is_one_line_and_code_3(run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    for text, said in (("", "memory ran out"), ("Unable to allocate 7 GiB", "Unable to allocate 7 GiB")):

        def inspect(*_: object, text: str = text) -> None:
            raise MemoryError(text)

        monkeypatch.setattr("avatar_export.summary.inspect", inspect)
        assert run("inspect", "x") == (3, "", f"avatar-export: {said}\n")


# What the program does when it is started by `main` of a module that is not ours: it prints, and says where it was.
MODULE = """
import os, sys
def main():
    opened = os.open(__file__, os.O_RDONLY)
    assert opened > 2, "a file got the number of a standard stream"
    print("to output", flush=True)
    print("to error", file=sys.stderr, flush=True)
    sys.exit(7)
"""
START = "from avatar_export.commands.process import start; from avatar_export.commands.memory import *\n"


def started(folder: Path, streams: str, need: str = "EXPORT") -> tuple[int, str, str]:
    """(exit code, standard output, standard error) of a small program behind `start`; `streams` is a redirection."""
    (folder / "small.py").write_text(MODULE)
    path = os.pathsep.join([str(folder), *filter(None, sys.path)])
    words = ["bash", "-c", f'exec "$@" {streams}', "bash"]
    words += [sys.executable, "-c", f"{START}start('small', 'small', {need})"]
    done = subprocess.run(
        words, capture_output=True, text=True, check=False, env=os.environ | {"PYTHONPATH": path}
    )
    return done.returncode, done.stdout, done.stderr


@pytest.mark.parametrize(
    ("streams", "expected"),
    [
        ("", (7, "to output\n", "to error\n")),
        (">&-", (7, "", "to error\n")),
        ("2>&-", (7, "to output\n", "")),
        ("<&- >&- 2>&-", (7, "", "")),
        ("2>/dev/full", (7, "to output\n", "")),
    ],
)
def test_a_stream_that_is_closed_or_full_does_not_end_the_work(
    tmp_path: Path, streams: str, expected: tuple[int, str, str]
) -> None:
    assert started(tmp_path, streams) == expected


PROGRAM = "from avatar_export.__main__ import main; main()"


@pytest.mark.parametrize("words", [("systems",), ("--help",), ("systems", "--json")])
def test_output_that_cannot_be_written_is_one_line(words: tuple[str, ...]) -> None:
    with open("/dev/full", "w") as full:
        ended = python(PROGRAM, *words, stdout=full)
    assert ended.returncode == 2 and ended.stderr.count("\n") == 1 and "No space left" in ended.stderr


def test_a_reader_that_has_gone_ends_the_program_quietly() -> None:
    read, write = os.pipe()
    os.close(read)
    ended = python(PROGRAM, "systems", stdout=write)
    os.close(write)
    assert (ended.returncode, ended.stderr) == (141, "")


def test_too_little_address_space_is_one_line_before_anything_is_loaded(tmp_path: Path) -> None:
    code, out, error = started(tmp_path, "; ulimit -v 400000 >/dev/null", need="{'': Need(1 << 40, 0, 0)}")
    assert (code, out, error) == (7, "to output\n", "to error\n")  # no limit, no line
    limited = f"import resource; resource.setrlimit(resource.RLIMIT_AS, (300 << 20,) * 2)\n{START}"
    ended = python(f"{limited}start('small', 'no_such_module', EXPORT)")
    assert (ended.returncode, ended.stdout, ended.stderr.count("\n")) == (3, "", 1)
    assert f"{EXPORT[''].address_space // MIB} MiB" in ended.stderr and "ulimit -v" in ended.stderr


@pytest.fixture
def system(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A made-up /proc and /sys/fs/cgroup; no limit of the address space."""
    monkeypatch.setattr(memory, "PROC", tmp_path / "proc")
    monkeypatch.setattr(memory, "CGROUPS", tmp_path / "cgroup")
    monkeypatch.setattr(resource, "getrlimit", lambda _: (resource.RLIM_INFINITY,) * 2)
    return tmp_path


NEED = Need(0, 0, 300 * MIB)
VERSION_2 = {"proc/self/cgroup": "0::/user/job\n", "cgroup/user/job/memory.max": "max\n"}
VERSION_1 = {"proc/self/cgroup": "5:cpu,memory:/job\n4:pids:/job\n"}
CONTAINER = "; raise the memory limit of the container"
PARENT = {"cgroup/user/memory.max": f"{400 * MIB}\n", "cgroup/user/memory.current": f"{200 * MIB}\n"}
FILES = {"cgroup/user/memory.stat": f"anon 7\ninactive_file {150 * MIB}\nactive_file 0\n"}
LIMIT_1 = "cgroup/memory/job/memory.limit_in_bytes"
LIMITS = {
    "nothing is said": ({}, None),
    "version 2, none": (VERSION_2, None),
    "version 2, of a parent": (VERSION_2 | PARENT, f"200 MiB are free{CONTAINER}"),
    "version 2, used by files": (VERSION_2 | PARENT | FILES, None),
    "version 1": (VERSION_1 | {LIMIT_1: f"{64 * MIB}"}, f"64 MiB are free{CONTAINER}"),
    "version 1, none": (VERSION_1 | {LIMIT_1: "9223372036854771712"}, None),
    "the machine": (
        {"proc/meminfo": "MemFree: 9 kB\nMemAvailable: 102400 kB\nSwapFree: 1024 kB\n"},
        "101 MiB",
    ),
    "the machine has swap": ({"proc/meminfo": "MemAvailable: 102400 kB\nSwapFree: 409600 kB\n"}, None),
}


@pytest.mark.parametrize("name", LIMITS)
def test_the_limits_that_the_system_states(system: Path, name: str) -> None:
    files, said = LIMITS[name]
    for path, text in files.items():
        (system / path).parent.mkdir(parents=True, exist_ok=True)
        (system / path).write_text(text)
    found = shortage(NEED)
    assert found is None if said is None else said in str(found)


LINE = re.compile(r"reading\?, [0-9]+ s so far")


def test_a_line_comes_every_few_seconds_on_standard_error(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """During one long step, too; none after the end."""
    assert console.SECONDS == 10
    monkeypatch.setattr(console, "SECONDS", 0.05)
    lines: list[str] = []
    with Steps() as step:
        step("reading\n")
        while len(lines) < 3:
            threading.Event().wait(0.05)
            captured = capsys.readouterr()
            assert captured.out == ""
            lines += captured.err.splitlines()
    capsys.readouterr()
    threading.Event().wait(0.2)
    assert capsys.readouterr() == ("", "") and all(LINE.fullmatch(line) for line in lines)


BUNDLE = Path(__file__).parents[2] / "data" / "bundles" / "0.1.0" / "every_field.avatar.zip"
HIDDEN = """
import importlib.util, sys
find = importlib.util.find_spec
importlib.util.find_spec = lambda name, *rest: None if name == "numba" else find(name, *rest)
class Hidden:
    def find_spec(self, name, *rest):
        if name.partition(".")[0] in ("numba", "llvmlite"):
            raise ModuleNotFoundError(name)
sys.meta_path.insert(0, Hidden())
from avatar_export.__main__ import main
main()
"""


@pytest.mark.parametrize(
    "words",
    [
        ("render", BUNDLE, "--size", "32", "-o", "drawn.png"),
        pytest.param(("pack", BUNDLE, "--levels", "1,0.5", "-o", "small.avatar"), marks=pytest.mark.more),
    ],
)
def test_it_works_and_says_once_what_is_slow(words: tuple[str | Path, ...], tmp_path: Path) -> None:
    done = python(HIDDEN, *words[:-1], tmp_path / words[-1])
    assert done.returncode in (0, 1), done.stderr
    assert done.stderr.startswith("avatar-export: without Numba") and done.stderr.count("Numba") == 1
    assert (tmp_path / words[-1]).stat().st_size
