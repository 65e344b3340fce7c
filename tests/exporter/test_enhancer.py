"""An enhancer beside an avatar: written, kept, shown, left out, found broken."""

from __future__ import annotations

import importlib.util
import json
import shutil
from dataclasses import replace
from pathlib import Path

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
from tests.commands import Refused, Run
from tests.enhancers import expected, model, tiny
from tests.session.fuzz import examples

FILE = "enhancer.onnx"


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("enhancer") / "head"
    write_bundle(full_avatar(), out, preview=False)
    return out


@pytest.fixture
def bundle(whole: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(whole, tmp_path / "bundle"))


def problems(path: Path) -> list[tuple[str, str, bool]]:
    return [(p.path, p.message, p.warning) for p in validate(path)]


def test_the_manifest_says_what_the_specification_asks(whole: Path, tmp_path: Path) -> None:
    document, said = bundles.manifest(whole), tiny()
    names = ("trained_width", "trained_height", "psnr_raw_db", "psnr_enhanced_db", "measured_on")
    assert document["enhancer"] == {
        **dict(zip(("file", "input", "output", "layout"), (FILE, "colour", "enhanced", "NCHW"), strict=True)),
        **{name: getattr(said, name) for name in names},
        "optional": True,
    }
    assert (whole / FILE).read_bytes() == said.onnx
    (entry,) = (entry for entry in document["files"] if entry["path"] == FILE)
    assert entry["derived"] is False
    assert FILE not in json.loads((whole / "reference" / "cases.json").read_text("utf-8"))["files"]
    plain = bundles.write(tmp_path / "out", replace(full_avatar(), enhancer=None))
    assert "enhancer" not in bundles.manifest(plain) and FILE not in bundles.contents(plain)
    assert load(plain).enhancer is None


def test_a_network_that_is_not_run_is_a_problem(bundle: Path) -> None:
    bundles.edit(bundle, lambda d: d["enhancer"].update(input="picture"))
    assert [(path, warning) for path, _, warning in problems(bundle)] == [
        ("enhancer.onnx: graph.input", False)
    ]
    bundles.edit(bundle, lambda d: d["enhancer"].update(input="colour"))
    network = model()
    network.graph.node[6].op_type = "Loop"
    (bundle / FILE).write_bytes(network.SerializeToString())
    bundles.sign(bundle)
    load(bundle)
    ((path, message, warning),) = problems(bundle)
    assert (path, warning) == ("enhancer.onnx: node 6", False) and "'Loop'" in message


def test_without_the_libraries_validate_says_so(whole: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    _without(monkeypatch, "onnxruntime")
    ((path, message, warning),) = problems(whole)
    assert (path, warning) == (FILE, True) and "[enhance]" in message


def _without(patch: pytest.MonkeyPatch, library: str) -> None:
    found = importlib.util.find_spec
    patch.setattr(importlib.util, "find_spec", lambda name, *a: None if name == library else found(name, *a))


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


@pytest.mark.parametrize("background", ["0.8,0.6,0.4", "transparent"])
def test_render(run: Run, whole: Path, tmp_path: Path, background: str) -> None:
    """Transparency stays as it is drawn."""
    view = ("--size", "45x38", "--background", background, "--backend", "reference")
    for name, more in {"raw": (), "better": ("--enhance",)}.items():
        assert run("render", whole, "-o", tmp_path / f"{name}.png", *view, *more)[0] == 0
    raw, better = (np.asarray(Image.open(tmp_path / f"{n}.png"), np.float32) / 255 for n in ("raw", "better"))
    assert np.abs(better - raw).max() > 0.1 and np.array_equal(raw[..., 3:], better[..., 3:])
    if background != "transparent":
        assert (
            np.abs(better - np.clip(expected(raw), 0, 1)).max() < 3 / 255
        )  # of a raw image rounded to bytes


def test_what_cannot_be_enhanced_is_one_line(
    run: Run, refused: Refused, whole: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    plain = bundles.write(tmp_path / "plain", replace(full_avatar(), enhancer=None))
    enhance = ("-o", tmp_path / "out.png", "--size", "16", "--enhance")
    assert "enhancer: " in refused("render", plain, *enhance)
    assert json.loads(run("inspect", plain, "--json")[1])["enhancer"] is None
    _without(monkeypatch, "onnxruntime")
    assert "[enhance]" in refused("render", whole, *enhance)
    assert not (tmp_path / "out.png").exists()
    assert run("render", whole, *enhance[:-1])[0] == 0
