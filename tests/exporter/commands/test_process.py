"""Signals, closed streams and little memory, as a shell or a supervisor meets them."""

from __future__ import annotations

import os
import resource
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import replace
from importlib import import_module
from pathlib import Path
from typing import Any

import pytest

from avatar_export.commands import memory
from avatar_export.commands.memory import EXPORT, MIB, Need, shortage
from avatar_export.writers import bundle, table
from tests.commands import Run

PLAIN = ("--no-preview", "--no-engine-files", "--no-reference")
ENDS = {"SIGINT": 130, "SIGTERM": 143, "SIGHUP": 129}


def ended(name: str) -> str:
    return f"avatar-export: ended by {'Ctrl+C' if name == 'SIGINT' else name}\n"


@pytest.fixture
def handlers() -> Iterator[None]:
    """The handlers of signals are those of before, afterwards, even where the code under test does nothing."""
    before = {name: signal.getsignal(getattr(signal, name)) for name in ENDS}
    for name in ENDS:
        signal.signal(getattr(signal, name), signal.default_int_handler)
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


@pytest.mark.usefixtures("handlers")
def test_an_interrupt_that_a_destructor_swallows_comes_again(
    run: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    class Swallows:
        def __del__(self) -> None:
            signal.raise_signal(signal.SIGINT)

    def inspect(*_: object) -> dict[str, Any]:
        Swallows()
        threading.Event().wait(20)
        return {}

    monkeypatch.setattr("avatar_export.summary.inspect", inspect)
    began = time.monotonic()
    code, _, error = run("inspect", "x")
    assert (code, error) == (130, ended("SIGINT")) and time.monotonic() - began < 20


@pytest.mark.parametrize("name", ENDS)
@pytest.mark.parametrize("last", [True, False])
@pytest.mark.usefixtures("handlers")
def test_a_signal_that_a_library_swallows_ends_the_process(
    run: Run, monkeypatch: pytest.MonkeyPatch, name: str, last: bool
) -> None:
    """In the middle of the work, or as the last thing that it does."""

    def inspect(*_: object) -> dict[str, Any]:
        with suppress(BaseException):
            signal.raise_signal(getattr(signal, name))
        if not last:
            threading.Event().wait(20)
        return {}

    monkeypatch.setattr("avatar_export.summary.inspect", inspect)
    code, out, error = run("inspect", "x", "--json")
    assert (code, error) == (ENDS[name], ended(name)) and (last or out == "")


@pytest.mark.usefixtures("handlers")
def test_one_signal_raises_once(run: Run, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """However long it takes to tidy up: a second exception would break that off."""

    def inspect(*_: object) -> None:
        try:
            signal.raise_signal(signal.SIGTERM)
        finally:
            threading.Event().wait(0.5)
            (tmp_path / "tidy").touch()

    monkeypatch.setattr("avatar_export.summary.inspect", inspect)
    assert run("inspect", "x") == (143, "", ended("SIGTERM")) and (tmp_path / "tidy").exists()


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
USD = """
import os, signal, sys
left = [int(sys.argv[1])]
signal.signal(signal.SIGINT, signal.default_int_handler)  # what a shell has ignored stays ignored
def hook(event, values):
    if event == "import" and str(values[0]).startswith("pxr"):
        left[0] -= 1
        if left[0] == 0:
            os.kill(os.getpid(), signal.{name})
sys.addaudithook(hook)
sys.argv[0:2] = ["avatar-export"]
from avatar_export.__main__ import main
try:
    main()
finally:
    assert left[0] <= 0, "the library was not loaded"
"""


@pytest.mark.parametrize("name", ["SIGTERM", "SIGINT"])
@pytest.mark.parametrize("module", [1, 3, 7, 12])
def test_a_signal_while_openusd_loads_ends_convert(
    sample_lam: Path, tmp_path: Path, name: str, module: int
) -> None:
    words = ("convert", sample_lam, "-o", tmp_path / "out", "--no-preview", "--no-reference")
    done = subprocess.run(
        [sys.executable, "-c", USD.format(name=name), str(module), *words],
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert (done.returncode, done.stdout, done.stderr) == (ENDS[name], "", ended(name))
    assert not list(tmp_path.iterdir())


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


def started(folder: Path, streams: str, need: str = "EXPORT", module: str = MODULE) -> tuple[int, str, str]:
    """(exit code, standard output, standard error) of a small program behind `start`; `streams` is a redirection."""
    (folder / "small.py").write_text(module)
    path = os.pathsep.join([str(folder), *filter(None, sys.path)])
    shell = ["bash", "-c", f'exec "$@" {streams}', "bash"]
    done = subprocess.run(
        [*shell, sys.executable, "-c", f"{START}start('small', 'small', {need})"],
        capture_output=True,
        text=True,
        check=False,
        env=os.environ | {"PYTHONPATH": path},
    )
    return done.returncode, done.stdout, done.stderr


FULL = "small: standard output: cannot be written (No space left on device)\n"


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


@pytest.mark.parametrize("words", [("systems",), ("--help",), ("systems", "--json")])
def test_output_that_cannot_be_written_is_one_line(words: tuple[str, ...]) -> None:
    with open("/dev/full", "w") as full:
        ended = subprocess.run(
            [sys.executable, "-m", "avatar_export", *words], stdout=full, stderr=subprocess.PIPE, text=True
        )
    said = "avatar-export: standard output: cannot be written (No space left on device)\n"
    assert (ended.returncode, ended.stderr) == (2, said)


def test_a_reader_that_has_gone_ends_the_program_quietly() -> None:
    read, write = os.pipe()
    os.close(read)
    ended = subprocess.run(
        [sys.executable, "-m", "avatar_export", "systems"], stdout=write, stderr=subprocess.PIPE, text=True
    )
    os.close(write)
    assert (ended.returncode, ended.stderr) == (141, "")


def test_an_interrupt_while_modules_are_loaded_ends_the_program(tmp_path: Path) -> None:
    """Even where a library swallows the exception."""
    swallows = (
        "import os, signal\ntry:\n    os.kill(os.getpid(), signal.SIGINT)\nexcept BaseException: pass\n"
        + MODULE
    )
    assert started(tmp_path, "", module=swallows) == (-signal.SIGINT, "", "")


def test_too_little_address_space_is_one_line_before_anything_is_loaded(tmp_path: Path) -> None:
    code, out, error = started(tmp_path, "; ulimit -v 400000 >/dev/null", need="{'': Need(1 << 40, 0, 0)}")
    assert (code, out, error) == (7, "to output\n", "to error\n")  # no limit, no line
    limited = f"import resource; resource.setrlimit(resource.RLIMIT_AS, (300 << 20,) * 2)\n{START}"
    ended = subprocess.run(
        [sys.executable, "-c", f"{limited}start('small', 'no_such_module', EXPORT)"],
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert ended.returncode == 3 and ended.stdout == ""
    assert ended.stderr.startswith(
        f"small: needs {EXPORT[''].address_space // MIB} MiB of address space, but "
    )
    assert ended.stderr.endswith(" MiB are free; raise the limit (ulimit -v)\n")


@pytest.fixture
def system(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A made-up /proc and /sys/fs/cgroup; no limit of the address space."""
    monkeypatch.setattr(memory, "PROC", tmp_path / "proc")
    monkeypatch.setattr(memory, "CGROUPS", tmp_path / "cgroup")
    monkeypatch.setattr(resource, "getrlimit", lambda _: (resource.RLIM_INFINITY,) * 2)
    return tmp_path


def lay(folder: Path, files: dict[str, str]) -> None:
    for name, text in files.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(text)


NEED = Need(0, 0, 300 * MIB)
VERSION_2 = {"proc/self/cgroup": "0::/user/job\n", "cgroup/user/job/memory.max": "max\n"}
VERSION_1 = {"proc/self/cgroup": "5:cpu,memory:/job\n4:pids:/job\n"}
CONTAINER = "; raise the memory limit of the container"
LIMITS = {
    "nothing is said": ({}, None),
    "version 2, none": (VERSION_2, None),
    "version 2, of a parent": (
        VERSION_2 | {"cgroup/user/memory.max": f"{400 * MIB}\n", "cgroup/user/memory.current": f"{200 * MIB}\n"},
        f"200 MiB are free{CONTAINER}",
    ),
    "version 2, used by files": (
        VERSION_2
        | {
            "cgroup/user/memory.max": f"{400 * MIB}\n",
            "cgroup/user/memory.current": f"{200 * MIB}\n",
            "cgroup/user/memory.stat": f"anon 7\ninactive_file {150 * MIB}\nactive_file 0\n",
        },
        None,
    ),
    "version 1": (
        VERSION_1 | {"cgroup/memory/job/memory.limit_in_bytes": f"{64 * MIB}"},
        f"64 MiB are free{CONTAINER}",
    ),
    "version 1, none": (VERSION_1 | {"cgroup/memory/job/memory.limit_in_bytes": "9223372036854771712"}, None),
    "the machine": (
        {"proc/meminfo": "MemFree: 9 kB\nMemAvailable: 102400 kB\nSwapFree: 1024 kB\n"},
        "101 MiB are free; end other programs",
    ),
    "the machine has swap": ({"proc/meminfo": "MemAvailable: 102400 kB\nSwapFree: 409600 kB\n"}, None),
}  # fmt: skip


@pytest.mark.parametrize("name", LIMITS)
def test_the_limits_that_the_system_states(system: Path, name: str) -> None:
    files, said = LIMITS[name]
    lay(system, files)
    found = shortage(NEED)
    assert found == (None if said is None else f"needs 300 MiB of memory, but {said}")
