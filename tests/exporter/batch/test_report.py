"""The report and the plan of a batch."""

from __future__ import annotations

import base64
import io
import json
import re
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest
from fsspec.implementations.memory import MemoryFileSystem
from PIL import Image

from avatar_export.batch import memory, report, stores
from avatar_export.batch.failures import KINDS
from avatar_export.batch.job import STEPS, Job
from avatar_export.batch.products import SHOWN, Products
from avatar_export.batch.report_page import html_report
from avatar_export.batch.result import Result, from_json
from avatar_export.images import SHEET_SIZE, png
from avatar_runtime.io.errors import AvatarError

IMAGE = "data:image/webp;base64,UklGRg=="
BAD_NAME = "<script>alert(1)</script>\u202e"
FAILED = Result(
    "b", "failed", "store", "s3://bucket/b: the store failed", KINDS["store"].remedy, retryable=True
)


def made_row(folder: Path, name: str, preview: object) -> Result:
    """A row with a record that names an image."""
    (folder / name).mkdir(parents=True)
    record = {"format": stores.FORMAT, "folder": stores.HERE, "preview": preview}
    (folder / name / stores.RECORD).write_text(json.dumps(record))
    return Result(
        name, "done", output=str(folder / name), sizes={"bundle": 2_000_000, "pack": 500}, psnr=41.25
    )


class Page(HTMLParser):
    """Texts, tags and images of a page."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.tags: list[str] = []
        self.images: list[str] = []
        self.texts: list[str] = []
        self.feed(text)

    def handle_starttag(self, tag: str, attributes: list[tuple[str, str | None]]) -> None:
        self.tags.append(tag)
        self.images += [value or "" for name, value in attributes if name == "src"]

    def handle_data(self, data: str) -> None:
        self.texts.append(data.strip())


def test_a_report_has_every_row(tmp_path: Path) -> None:
    rows = [made_row(tmp_path, "a", IMAGE), FAILED, Result(BAD_NAME, "not done"), Result("d", "kept")]
    assert not report.exists(str(tmp_path))
    report.write(rows, str(tmp_path))
    assert report.exists(str(tmp_path))
    lines = (tmp_path / "report.jsonl").read_text("utf-8").splitlines()
    assert [from_json(json.loads(line), "x") for line in lines] == rows
    page = Page((tmp_path / "report.html").read_text("utf-8"))
    assert "script" not in page.tags and "link" not in page.tags
    assert {"4 rows: 1 done, 1 kept, 1 failed, 1 not done; 2.0 MB in all; CPU time 0 s"} <= {*page.texts}
    assert "41.2 dB" in page.texts and "store: 1" in page.texts
    assert f"What to do: {KINDS['store'].remedy}." in page.texts
    assert "<script>alert(1)</script>?" in page.texts
    assert page.images == [IMAGE]


def test_the_image_of_a_row_is_its_first_view(tmp_path: Path) -> None:
    sheet = np.zeros((2 * SHEET_SIZE, 5 * SHEET_SIZE, 3), np.uint8)
    sheet[..., 0] = 255
    sheet[:SHEET_SIZE, :SHEET_SIZE] = (0, 255, 0)
    (tmp_path / "a").mkdir()
    (tmp_path / "a" / "preview.png").write_bytes(png(sheet))
    made = Products(Job("a", "a", "a"), tmp_path, None, "right")
    address = made.preview
    assert address is not None and report.ADDRESS.fullmatch(address)
    data = base64.b64decode(address.removeprefix("data:image/webp;base64,"))
    with Image.open(io.BytesIO(data)) as image:
        red, green, blue = np.asarray(image.convert("RGB")).reshape(-1, 3).mean(axis=0)
        assert image.size == (SHOWN, SHOWN)
    assert green > 250 and red < 5 and blue < 5


def test_a_report_replaces_an_older_one(tmp_path: Path) -> None:
    report.write([FAILED], str(tmp_path))
    report.write([replace(FAILED, name="later")], str(tmp_path))
    assert "later" in (tmp_path / "report.html").read_text("utf-8")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["report.html", "report.jsonl"]


def test_a_report_in_a_store() -> None:
    report.write([FAILED], "memory://bucket/out")
    assert report.exists("memory://bucket/out")
    store = MemoryFileSystem()
    assert store.cat_file("/bucket/out/report.jsonl").count(b"\n") == 1
    store.rm("/bucket", recursive=True)


@pytest.mark.parametrize(
    "said", [None, 3, "https://elsewhere/x.webp", 'data:image/webp;base64,AA" onload="x']
)
def test_an_image_that_is_none_is_left_out(said: object, tmp_path: Path) -> None:
    assert report.preview(made_row(tmp_path, "a", said)) is None


def test_many_errors_of_a_kind_are_counted() -> None:
    rows = [replace(FAILED, name=f"row {index}") for index in range(50)]
    page = html_report(rows, {})
    assert "store: 50" in page and "and 30 more" in page
    assert page == html_report(rows, {})


def test_a_location_that_is_none() -> None:
    with pytest.raises(AvatarError, match="no known store"):
        report.exists("ftp://host/x")


def checkpoint(folder: Path, iterations: int, size: int) -> Job:
    """A run of the raw form; its files are holes."""
    folder.mkdir(parents=True)
    for index in range(iterations):
        with (folder / f"fix_chkpnt{index}.pth").open("wb") as file:
            file.truncate(size - index)
    return Job("a", str(folder), str(folder / "out"))


def test_of_a_run_one_checkpoint_counts(tmp_path: Path) -> None:
    one, ten = checkpoint(tmp_path / "one", 1, 10**9), checkpoint(tmp_path / "ten", 10, 10**9)
    assert memory.expected_bytes(one) == memory.expected_bytes(ten)
    assert memory.weight(ten) == ("raw", 10**9)


@pytest.mark.parametrize("row", memory.MEASURED, ids=lambda row: f"{row.form}-{row.steps}-{row.read_bytes}")
def test_a_measured_row_is_expected(row: memory.Measured, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(memory, "weight", lambda job: (row.form, row.read_bytes))
    size, seconds = memory.expected(Job("a", "b", "c", steps=STEPS if row.steps else ()))
    assert row.peak_bytes <= size <= 1.3 * row.peak_bytes
    assert seconds == pytest.approx(row.cpu_seconds)


def test_what_was_not_measured_is_not_less(tmp_path: Path) -> None:
    job = Job("a", str(tmp_path / "nothing"), str(tmp_path / "out"))
    assert memory.weight(job) == ("", 0)
    assert memory.expected_bytes(job) >= min(row.peak_bytes for row in memory.MEASURED)


def test_the_plan_says_rows_memory_and_time(tmp_path: Path) -> None:
    job = checkpoint(tmp_path / "one", 1, 10**9)
    lines = report.plan([job, replace(job, name="another", steps=("pack",))]).splitlines()
    size, seconds = memory.expected(job)
    assert lines[0].split() == [
        "a",
        f"{size / 1e9:.2f}",
        "GB",
        f"{seconds:.0f}",
        "s",
        job.source,
        "->",
        job.output,
    ]
    assert lines[1].endswith("  pack")
    assert re.fullmatch(r"2 rows; memory of the largest \d+\.\d\d GB; expected CPU time .*", lines[2])
