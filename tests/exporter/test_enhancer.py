"""An enhancer beside an avatar: written, kept, shown, left out, found broken."""

from __future__ import annotations

import importlib.util
import json
import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from PIL import Image

from avatar_export.checks.bundle import validate
from avatar_export.writers.bundle import write_bundle
from avatar_runtime.bundle import load
from tests import bundles
from tests.avatars import full_avatar
from tests.commands import Run
from tests.enhancers import expected, model, tiny
from tests.session.fuzz import examples

FILE = "enhancer.onnx"


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A bundle with all derived files but the preview."""
    out = tmp_path_factory.mktemp("enhancer") / "head"
    write_bundle(full_avatar(), out, preview=False)
    return out


@pytest.fixture
def bundle(whole: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(whole, tmp_path / "bundle"))


def problems(path: Path) -> list[tuple[str, str, bool]]:
    return [(p.path, p.message, p.warning) for p in validate(path)]


def test_the_manifest_says_what_the_specification_asks(whole: Path) -> None:
    document = bundles.manifest(whole)
    assert document["enhancer"] == {
        "file": FILE,
        "input": "colour",
        "output": "enhanced",
        "layout": "NCHW",
        "trained_width": 320,
        "trained_height": 240,
        "psnr_raw_db": 27.5,
        "psnr_enhanced_db": 29.25,
        "measured_on": "12 frames that were held out",
        "optional": True,
    }
    assert (whole / FILE).read_bytes() == tiny().onnx
    (entry,) = (entry for entry in document["files"] if entry["path"] == FILE)
    assert entry["derived"] is False
    assert FILE not in json.loads((whole / "reference" / "cases.json").read_text("utf-8"))["files"]


def test_without_one_nothing_speaks_of_it(tmp_path: Path) -> None:
    bundles.write(tmp_path / "out", replace(full_avatar(), enhancer=None))
    assert "enhancer" not in bundles.manifest(tmp_path / "out")
    assert FILE not in bundles.contents(tmp_path / "out")
    assert load(tmp_path / "out").enhancer is None


@pytest.mark.parametrize("decibels", [None, 31.0])
def test_figures_that_nobody_measured(tmp_path: Path, decibels: float | None) -> None:
    enhancer = replace(tiny(), psnr_raw_db=decibels, psnr_enhanced_db=None)
    again = load(bundles.write(tmp_path / "out", replace(full_avatar(), enhancer=enhancer))).enhancer
    assert again == enhancer


def test_converted_again_it_is_the_same_to_the_byte(run: Run, whole: Path, tmp_path: Path) -> None:
    right, left, back = (tmp_path / name for name in ("right.avatar.zip", "left", "back"))
    parts = ("--no-preview", "--no-reference")
    assert run("convert", whole, "-o", right, *parts)[0] == 0
    assert run("convert", right, "-o", left, *parts, "--handedness", "left")[0] == 0
    assert run("convert", left, "-o", back, *parts)[0] == 0
    assert bundles.contents(right) == bundles.contents(back)
    assert (left / FILE).read_bytes() == (whole / FILE).read_bytes() == tiny().onnx
    assert bundles.manifest(back)["provenance"]["author"] == "nobody"
    assert validate(left) == []


def test_who_takes_it_away_has_a_sound_bundle(bundle: Path) -> None:
    """The reference is not of it, so that nothing else has to be made anew."""
    (bundle / FILE).unlink()

    def leave_out(document: Any) -> None:
        del document["enhancer"]
        document["files"] = [entry for entry in document["files"] if entry["path"] != FILE]

    bundles.edit(bundle, leave_out)
    assert load(bundle).enhancer is None
    assert validate(bundle) == []


def test_a_network_that_is_not_run_is_a_problem(bundle: Path) -> None:
    network = model()
    network.graph.node[6].op_type = "Loop"
    (bundle / FILE).write_bytes(network.SerializeToString())
    bundles.sign(bundle)
    load(bundle)
    ((path, message, warning),) = problems(bundle)
    assert (path, warning) == ("enhancer.onnx: node 6", False) and message.startswith(
        "is 'Loop', not one of Add"
    )


def test_facts_that_are_not_the_file_s_are_a_problem(bundle: Path) -> None:
    bundles.edit(bundle, lambda d: d["enhancer"].update(input="picture"))
    message = "is not 'picture' alone, as the avatar says"
    assert problems(bundle) == [("enhancer.onnx: graph.input", message, False)]


def test_without_the_libraries_validate_says_so(whole: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    _without(monkeypatch, "onnxruntime")
    message = 'was not checked: that needs onnxruntime: pip install -e ".[enhance]"'
    assert problems(whole) == [(FILE, message, True)]


def _without(monkeypatch: pytest.MonkeyPatch, library: str) -> None:
    found = importlib.util.find_spec
    monkeypatch.setattr(
        importlib.util, "find_spec", lambda name, *more: None if name == library else found(name, *more)
    )


EDITS = st.lists(st.tuples(st.floats(0, 1), st.integers(0, 8), st.binary(max_size=8)), min_size=1, max_size=3)


@settings(max_examples=examples(40))
@given(EDITS)
def test_a_mangled_network_loads_and_is_a_problem_or_sound(
    tmp_path_factory: pytest.TempPathFactory, edits: list[tuple[float, int, bytes]]
) -> None:
    data = bytearray(tiny().onnx)
    for where, gone, come in edits:
        at = int(where * len(data))
        data[at : at + gone] = come
    data = data or bytearray(b"x")
    avatar = replace(full_avatar(), enhancer=replace(tiny(), onnx=bytes(data)))
    path = bundles.write(tmp_path_factory.mktemp("mangled") / "out", avatar)
    assert load(path).enhancer == avatar.enhancer
    assert all(p.path.startswith("enhancer.onnx") for p in validate(path))


def test_render(run: Run, whole: Path, tmp_path: Path) -> None:
    view = ("--size", "45x38", "--background", "0.8,0.6,0.4", "--backend", "reference")
    images = {}
    for name, more in {"raw": (), "better": ("--enhance",)}.items():
        code, _, _ = run("render", whole, "-o", tmp_path / f"{name}.png", *view, *more)
        assert code == 0
        images[name] = np.asarray(Image.open(tmp_path / f"{name}.png"), np.float32) / 255
    want = np.clip(expected(images["raw"]), 0, 1)
    assert np.abs(images["better"] - want).max() < 3 / 255  # of a raw image that was rounded to bytes
    assert np.abs(images["better"] - images["raw"]).max() > 0.1


def test_render_without_background(run: Run, whole: Path, tmp_path: Path) -> None:
    """Transparency stays as it is drawn."""
    view = ("--size", "40", "--background", "transparent")
    for name, more in {"raw": (), "better": ("--enhance",)}.items():
        assert run("render", whole, "-o", tmp_path / f"{name}.png", *view, *more)[0] == 0
    raw, better = (np.asarray(Image.open(tmp_path / f"{name}.png")) for name in ("raw", "better"))
    assert np.array_equal(raw[..., 3], better[..., 3]) and not np.array_equal(raw, better)


def test_what_cannot_be_enhanced_is_one_line(
    run: Run, whole: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    bundles.write(tmp_path / "plain", replace(full_avatar(), enhancer=None))
    enhance = ("-o", tmp_path / "out.png", "--size", "16", "--enhance")
    code, _, error = run("render", tmp_path / "plain", *enhance)
    assert (code, error) == (2, "avatar-export: enhancer: this avatar has none; draw it as it is\n")
    _without(monkeypatch, "onnxruntime")
    code, _, error = run("render", whole, *enhance)
    assert (code, error) == (
        2,
        'avatar-export: enhancer: needs onnxruntime: pip install -e ".[enhance]"\n',
    )
    assert not (tmp_path / "out.png").exists()
    assert run("render", whole, *enhance[:-1])[0] == 0


def test_inspect(run: Run, whole: Path, tmp_path: Path) -> None:
    shown = json.loads(run("inspect", whole, "--json")[1])["enhancer"]
    assert shown == {
        "optional": "render --enhance",
        "bytes": len(tiny().onnx),
        "trained_on": "320x240",
        "psnr": "27.50 dB without it, 29.25 dB with it",
        "measured_on": "12 frames that were held out",
    }
    bundles.write(tmp_path / "plain", replace(full_avatar(), enhancer=None))
    assert json.loads(run("inspect", tmp_path / "plain", "--json")[1])["enhancer"] is None
