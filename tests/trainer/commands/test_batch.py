"""avatar-train batch: a worker dies in the middle of a training, which goes on from its newest checkpoint."""

from __future__ import annotations

import json
import os
import signal
import threading
import time
from collections.abc import Callable
from contextlib import nullcontext
from functools import partial
from pathlib import Path

import pytest

from avatar_export.batch import cluster, engine, running
from avatar_trainer.commands import batch
from tests.trainer.commands import toy_worker

Train = Callable[..., tuple[int, str, str]]
ITERATIONS = 40


def listed(path: Path, *rows: str) -> Path:
    path.write_text("\n".join(["name,system,source,iterations,checkpoint_every,set", *rows]) + "\n")
    return path


def test_a_training_whose_worker_dies_goes_on_from_its_newest_checkpoint(
    folder: Path, tmp_path: Path
) -> None:
    rows = [f"{name},toy,{folder},{ITERATIONS},5,log_every=1;evaluate_every=0" for name in ("one", "two")]
    trainings = batch.read_list(str(listed(tmp_path / "list.csv", *rows)), tmp_path / "out", 1)
    tasks = [engine.Task(one.name, 1, partial(batch.do, one)) for one in trainings]
    with cluster.local_client(1, preload=(toy_worker.__name__,)) as client:

        def kill() -> None:
            while not list((tmp_path / "out" / "one" / "checkpoints").glob("*0010.ckpt")):
                time.sleep(0.005)
            os.kill(next(iter(client.run(os.getpid).values())), signal.SIGKILL)

        killer = threading.Thread(target=kill, daemon=True)
        killer.start()
        results = running.do(tasks, nullcontext(client), 0, running.Unheard(), lambda found: None)
        killer.join(5)
    assert [(r.name, r.state) for r in results] == [("one", "done"), ("two", "done")], results
    assert "resumes from" in (tmp_path / "out" / "one" / "batch.log").read_text()
    measured = {
        name: json.loads((tmp_path / "out" / name / "evaluation.json").read_text()) for name in ("one", "two")
    }
    assert measured["one"]["splits"] == measured["two"]["splits"], "the same as without an interruption"
    assert results[0].psnr == pytest.approx(measured["one"]["splits"]["test"]["psnr_db"], rel=0)


@pytest.mark.parametrize(
    ("row", "said"),
    [
        ("a,toys,capture,1,1,", "did you mean toy"),
        ("a,toy,capture,many,1,", "--iterations"),
        ("a,toy,capture,1,1,\na,toy,capture,1,1,", "has the name 'a' of"),
        ("a,toy,,1,1,", "needs a source"),
        ("/a,toy,capture,1,1,", "leads out"),
        ("a,toy,simplecache::s3://u:PW@b/x,1,1,", "no known store"),
        ("a,toy,capture,1,1,\na/b,toy,capture,1,1,", "lies in the output of"),
    ],
)
def test_a_wrong_row_is_one_line(row: str, said: str, tmp_path: Path, avatar_train: Train) -> None:
    code, _, err = avatar_train("batch", listed(tmp_path / "list.csv", row), "-o", tmp_path / "out")
    assert code == 2 and err.count("\n") == 1
    assert "list.csv: line " in err and said in err and "PW" not in err
    assert not (tmp_path / "out").exists()


def test_a_capture_that_is_not_there_is_a_failed_row(tmp_path: Path) -> None:
    [one] = batch.read_list(str(listed(tmp_path / "list.csv", "a,toy,nothing,1,1,")), tmp_path / "out", 1)
    result = batch.do(one, "attempt")
    assert (result.state, result.kind, result.retryable) == ("failed", "input", False)
    assert "nothing" in result.message
