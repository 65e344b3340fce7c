"""`conform`: what passes, which stage it names, what it leaves behind, and what bad references get."""

from __future__ import annotations

import base64
import io
import json
import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image
from safetensors.numpy import load as load_tensors
from safetensors.numpy import save as save_tensors

from avatar_export.checks.bundle import validate
from avatar_export.writers.bundle import write_bundle
from avatar_runtime.stages import UNLIT
from tests import bundles
from tests.avatars import full_avatar
from tests.commands import Refused, Run
from tests.exporter.commands.conftest import CASES, VECTORS, edit_vectors


def table(text: str) -> dict[str, str]:
    rows = (re.split(r"\s{2,}", line.strip()) for line in text.splitlines())
    return {row[0]: row[-1] for row in rows if len(row) > 5}


def test_a_bundle_repeats_its_own_reference(run: Run, good: Path, tmp_path: Path) -> None:
    write_bundle(full_avatar(), tmp_path / "left", preview=False, engine_files=False, handedness="left")
    for path in (good, bundles.zipped(good, tmp_path / "x.avatar.zip"), tmp_path / "left"):
        code, text, error = run("conform", path, "--backend", "reference", "--pictures", tmp_path / "images")
        assert code == 0, error
        lines = table(text)
        rasters = [f"{what} {profile}" for what in ("raster", "image") for profile in ("trainer", "engine")]
        assert list(lines) == ["stage", *UNLIT[:-1], *rasters]
        assert set(lines.values()) == {"verdict", "holds"}
        assert "made by runtime" in text and "position: normal (surface_area)" in error
    assert not (tmp_path / "images").exists(), "images are for failures"


def shift(name: str) -> Callable[[dict[str, Any]], None]:
    def change(tensors: dict[str, Any]) -> None:
        tensors[name][-1] += 1 if tensors[name].dtype.kind == "i" else np.float32(1e-2)

    return change


def swap(name: str) -> Callable[[dict[str, Any]], None]:
    def change(tensors: dict[str, Any]) -> None:
        tensors[name][:2] = tensors[name][1::-1].copy()

    return change


WRONG = {
    "joints": shift("posed/joints/skin_matrix"),
    "morph": shift("posed/morph/vertices"),
    "skin": swap("rest/skin/posed_vertices"),
    "blend": shift("clip/blend/opacity_logit"),
    "bind": swap("posed/bind/sh_rotation"),
    "activate": shift("rest/activate/scale"),
    "project": shift("posed/project/depth"),
    "sort": swap("clip/sort/order"),
    "raster": lambda tensors: tensors["rest/raster.engine/colour"].__setitem__(slice(None), 0.5),
}


@pytest.mark.parametrize("stage", WRONG)
def test_the_stage_that_is_off_is_named_first(run: Run, bundle: Path, tmp_path: Path, stage: str) -> None:
    edit_vectors(bundle, WRONG[stage])
    images = tmp_path / "images"
    code, text, _ = run("conform", bundle, "--backend", "reference", "--pictures", images)
    assert code == 1 and f"fails first at {stage};" in text
    assert len(list(images.iterdir())) == 6, "of the one case that fails"
    label = stage if stage != "raster" else "raster engine"
    lines = table(text)
    assert lines[label] == "FAILS"
    before = list(lines)[1 : list(lines).index(label)]
    assert all(lines[name] == "holds" for name in lines if name in before or name.startswith("image"))
    problem = next(p for p in validate(bundle) if not p.warning)
    assert problem.path == f"{VECTORS}: {stage}" and "tolerance" in problem.message


def outputs_of(bundle: Path) -> dict[str, Any]:
    tensors = load_tensors((bundle / VECTORS).read_bytes())
    cases = json.loads((bundle / CASES).read_text("utf-8"))["cases"]
    named = [o["tensor"] for c in cases for s in c["stages"] for o in s["outputs"].values()]
    return {name: tensors[name] for name in named}


def test_a_ports_own_outputs(run: Run, good: Path, tmp_path: Path) -> None:
    file, page = tmp_path / "mine.safetensors", tmp_path / "report.html"
    tensors = outputs_of(good)
    file.write_bytes(save_tensors(tensors))
    code, text, error = run("conform", good, "--outputs", file, "--report", page)
    assert code == 0 and "not given" not in error, text + error
    assert list(table(text)) == ["stage", *UNLIT[:-1], "raster trainer", "raster engine"]
    assert "mine.safetensors" in page.read_text("utf-8")
    tensors["posed/skin/posed_vertices"] = tensors["posed/skin/posed_vertices"] + np.float32(0.01)
    file.write_bytes(save_tensors({name: t for name, t in tensors.items() if "/skin/" in name}))
    code, text, error = run("conform", good, "--outputs", file)
    assert code == 1 and "fails first at skin" in text and "stage joints" in error
    assert re.search(r"skin, case posed: posed_vertices\[\d+, \d\] of vertex \d+: got", text)
    facts = json.loads(run("conform", good, "--outputs", file, "--json")[1])
    assert facts["backend"] is None and facts["first_failure"] == "skin" and facts["pictures"] == []


@pytest.mark.parametrize(
    ("tensors", "words"),
    [
        ({"posed/skin/vertices": np.zeros(3)}, "'posed/skin/vertices' is not an output"),
        ({}, "holds no output"),
        (None, "cannot be read"),
        ("/dev/zero", "is not a regular file"),
    ],
)
def test_outputs_that_cannot_be_used_are_one_line(
    refused: Refused, run: Run, good: Path, tmp_path: Path, tensors: Any, words: str
) -> None:
    file = tmp_path / "mine.safetensors"
    if isinstance(tensors, str):
        file.symlink_to(tensors)
    elif tensors is not None:
        file.write_bytes(save_tensors(tensors))
    assert words in refused("conform", good, "--outputs", file)
    for flags in (("--outputs", file, "--backend", "reference"), ("--backend", "cuda")):
        code, _, error = run("conform", good, *flags)
        assert code == 2 and "--backend" in error


def test_images_of_what_fails(run: Run, refused: Refused, bundle: Path, tmp_path: Path) -> None:
    path = bundle / "reference" / "clip.engine.png"
    before = np.asarray(Image.open(path))
    spoilt = before.copy()
    spoilt[100:108, 40:48] ^= 64
    Image.fromarray(spoilt).save(path)
    bundles.sign(bundle)
    (problem,) = validate(bundle)
    assert problem.path == "reference/clip.engine.png" and "of 255, allowed 1" in problem.message
    out = tmp_path / "new" / "images"
    code, text, _ = run("conform", bundle, "--backend", "reference", "--pictures", out)
    assert code == 1 and "fails first at image;" in text
    assert re.search(r"image engine +clip .* 6[34]\.\d/255 +1/255 +>999 % +FAILS", text)
    assert table(text)["image engine"] == "FAILS"
    names = sorted(file.name for file in out.iterdir())
    assert names == [f"clip.{p}.{kind}.png" for p in ("engine", "trainer") for kind in ("diff", "got", "ref")]
    shown = {name: np.asarray(Image.open(out / name)) for name in names}
    np.testing.assert_array_equal(shown["clip.engine.ref.png"], spoilt)
    np.testing.assert_array_equal(shown["clip.engine.got.png"], before)
    assert (shown["clip.engine.diff.png"][100:108, 40:48] == 255).all()
    assert shown["clip.engine.diff.png"][:90].max() == 0
    assert "exists" in refused("conform", bundle, "--backend", "reference", "--pictures", out)


def test_the_report_needs_nothing_else(run: Run, refused: Refused, tmp_path: Path) -> None:
    avatar = replace(full_avatar(), name="<script>alert(1)</script>")
    write_bundle(avatar, tmp_path / "out", preview=False, engine_files=False)
    page = tmp_path / "report.html"
    arguments = ("conform", tmp_path / "out", "--backend", "reference", "--report", page)
    assert run(*arguments)[0] == 0
    text = page.read_text("utf-8")
    assert "<script" not in text and not re.search("https?:", text)
    sources = re.findall(r'src="data:image/png;base64,([^"]+)"', text)
    assert text.count("src=") == len(sources) == 3 * 2 * 3, "three images of two profiles of three cases"
    assert Image.open(io.BytesIO(base64.b64decode(sources[0]))).size == (256, 256)
    assert [stage for stage in UNLIT if f"<td>{stage}" not in text] == []
    assert "--force" in refused(*arguments)
    assert run(*arguments, "--force")[0] == 0
    assert page.read_text("utf-8") == text, "the same results give the same bytes"
    assert "folder" in refused(*arguments[:-1], tmp_path / "no" / "report.html")
