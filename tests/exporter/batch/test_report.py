"""The report of a batch, and the memory and time that its rows are expected to take."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import pytest
from fsspec.implementations.memory import MemoryFileSystem

from avatar_export.batch import memory, report, stores
from avatar_export.batch.failures import KINDS
from avatar_export.batch.job import STEPS, Job
from avatar_export.batch.result import Result, from_json
from avatar_runtime.io.errors import AvatarError
from tests.pages import Page

IMAGE = "data:image/webp;base64,UklGRg=="
BAD_NAME = "<script>alert(1)</script>\u202e"
FAILED = Result(
    "b", "failed", "store", "s3://bucket/b: the store failed", KINDS["store"].remedy, retryable=True
)


def made_row(folder: Path, name: str, preview: object) -> Result:
    (folder / name).mkdir(parents=True)
    record = {"format": stores.FORMAT, "folder": stores.HERE, "preview": preview}
    (folder / name / stores.RECORD).write_text(json.dumps(record))
    sizes = {"bundle": 2_000_000, "pack": 500}
    return Result(name, "done", output=str(folder / name), sizes=sizes, psnr=41.25)


def test_a_report_has_every_row(tmp_path: Path) -> None:
    rows = [made_row(tmp_path, "a", IMAGE), FAILED, Result(BAD_NAME, "not done"), Result("d", "kept")]
    assert not report.exists(str(tmp_path))
    report.write(rows, str(tmp_path))
    assert report.exists(str(tmp_path))
    lines = (tmp_path / "report.jsonl").read_text("utf-8").splitlines()
    assert [from_json(json.loads(line), "x") for line in lines] == rows
    page = Page((tmp_path / "report.html").read_text("utf-8"))
    assert not page.all("script") and not page.all("link")
    texts = " ".join(text.strip() for texts in page.text.values() for text in texts)
    for words in ("1 done, 1 kept, 1 failed, 1 not done", "41.2 dB", "store: 1", KINDS["store"].remedy):
        assert words in texts
    assert "<script>alert(1)</script>?" in texts and [image["src"] for image in page.all("img")] == [IMAGE]
    report.write([replace(FAILED, name="later")], str(tmp_path))
    assert "later" in (tmp_path / "report.html").read_text("utf-8")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a", "report.html", "report.jsonl"]


def test_a_report_in_a_store() -> None:
    report.write([FAILED], "memory://bucket/out")
    assert report.exists("memory://bucket/out")
    with pytest.raises(AvatarError, match="no known store"):
        report.exists("ftp://host/x")
    store = MemoryFileSystem()
    assert store.cat_file("/bucket/out/report.jsonl").count(b"\n") == 1
    store.rm("/bucket", recursive=True)


@pytest.mark.parametrize("row", memory.MEASURED, ids=lambda row: f"{row.form}-{row.steps}-{row.read_bytes}")
def test_a_measured_row_is_expected(row: memory.Measured, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(memory, "weight", lambda job: (row.form, row.read_bytes))
    size, seconds = memory.expected(Job("a", "b", "c", steps=STEPS if row.steps else ()))
    assert row.peak_bytes <= size <= 1.3 * row.peak_bytes
    assert seconds == pytest.approx(row.cpu_seconds)
