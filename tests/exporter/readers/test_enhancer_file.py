"""enhancer.onnx and enhancer.json beside a checkpoint."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from avatar_export.readers.enhancer_file import read_enhancer, save_enhancer
from tests.enhancers import tiny
from tests.exporter.refusals import put, refused


def test_what_is_saved_is_read(tmp_path: Path) -> None:
    assert read_enhancer(tmp_path) is None
    for enhancer in (tiny(), replace(tiny(), psnr_raw_db=None, psnr_enhanced_db=None, measured_on="Ä")):
        save_enhancer(tmp_path, enhancer)
        assert read_enhancer(tmp_path) == enhancer
    assert (tmp_path / "enhancer.onnx").read_bytes() == tiny().onnx


@pytest.fixture
def saved(tmp_path: Path) -> Path:
    save_enhancer(tmp_path, tiny())
    return tmp_path


def test_one_without_the_other(saved: Path) -> None:
    (saved / "enhancer.json").unlink()
    refused("enhancer.json: is missing beside enhancer.onnx$", read_enhancer, saved)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda said: said.pop("measured_on"), r"\$: 'measured_on' is a required"),
        (put("layout", "NHWC"), r"\$.layout: 'NHWC' is unknown"),
        (put("trained_width", 0), r"\$.trained_width: 0 is less"),
        (put("psnr_raw_db", "30"), r"\$.psnr_raw_db: '30' is not of type"),
        (put("psnr_raw_db", float("inf")), "enhancer.psnr_raw_db: is inf"),
    ],
)
def test_facts_that_make_no_sense(saved: Path, change: Callable[[Any], object], message: str) -> None:
    path = saved / "enhancer.json"
    said = json.loads(path.read_text("utf-8"))
    change(said)
    path.write_text(json.dumps(said), "utf-8")
    refused(f"{path}: {message}", read_enhancer, saved)


def test_files_of_a_wrong_size(saved: Path) -> None:
    for name, limit in (("enhancer.onnx", 8 << 20), ("enhancer.json", 1 << 16)):
        whole = (saved / name).read_bytes()
        (saved / name).write_bytes(bytes(limit + 1))
        refused(f"{name}: is {limit + 1} bytes long; up to {limit} ", read_enhancer, saved)
        (saved / name).write_bytes(whole)
    (saved / "enhancer.onnx").write_bytes(b"")
    refused("enhancer.onnx: is 0 bytes, expected 1 to", read_enhancer, saved)
