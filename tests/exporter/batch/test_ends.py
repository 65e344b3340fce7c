"""What stops a batch: signals, after which nothing is left, and sources that never end."""

from __future__ import annotations

import os
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
from bench.batch.lists import Row, write_list

from avatar_export.batch import stores
from avatar_export.batch.job import Job
from avatar_export.batch.jobs import read_list
from avatar_export.batch.row import do
from avatar_export.options import ReadOptions
from avatar_export.readers.table import read
from avatar_runtime.io.errors import AvatarError
from avatar_runtime.io.files import open_file
from tests.exporter.readers import splatting_files

QUICK = {"preview": False, "engine_files": False, "reference": False}
PATIENCE_S = 60  # a test that waits this long has hung


def all_files(folder: Path) -> list[str]:
    return sorted(path.relative_to(folder).as_posix() for path in folder.rglob("*"))


@pytest.mark.parametrize(("name", "times"), [("SIGTERM", 1), ("SIGINT", 6)])
def test_a_batch_that_is_stopped_leaves_nothing(
    name: str, times: int, made: list[Row], tmp_path: Path
) -> None:
    """The signals come while a row writes; the second while the first ends the workers."""
    write_list(tmp_path / "list.csv", [{**made[0], "steps": "pack"}], 1, {})
    here, scratch, out = tmp_path / "here", tmp_path / "scratch", tmp_path / "out"
    here.mkdir()
    scratch.mkdir()
    command = (
        sys.executable,
        "-m",
        "avatar_export",
        "batch",
        tmp_path / "list.csv",
        "-o",
        out,
        "--workers",
        "1",
    )
    paths = os.pathsep.join(map(str, map(Path.absolute, map(Path, filter(None, sys.path)))))
    with subprocess.Popen(
        [*map(str, command)],
        cwd=here,
        env={**os.environ, "TMPDIR": str(scratch), "PYTHONPATH": paths},
        stderr=subprocess.PIPE,
        text=True,
    ) as batch:
        try:
            until = time.monotonic() + PATIENCE_S
            while not list(out.glob(".row_000.*.partial")):
                assert batch.poll() is None and time.monotonic() < until
                time.sleep(0.02)
            for _ in range(times):
                batch.send_signal(getattr(signal, name))
                time.sleep(0.2)
            _, said = batch.communicate(timeout=PATIENCE_S)
        finally:
            batch.kill()
    assert batch.returncode == 128 + getattr(signal, name), said
    assert "--resume does what is missing" in said and "Traceback" not in said
    assert all_files(out) == ["report.html", "report.jsonl"]
    assert all_files(scratch) == all_files(here) == []


def pipe(path: Path) -> None:
    os.mkfifo(path)


def endless(path: Path) -> None:
    path.symlink_to("/dev/zero")


def listening(path: Path) -> None:
    here = Path.cwd()
    with socket.socket(socket.AF_UNIX) as server:
        os.chdir(path.parent)  # a socket's path is short
        try:
            server.bind(path.name)
        finally:
            os.chdir(here)


OTHERS = {"a pipe": pipe, "an endless device": endless, "a socket": listening}


@pytest.fixture
def alarm() -> Iterator[None]:
    """Ends a test that waits for data that never come."""

    def ring(number: int, frame: object) -> None:
        raise AssertionError("it waits")

    before = signal.signal(signal.SIGALRM, ring)
    signal.alarm(PATIENCE_S)
    yield
    signal.alarm(0)
    signal.signal(signal.SIGALRM, before)


@pytest.mark.usefixtures("alarm")
@pytest.mark.parametrize("kind", OTHERS)
def test_what_never_ends_beside_an_avatar_is_not_opened(kind: str, tmp_path: Path) -> None:
    splatting_files.write_gaussian_run(tmp_path / "run", splatting_files.arrays(degree=3))
    (tmp_path / "mesh.obj").write_text(splatting_files.obj_text(splatting_files.VERTICES * 2))
    options = {**QUICK, "mesh": str(tmp_path / "mesh.obj")}
    OTHERS[kind](tmp_path / "run" / "extra.bin")
    OTHERS[kind](tmp_path / "run" / "more.bin")
    job = Job("one", str(tmp_path / "run"), str(tmp_path / "out" / "one"), options)
    result = do(job, "a")
    assert result.state == "done", result.message
    assert "extra.bin and 1 more: a pipe, a device or a socket; not read" in result.message
    assert do(job, "b").state == "kept"


@pytest.mark.usefixtures("alarm")
@pytest.mark.parametrize("kind", OTHERS)
def test_what_never_ends_is_no_source_no_list_and_no_record(kind: str, tmp_path: Path) -> None:
    make = OTHERS[kind]
    make(tmp_path / "head.zip")
    result = do(Job("one", str(tmp_path / "head.zip"), str(tmp_path / "one"), QUICK), "a")
    assert (result.state, result.kind) == ("failed", "input")
    assert result.message == f"{tmp_path}/head.zip: is a pipe, a device or a socket; name a file or a folder"
    make(tmp_path / "list.csv")
    with pytest.raises(AvatarError, match="not a regular file"):
        read_list(str(tmp_path / "list.csv"), str(tmp_path / "out"))
    (tmp_path / "old").mkdir()
    make(tmp_path / "old" / stores.RECORD)
    assert stores.read_record(str(tmp_path / "old")) is None


@pytest.mark.usefixtures("alarm")
def test_a_walk_passes_over_what_never_ends(tmp_path: Path) -> None:
    splatting_files.write_gaussian_run(tmp_path / "in" / "run", splatting_files.arrays(degree=3))
    for number, (kind, ending) in enumerate((kind, end) for kind in OTHERS for end in stores.ALONE):
        OTHERS[kind](tmp_path / "in" / f"{number}{ending}")
    found = read_list(str(tmp_path / "in"), str(tmp_path / "out"))
    assert [job.name for job in found] == ["run"]


@pytest.mark.usefixtures("alarm")
@pytest.mark.parametrize("index", range(6))
def test_no_reader_waits_for_a_pipe_in_place_of_a_file(index: int, made: list[Row], tmp_path: Path) -> None:
    """Each file of an avatar of each system becomes a pipe, one at a time: the reader passes it over or refuses it."""
    row = made[index]
    source = Path(row["source"])
    options = {name: Path(row[name]) for name in ("dataset", "rig", "mesh", "body_model") if row.get(name)}
    if row.get("shape"):
        options["shape"] = row["shape"]
    for original in [source] if source.is_file() else sorted(p for p in source.rglob("*") if p.is_file()):
        copy = tmp_path / "copy" / source.name
        copy.parent.mkdir()
        swapped(source, copy, original)
        try:
            read(copy, ReadOptions(**options))
        except AvatarError as error:
            assert "\n" not in str(error)
        (tmp_path / "copy").rename(tmp_path / f"was{len(all_files(tmp_path))}")


def swapped(source: Path, copy: Path, file: Path) -> None:
    """A copy of `source` by links, with a pipe in place of `file`."""
    for path in [source, *source.rglob("*")]:
        place = copy / path.relative_to(source)
        if path.is_dir():
            place.mkdir()
        elif path == file:
            os.mkfifo(place)
        else:
            os.link(path, place)


@pytest.mark.usefixtures("alarm")
def test_nobody_at_the_other_end_of_a_pipe_is_woken(tmp_path: Path) -> None:
    """A pipe that somebody opens for reading lets its writer go on."""
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(OSError, match="not a regular file"):
        open_file(tmp_path / "pipe")
    opened: list[str] = []
    real = os.open
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(os, "open", lambda path, *more: opened.append(str(path)) or real(path, *more))
        with pytest.raises(OSError, match="not a regular file"):
            open_file(tmp_path / "pipe")
    assert opened == []
