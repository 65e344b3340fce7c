"""Whole batches by the command line: a worker that is killed, a stop, what resumes, what comes out."""

from __future__ import annotations

import json
import os
import random
import signal
import threading
import time
from pathlib import Path
from typing import Any

import pytest
from bench.batch.lists import Row, mostly_cheap, write_list
from distributed import Client

from avatar_export.batch import row_options
from avatar_export.batch.jobs import read_list
from avatar_export.conversion import convert
from tests.commands import Run
from tests.exporter.batch.conftest import kill_worker

ROWS = 24
SEED = 3


def files(folder: Path) -> dict[str, bytes]:
    found = (path for path in sorted(folder.rglob("*")) if path.is_file())
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in found}


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


def test_a_wrong_list_is_one_line(run: Run, tmp_path: Path) -> None:
    (tmp_path / "list.csv").write_text("source,colour\na,b\n")
    code, _, said = run("batch", tmp_path / "list.csv", "-o", tmp_path / "out")
    assert code == 2 and said.count("\n") == 1 and "colour" in said
    assert not (tmp_path / "out").exists()


def test_nothing_is_written_where_no_scheduler_is(run: Run, tmp_path: Path) -> None:
    """The next try needs no --resume."""
    (tmp_path / "list.csv").write_text("source\na\n")
    command = ("batch", tmp_path / "list.csv", "-o", tmp_path / "out", "--scheduler", "tcp://127.0.0.1:1")
    code, _, said = run(*command)
    assert code == 2 and said.count("\n") == 1 and "no scheduler answers" in said
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(("source", "out"), [("memory://bucket/a", "out"), ("a", "memory://bucket/out")])
def test_memory_of_this_process_is_no_place_for_workers(
    source: str, out: str, run: Run, tmp_path: Path
) -> None:
    (tmp_path / "list.csv").write_text(f"source\n{source}\n")
    code, _, said = run("batch", tmp_path / "list.csv", "-o", out if "://" in out else tmp_path / out)
    assert code == 2 and said.count("\n") == 1 and "memory://bucket" in said
    assert not (tmp_path / "out").exists()


def test_a_dry_run_makes_nothing(made: list[Row], run: Run, tmp_path: Path) -> None:
    write_list(tmp_path / "list.csv", made, 3)
    code, text, _ = run("batch", tmp_path / "list.csv", "-o", tmp_path / "out", "--dry-run")
    lines = text.splitlines()
    assert code == 0 and [line.split()[0] for line in lines] == ["row_000", "row_001", "row_002", "3"]
    assert not (tmp_path / "out").exists()


def test_workers_of_this_machine_are_the_default(made: list[Row], run: Run, tmp_path: Path) -> None:
    write_list(tmp_path / "list.csv", made[2:], 1)
    code, _, said = run("batch", tmp_path / "list.csv", "-o", tmp_path / "out", "--workers", "1")
    assert code == 0 and "1 of 1 rows are done" in said


def test_without_the_extra_the_message_names_it(
    run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("avatar_export.batch.find_spec", lambda name: None)
    code, _, said = run("batch", tmp_path, "-o", tmp_path / "out")
    assert code == 2 and "the extra [batch]" in said
