"""One row on a local disk: its products, what keeps it, and what it says when it fails."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from avatar_export.batch import products, report, row, scratch
from avatar_export.batch.failures import StoreError
from avatar_export.batch.job import STEPS, Job
from avatar_export.batch.result import from_json
from avatar_export.batch.row import do, is_finished
from avatar_export.conversion import convert
from avatar_export.convert_options import ConvertOptions
from avatar_export.packing import make as packing
from avatar_export.packing.search import Aims
from avatar_runtime.io.errors import AvatarError
from avatar_schema.validate import Problem
from tests.commands import Run
from tests.exporter.batch.conftest import QUICK
from tests.exporter.readers import splatting_files
from tests.folders import contents
from tests.session.needed import need
from tests.session.rights import as_anybody

CHEAP_PACKS: dict[str, Any] = {  # most of the time goes into these
    "SIZE": 48,
    "preview_webp": lambda avatar: None,
    "default_backend": lambda: "reference",
    "POOR": Aims(200.0, 200.0),
}


@pytest.fixture
def job(face: Path, tmp_path: Path) -> Job:
    source = shutil.copy(face, tmp_path / "face.npz")
    return Job("one", str(source), str(tmp_path / "out" / "one"), QUICK)


def test_the_bundle_is_the_one_that_convert_writes(face: Path, tmp_path: Path) -> None:
    options = {**QUICK, "preview": True, "name": "Somebody", "handedness": "left"}
    result = do(Job("one", str(face), str(tmp_path / "one"), {**options, "licence": "CC0"}), "a")
    assert (result.state, result.message) == ("done", "")
    convert(face, tmp_path / "converted", ConvertOptions(**options, license="CC0"))
    assert report.preview(result) is not None
    made = contents(tmp_path / "one" / "one")
    assert made == contents(tmp_path / "converted")
    assert result.sizes == {"bundle": sum(map(len, made.values())) - len(made["avatar.json"])}
    assert result.seconds > 0 and result.cpu_seconds > 0 and result.peak_bytes > 1 << 20


@pytest.mark.parametrize(
    ("steps", "options"),
    [(("publish", "pack"), QUICK), pytest.param(STEPS, {}, marks=pytest.mark.more)],
    ids=["some", "all"],
)
def test_steps_make_what_the_commands_make(
    steps: tuple[str, ...], options: dict[str, bool], run: Run, face: Path, tmp_path: Path, monkeypatch: Any
) -> None:
    for name, value in CHEAP_PACKS.items():
        monkeypatch.setattr(packing, name, value)
    result = do(Job("one", str(face), str(tmp_path / "one"), options, steps), "a")
    assert result.state == "done" and result.message.startswith("the picture is poor: "), result.message
    here, pack = tmp_path / "one", tmp_path / "pack.avatar"
    images = ["one.png"] * ("render" in steps)
    assert left(here) == ["one", "one.avatar", "one.html", *images, "result.json"]
    _, said, _ = run("pack", here / "one", "-o", pack, "--json")
    assert (here / "one.avatar").read_bytes() == pack.read_bytes()
    assert result.psnr is not None
    assert abs(result.psnr - json.loads(said)["error"]["psnr_mask_db"]["mean"]) < 0.01
    if images:
        run("render", here / "one", "-o", tmp_path / "one.png")
        assert (here / "one.png").read_bytes() == (tmp_path / "one.png").read_bytes()
    run("publish", here / "one.avatar", "--single", "-o", tmp_path / "one.html")
    assert (here / "one.html").read_bytes() == (tmp_path / "one.html").read_bytes()
    assert result.sizes["pack"] == len(pack.read_bytes())


def other_record(job: Job, **said: object) -> None:
    path = Path(job.output) / "result.json"
    path.write_text(json.dumps({**json.loads(path.read_text()), **said}))


def product(job: Job) -> Path:
    return Path(job.output) / "one" / "gaussians.ply"


CHANGES: dict[str, Callable[[Job], Job | None]] = {
    "options": lambda job: replace(job, options={**job.options, "exact": True}),
    "a step": lambda job: replace(job, steps=("validate",)),
    "a product is gone": lambda job: product(job).unlink(),
    "a product is cut": lambda job: os.truncate(product(job), 10),
    "a record without result": lambda job: other_record(job, result=None),
    "a record without hashes": lambda job: other_record(job, inputs={"source": {"": []}}),
    "a record without inputs": lambda job: other_record(job, inputs=3),
}


@pytest.mark.parametrize("change", CHANGES)
def test_a_row_that_differs_is_made_again(change: str, job: Job) -> None:
    assert do(job, "a").state == "done"
    job = CHANGES[change](job) or job
    assert is_finished(job) is None
    made = do(job, "b")
    before = {path: path.stat().st_mtime_ns for path in Path(job.output).rglob("*")}
    os.utime(job.source, (1, 1))  # the same content
    assert do(job, "c") == replace(made, state="kept", seconds=0.0, cpu_seconds=0.0, peak_bytes=0)
    assert before == {path: path.stat().st_mtime_ns for path in Path(job.output).rglob("*")}


def test_a_row_of_another_version_or_another_input_is_made_again(
    job: Job, monkeypatch: pytest.MonkeyPatch
) -> None:
    result = do(job, "a")
    assert from_json(json.loads(json.dumps(result.as_json())), "x") == result
    with monkeypatch.context() as patch:
        patch.setattr(row, "GENERATOR", "avatar-export 99")
        assert is_finished(job) is None
    assert is_finished(job) is not None
    data = bytearray(Path(job.source).read_bytes())
    data[-1] ^= 1  # a zip's comment length: it can no longer be read
    Path(job.source).write_bytes(data)
    assert is_finished(job) is None


def left(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir()) if folder.exists() else []


def test_bad_data_is_one_line_and_leaves_nothing(job: Job) -> None:
    os.truncate(job.source, 2000)
    result = do(job, "a")
    assert (result.state, result.kind, result.retryable) == ("failed", "input", False)
    assert job.source in result.message and "\n" not in result.message and result.remedy
    assert "no such file" in do(replace(job, source=f"{job.source}.gone"), "a").message
    assert left(Path(job.output).parent) == []


def test_what_is_no_result_is_never_replaced(job: Job) -> None:
    out = Path(job.output)
    out.mkdir(parents=True)
    (out / "thesis.txt").write_text("years of work")
    result = do(job, "a")
    assert (result.state, result.kind) == ("failed", "output")
    assert contents(out) == {"thesis.txt": b"years of work"}


def test_an_older_result_stays_when_the_next_fails(job: Job) -> None:
    assert do(job, "a").state == "done"
    before = contents(Path(job.output))
    result = do(replace(job, options={**QUICK, "rig": job.source}), "b")
    assert result.state == "failed"
    assert contents(Path(job.output)) == before
    assert left(Path(job.output).parent) == ["one"]


def test_what_fails_its_checks_is_not_written(job: Job, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(products.checks, "validate", lambda path: [Problem("x", "is wrong")])
    result = do(replace(job, steps=("validate",)), "a")
    assert result.kind == "check" and "validate: x: is wrong" in result.message
    assert left(Path(job.output).parent) == []


def test_what_does_not_conform_is_an_error(job: Job, monkeypatch: pytest.MonkeyPatch) -> None:
    report = SimpleNamespace(passed=False, backend="cpu", first_failure="skin")
    monkeypatch.setattr(products, "conform_bundle", lambda path: SimpleNamespace(passed=False, report=report))
    with pytest.raises(StoreError, match="backend cpu fails first at skin") as caught:
        products.DO["conform"](SimpleNamespace(job=job, bundle=None))
    assert caught.value.kind == "check"


@pytest.mark.parametrize(
    ("error", "kind", "retryable"),
    [
        (MemoryError(), "memory", True),
        (OSError(28, "No space left on device"), "disk full", True),
        (AvatarError("needs 3 GB"), "input", False),
    ],
)
def test_what_the_machine_lacks(
    error: Exception, kind: str, retryable: bool, job: Job, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(*_: Any) -> None:
        raise error

    monkeypatch.setattr(row, "make", fail)
    result = do(job, "a")
    assert (result.state, result.kind, result.retryable) == ("failed", kind, retryable)
    assert result.message and result.remedy and left(Path(job.output).parent) == []


def test_an_output_that_cannot_be_written(job: Job) -> None:
    Path(job.output).parent.write_text("a file")
    result = do(job, "a")
    assert result.kind == "output" and "Not a directory" in result.message


def test_a_file_of_a_source_that_cannot_be_read_is_no_fault_of_the_output(tmp_path: Path) -> None:
    run = tmp_path / "run"
    splatting_files.write_gaussian_run(run, splatting_files.arrays(degree=3))
    (run / "point_cloud").chmod(0)
    job = Job("one", str(run), str(tmp_path / "out" / "one"), QUICK)
    result = as_anybody(lambda: do(job, "a"))
    (run / "point_cloud").chmod(0o755)
    assert result.kind == "input" and f"{run}/point_cloud: cannot be read" in result.message
    assert left(tmp_path / "out") == []


def test_a_bug_is_raised_and_leaves_nothing(job: Job, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(row, "make", lambda *_: {}["bug"])
    with pytest.raises(KeyError):
        do(job, "a")
    assert left(Path(job.output).parent) == []


@pytest.fixture
def small_disk(tmp_path: Path) -> Iterator[Path]:
    """A disk of 16 kB; skipped where nobody may mount one."""
    folder = tmp_path / "disk"
    folder.mkdir()
    command = ["mount", "-t", "tmpfs", "-o", "size=16k", "tmpfs", str(folder)]
    mounted = shutil.which("mount") and not subprocess.run(command, capture_output=True).returncode
    need({"a small disk that may be mounted (root)": mounted})
    yield folder
    subprocess.run(["umount", str(folder)], check=True)


def test_a_full_disk(small_disk: Path, job: Job) -> None:
    result = do(replace(job, output=str(small_disk / "one")), "a")
    assert (result.state, result.kind, result.retryable) == ("failed", "disk full", True)
    assert "No space left on device" in result.message and str(small_disk / "one") in result.message
    assert ".partial" not in result.message
    assert left(small_disk) == []


@pytest.fixture(scope="module")
def dead() -> str:
    with subprocess.Popen(["true"]) as child:
        return f"{scratch.socket.gethostname()}-{child.pid}"


def test_what_a_killed_attempt_left_goes_away(job: Job, dead: str) -> None:
    out = Path(job.output)
    killed = out.with_name(f".one.{dead}.a-0123.partial")
    (killed / "one").mkdir(parents=True)
    (killed / "one" / "gaussians.ply").write_bytes(b"half")
    kept = [f".another.{dead}.a-0123.partial", f".one.{alive()}.a-0123.partial"]
    for name in kept:
        out.with_name(name).mkdir()
    assert do(job, "a").state == "done"
    assert left(out.parent) == [*kept, "one"]


def alive() -> str:
    return f"{scratch.socket.gethostname()}-{os.getppid()}"


def test_folders_of_dead_processes_go_away(
    dead: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(scratch.tempfile, "tempdir", str(tmp_path))
    kept = [f"avatar-batch-{alive()}-abc", f"avatar-batch-elsewhere-{dead.rpartition('-')[2]}-abc", "other"]
    for name in (*kept, f"avatar-batch-{dead}-abc"):
        (tmp_path / name).mkdir()
    with scratch.folder() as work:
        assert left(tmp_path) == sorted([*kept, work.name])
    assert left(tmp_path) == sorted(kept)
