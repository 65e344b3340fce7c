"""enhancer.onnx and enhancer.json beside a checkpoint."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from avatar_export.readers.enhancer_file import read_enhancer, save_enhancer
from avatar_runtime.io.errors import AvatarError
from tests.enhancers import tiny


def test_what_is_saved_is_read(tmp_path: Path) -> None:
    assert read_enhancer(tmp_path) is None
    for enhancer in (tiny(), replace(tiny(), psnr_raw_db=None, psnr_enhanced_db=None, measured_on="Ä")):
        save_enhancer(tmp_path, enhancer)
        assert read_enhancer(tmp_path) == enhancer
    assert (tmp_path / "enhancer.onnx").read_bytes() == tiny().onnx


def refusal(folder: Path) -> str:
    with pytest.raises(AvatarError) as caught:
        read_enhancer(folder)
    assert "\n" not in str(caught.value)
    return str(caught.value)


@pytest.mark.parametrize(("gone", "left"), [("json", "onnx"), ("onnx", "json")])
def test_one_without_the_other(tmp_path: Path, gone: str, left: str) -> None:
    save_enhancer(tmp_path, tiny())
    (tmp_path / f"enhancer.{gone}").unlink()
    path = tmp_path / f"enhancer.{gone}"
    assert refusal(tmp_path) == f"{path}: is missing beside enhancer.{left}"


def drop(key: str) -> Callable[[Any], object]:
    return lambda said: said.pop(key)


FACTS: dict[str, tuple[Callable[[Any], object], str]] = {
    "missing": (drop("measured_on"), "$: 'measured_on' is a required property"),
    "layout": (lambda said: said.update(layout="NHWC"), "$.layout: 'NHWC' is unknown to this reader"),
    "width": (lambda said: said.update(trained_width=0), "$.trained_width: 0 is less than the minimum of 1"),
    "huge": (lambda said: said.update(trained_height=1 << 70), "$.trained_height: "),
    "text": (lambda said: said.update(psnr_raw_db="30"), "$.psnr_raw_db: '30' is not of type"),
    "infinite": (
        lambda said: said.update(psnr_raw_db=float("inf")),
        "enhancer.psnr_raw_db: is inf, expected decibels or none",
    ),
    "name": (lambda said: said.update(input=""), "$.input: '' should be non-empty"),
}


@pytest.mark.parametrize("what", FACTS)
def test_facts_that_make_no_sense(tmp_path: Path, what: str) -> None:
    save_enhancer(tmp_path, tiny())
    path = tmp_path / "enhancer.json"
    change, message = FACTS[what]
    said = json.loads(path.read_text("utf-8"))
    change(said)
    path.write_text(json.dumps(said), "utf-8")
    assert refusal(tmp_path).startswith(f"{path}: {message}")


@pytest.mark.parametrize("text", [b"{", b"[]", b"\xff", b'"x"', b"[" * 60000])
def test_facts_that_are_none(tmp_path: Path, text: bytes) -> None:
    save_enhancer(tmp_path, tiny())
    (tmp_path / "enhancer.json").write_bytes(text)
    assert refusal(tmp_path).startswith(f"{tmp_path / 'enhancer.json'}: ")


def test_files_that_are_too_large(tmp_path: Path) -> None:
    save_enhancer(tmp_path, tiny())
    for name, limit in (("enhancer.onnx", 8 << 20), ("enhancer.json", 1 << 16)):
        whole = (tmp_path / name).read_bytes()
        with (tmp_path / name).open("r+b") as file:
            file.truncate(limit + 1)
        assert refusal(tmp_path) == f"{tmp_path / name}: is {limit + 1} bytes long; up to {limit} are read"
        (tmp_path / name).write_bytes(whole)
    (tmp_path / "enhancer.onnx").write_bytes(b"")
    assert "enhancer.onnx: is 0 bytes, expected 1 to" in refusal(tmp_path)
