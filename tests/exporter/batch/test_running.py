"""Whole batches by the command line: a worker that is killed, a stop, what resumes, what comes out."""

from __future__ import annotations

import json
import os
import random
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from bench.batch.lists import Row, mostly_cheap, write_list
from distributed import Client

from avatar_export.batch import row_options, stores
from avatar_export.batch.job import Job
from avatar_export.batch.jobs import read_list
from avatar_export.batch.row import do
from avatar_export.conversion import convert
from avatar_runtime.io.errors import AvatarError
from tests.commands import Refused, Run
from tests.exporter.batch.conftest import QUICK, kill_worker
from tests.exporter.readers import splatting_files
from tests.folders import contents as files

ROWS = 24
SEED = 3


def report(out: Path) -> dict[str, dict[str, Any]]:
    lines = (out / "report.jsonl").read_text("utf-8").splitlines()
    rows = [json.loads(line) for line in lines]
    assert len({row["name"] for row in rows}) == len(rows)
    return {row["name"]: row for row in rows}


def finished(out: Path) -> int:
    """Rows that are done; a row's folder appears as a whole."""
    return len(list(out.glob("row_*/result.json")))


def when(out: Path, count: int, act: Any) -> threading.Thread:
    """Does something in another thread as soon as `count` rows are done."""

    def wait() -> None:
        while finished(out) < count:
            time.sleep(0.02)
        act()

    thread = threading.Thread(target=wait, daemon=True)
    thread.start()
    return thread


@pytest.fixture(scope="module")
def address(client: Client) -> str:
    return str(client.scheduler.address)


def test_a_killed_worker_changes_no_byte(
    client: Client, address: str, made: list[Row], run: Run, tmp_path: Path
) -> None:
    write_list(tmp_path / "list.csv", mostly_cheap(made), ROWS)
    out, dice = tmp_path / "out", random.Random(SEED)
    killer = when(out, dice.randrange(2, ROWS - 4), lambda: kill_worker(client, dice.randrange(2)))
    code, _, said = run("batch", tmp_path / "list.csv", "-o", out, "--scheduler", address)
    killer.join(10)
    assert code == 0 and f"{ROWS} of {ROWS} rows are done" in said
    rows = report(out)
    assert len(rows) == ROWS
    # A worker can die after a row's folder is there and before it could say so: the row's second attempt finds it.
    assert {row["state"] for row in rows.values() if row["attempts"] == 1} == {"done"}
    assert {row["state"] for row in rows.values()} <= {"done", "kept"}
    assert (out / "report.html").is_file()
    for job in read_list(str(tmp_path / "list.csv"), str(out)):
        paths = {role: Path(location) for role, location in job.inputs.items()}
        expected = tmp_path / "converted" / job.name
        convert(job.source, expected, row_options.arguments(job.options, paths))
        assert files(Path(job.output) / job.product) == files(expected), job.name
    assert not [path for path in out.rglob("*") if "partial" in path.name]


def test_ctrl_c_ends_it_and_resume_does_what_is_missing(
    address: str, made: list[Row], run: Run, tmp_path: Path
) -> None:
    write_list(tmp_path / "list.csv", made[3:], 12)
    out, command = tmp_path / "out", ("batch", tmp_path / "list.csv", "-o", tmp_path / "out")
    when(out, 4, lambda: os.kill(os.getpid(), signal.SIGINT))
    code, _, said = run(*command, "--scheduler", address)
    assert code == 130 and "--resume does what is missing" in said.splitlines()[-2]
    states = [row["state"] for row in report(out).values()]
    assert 1 <= states.count("done") < 12 and states.count("done") + states.count("not done") == 12
    code, _, said = run(*command, "--scheduler", address)
    assert code == 2 and "--resume" in said
    before = {path: path.stat().st_mtime_ns for path in out.glob("row_*/result.json")}
    code, _, said = run(*command, "--scheduler", address, "--resume")
    assert code == 0 and "12 of 12 rows are done" in said
    kept = {name for name, row in report(out).items() if row["state"] == "kept"}
    assert kept >= {path.parent.name for path in before}, "what ran when it was stopped came to its end, too"
    assert all(path.stat().st_mtime_ns == then for path, then in before.items())


def test_a_row_that_fails_stops_no_other(address: str, made: list[Row], run: Run, tmp_path: Path) -> None:
    rows = write_list(tmp_path / "good.csv", made[2:], 2)
    wrong = {**rows[0], "name": "nothing", "source": str(tmp_path / "nothing")}
    write_list(tmp_path / "list.csv", [wrong, *rows], 3)
    code, _, said = run("batch", tmp_path / "list.csv", "-o", tmp_path / "out", "--scheduler", address)
    assert code == 1 and "2 of 3 rows are done" in said
    assert [line for line in said.splitlines() if "row_000: failed: " in line and "nothing" in line]
    failed = report(tmp_path / "out")["row_000"]
    assert (failed["state"], failed["kind"], failed["attempts"]) == ("failed", "input", 1)


@pytest.mark.parametrize(
    ("rows", "words", "said"),
    [
        ("source,colour\na,b", ("-o", "{}/out"), "colour"),
        ("source\na", ("-o", "{}/out", "--scheduler", "tcp://127.0.0.1:1"), "no scheduler answers"),
        ("source\nmemory://bucket/a", ("-o", "{}/out"), "memory://bucket"),
        ("source\na", ("-o", "memory://bucket/out"), "memory://bucket"),
    ],
)
def test_what_cannot_be_done_is_one_line_and_writes_nothing(
    rows: str, words: tuple[str, ...], said: str, refused: Refused, tmp_path: Path
) -> None:
    """The next try needs no --resume. Memory of this process is no place for workers."""
    (tmp_path / "list.csv").write_text(rows + "\n")
    assert said in refused("batch", tmp_path / "list.csv", *(word.format(tmp_path) for word in words))
    assert not (tmp_path / "out").exists()


def test_a_dry_run_makes_nothing(made: list[Row], run: Run, tmp_path: Path) -> None:
    write_list(tmp_path / "list.csv", made, 3)
    code, text, _ = run("batch", tmp_path / "list.csv", "-o", tmp_path / "out", "--dry-run")
    lines = text.splitlines()
    assert code == 0 and [line.split()[0] for line in lines] == ["row_000", "row_001", "row_002", "3"]
    assert not (tmp_path / "out").exists()


def test_without_the_extra_the_message_names_it(
    run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("avatar_export.batch.find_spec", lambda name: None)
    code, _, said = run("batch", tmp_path, "-o", tmp_path / "out")
    assert code == 2 and "the extra [batch]" in said


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
    command = [sys.executable, "-m", "avatar_export", "batch", str(tmp_path / "list.csv"), "-o", str(out)]
    paths = os.pathsep.join(str(Path(path).absolute()) for path in sys.path if path)
    environment = {**os.environ, "TMPDIR": str(scratch), "PYTHONPATH": paths}
    with subprocess.Popen(
        [*command, "--workers", "1"], cwd=here, env=environment, stderr=subprocess.PIPE, text=True
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


def listening(path: Path) -> None:
    here = Path.cwd()
    with socket.socket(socket.AF_UNIX) as server:
        os.chdir(path.parent)  # a socket's path is short
        try:
            server.bind(path.name)
        finally:
            os.chdir(here)


OTHERS = {
    "a pipe": os.mkfifo,
    "an endless device": lambda path: path.symlink_to("/dev/zero"),
    "a socket": listening,
}


@pytest.fixture
def alarm() -> Iterator[None]:

    def ring(number: int, frame: object) -> None:
        raise AssertionError("it waits")

    before = signal.signal(signal.SIGALRM, ring)
    signal.alarm(PATIENCE_S)
    yield
    signal.alarm(0)
    signal.signal(signal.SIGALRM, before)


@pytest.mark.usefixtures("alarm")
@pytest.mark.parametrize("kind", OTHERS)
def test_what_never_ends_is_no_source_no_list_and_no_record(kind: str, tmp_path: Path) -> None:
    make = OTHERS[kind]
    make(tmp_path / "head.zip")
    result = do(Job("one", str(tmp_path / "head.zip"), str(tmp_path / "one"), QUICK), "a")
    assert (result.state, result.kind) == ("failed", "input")
    assert result.message.startswith(f"{tmp_path}/head.zip: is a pipe, a device or a socket")
    make(tmp_path / "list.csv")
    with pytest.raises(AvatarError, match="not a regular file"):
        read_list(str(tmp_path / "list.csv"), str(tmp_path / "out"))
    (tmp_path / "old").mkdir()
    make(tmp_path / "old" / stores.RECORD)
    assert stores.read_record(str(tmp_path / "old")) is None
    splatting_files.write_gaussian_run(tmp_path / "in" / "run", splatting_files.arrays(degree=3))
    for ending in stores.ALONE:
        make(tmp_path / "in" / f"x{ending}")
    assert [job.name for job in read_list(str(tmp_path / "in"), str(tmp_path / "out"))] == ["run"]
