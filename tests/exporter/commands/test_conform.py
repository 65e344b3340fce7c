"""`conform`: what passes, which stage it names, what it leaves behind, and what bad references get."""

from __future__ import annotations

import base64
import io
import json
import os
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
from avatar_runtime.backends.reference import ReferenceBackend
from avatar_runtime.stages import STAGES
from tests import bundles
from tests.avatars import full_avatar
from tests.commands import Run
from tests.exporter.commands.references import CASES, VECTORS, edit_vectors


def table(text: str) -> dict[str, str]:
    """Stage, with its profile -> the end of its line."""
    rows = (re.split(r"\s{2,}", line.strip()) for line in text.splitlines())
    return {row[0]: row[-1] for row in rows if len(row) > 5}


def test_a_bundle_repeats_its_own_reference(run: Run, good: Path, tmp_path: Path) -> None:
    for path in (good, bundles.zipped(good, tmp_path / "x.avatar.zip")):
        code, text, error = run("conform", path, "--backend", "reference", "--pictures", tmp_path / "images")
        assert code == 0, error
        lines = table(text)
        rasters = [f"{what} {profile}" for what in ("raster", "image") for profile in ("trainer", "engine")]
        assert list(lines) == ["stage", *STAGES[:-1], *rasters]
        assert set(lines.values()) == {"verdict", "holds"}
        assert "backend reference repeats the reference; made by runtime" in text
        assert "case rest: " in error
        assert "bind: mean, log_scale, quat_wxyz, sh_rotation; activate: scale, quat_wxyz, opacity;" in text
        assert "not tested, position: normal (surface_area), " in error and "clone of the repository" in error
    assert not (tmp_path / "images").exists(), "images are for failures"


def test_a_left_handed_bundle(run: Run, tmp_path: Path) -> None:
    write_bundle(full_avatar(), tmp_path / "left", preview=False, engine_files=False, handedness="left")
    code, text, _ = run("conform", tmp_path / "left", "--backend", "reference")
    assert code == 0, text


def test_json(run: Run, good: Path) -> None:
    code, text, _ = run("conform", good, "--backend", "reference", "--json")
    facts = json.loads(text)
    assert (code, facts["passed"], facts["first_failure"], facts["made_by"]) == (0, True, None, "runtime")
    assert {(row["stage"], row["case"]) for row in facts["stages"]} >= {("blend", "rest"), ("blend", "clip")}
    assert all(row["passed"] and row["used"] <= 1 for row in facts["stages"])
    assert {(p["case"], p["profile"]) for p in facts["pictures"]} >= {
        ("posed", "engine"),
        ("clip", "trainer"),
    }
    assert set(facts["engine_psnr_db"]) == {"rest", "posed", "clip"}
    missing = {"kind": "rotation", "value": "none", "same_as": [], "bundle": "skin_unturned"}
    assert missing in facts["not_tested"]


def shift(name: str) -> Callable[[dict[str, Any]], None]:
    def change(tensors: dict[str, Any]) -> None:
        tensors[name][-1] += np.ones_like(tensors[name][-1]) * (
            1 if tensors[name].dtype.kind == "i" else 1e-2
        )

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
    assert code == 1
    assert len(list(images.iterdir())) == 6, "of the one case that fails"
    assert f"fails first at {stage};" in text
    label = stage if stage != "raster" else "raster engine"
    lines = table(text)
    assert lines[label] == "FAILS"
    before = list(lines)[1 : list(lines).index(label)]
    assert all(lines[name] == "holds" for name in before)
    assert all(lines[name] == "holds" for name in lines if name.startswith("image"))


@pytest.mark.parametrize("stage", ["joints", "sort", "raster"])
def test_validate_names_the_stage_too(bundle: Path, stage: str) -> None:
    edit_vectors(bundle, WRONG[stage])
    problems = [p for p in validate(bundle) if not p.warning]
    assert problems[0].path == f"{VECTORS}: {stage}"
    assert re.search(r"of case \w+ differs by \S+, \S+ times the tolerance", problems[0].message)


def test_a_backend_that_is_wrong(run: Run, good: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    right = ReferenceBackend.stage

    def transposed(self: Any, name: str, *rest: Any) -> Any:
        found = right(self, name, *rest)
        return found | ({"sh_rotation": np.swapaxes(found["sh_rotation"], 1, 2)} if name == "bind" else {})

    monkeypatch.setattr(ReferenceBackend, "stage", transposed)
    code, text, _ = run("conform", good, "--backend", "reference")
    lines = table(text)
    assert code == 1 and "fails first at bind;" in text
    assert [name for name, end in lines.items() if end == "FAILS"] == ["bind"]
    assert "sh_rotation" in next(line for line in text.splitlines() if line.startswith("bind"))


def test_the_element_that_is_off_is_named(run: Run, bundle: Path, tmp_path: Path) -> None:
    edit_vectors(bundle, lambda tensors: tensors["posed/bind/mean"].__setitem__((5, 1), 0.75))
    kept = load_tensors((bundle / VECTORS).read_bytes())
    page = tmp_path / "report.html"
    code, text, _ = run("conform", bundle, "--backend", "reference", "--report", page)
    words = rf"bind, case posed: mean\[5, 1\] of Gaussian {kept['rows'][5]}: got -?0\.\d+, expected 0\.75$"
    assert code == 1 and re.search(words, text, re.MULTILINE), text
    assert re.search(r"^bind .* >999 % +FAILS", text, re.MULTILINE)
    (line,) = re.findall(words, text, re.MULTILINE)
    assert f"<td>{line.split(': ', 1)[1]}</td>" in page.read_text("utf-8")
    facts = json.loads(run("conform", bundle, "--backend", "reference", "--json")[1])
    (row,) = [row for row in facts["stages"] if not row["passed"] and row["stage"] == "bind"]
    worst = row["worst"]
    assert (worst["index"], worst["gaussian"], worst["want"]) == ([5, 1], kept["rows"][5], 0.75)
    assert abs(worst["got"] - 0.75) == pytest.approx(row["error"])
    assert worst["tolerance"] == row["atol"] > 0 and row["rtol"] == 0
    assert all(image["unit"] == 1 / 255 for image in facts["pictures"])


def outputs_of(bundle: Path) -> dict[str, Any]:
    """What a port that is right would give."""
    tensors = load_tensors((bundle / VECTORS).read_bytes())
    cases = json.loads((bundle / CASES).read_text("utf-8"))["cases"]
    named = [o["tensor"] for c in cases for s in c["stages"] for o in s["outputs"].values()]
    return {name: tensors[name] for name in named}


def test_outputs_that_never_end_are_not_opened(run: Run, good: Path, tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "endless").symlink_to("/dev/zero")
    for name in ("pipe", "endless"):
        code, _, error = run("conform", good, "--outputs", tmp_path / name)
        assert code == 2 and error.count("\n") == 1 and "is not a regular file" in error


def test_a_ports_own_outputs(run: Run, good: Path, tmp_path: Path) -> None:
    file, page = tmp_path / "mine.safetensors", tmp_path / "report.html"
    tensors = outputs_of(good)
    file.write_bytes(save_tensors(tensors))
    code, text, error = run("conform", good, "--outputs", file, "--report", page)
    assert code == 0 and "the given output repeats the reference" in text, text + error
    assert "not given" not in error and "images are not compared" in error
    assert list(table(text)) == ["stage", *STAGES[:-1], "raster trainer", "raster engine"]
    assert "outputs mine.safetensors" in page.read_text("utf-8")
    tensors["posed/skin/posed_vertices"] = tensors["posed/skin/posed_vertices"] + np.float32(0.01)
    file.write_bytes(save_tensors({name: t for name, t in tensors.items() if "/skin/" in name}))
    code, text, error = run("conform", good, "--outputs", file)
    assert code == 1 and "the given output fails first at skin" in text
    assert re.search(r"skin, case posed: posed_vertices\[\d+, \d\] of vertex \d+: got", text)
    assert "not given, so skipped: rest: stage joints; " in error
    facts = json.loads(run("conform", good, "--outputs", file, "--json")[1])
    assert facts["backend"] is None and facts["first_failure"] == "skin" and facts["pictures"] == []


@pytest.mark.parametrize(
    ("tensors", "words"),
    [
        ({"posed/skin/vertices": np.zeros(3)}, "mine.safetensors: 'posed/skin/vertices' is not an output"),
        ({}, "mine.safetensors: holds no output"),
        (None, "mine.safetensors: cannot be read"),
    ],
)
def test_outputs_that_cannot_be_used_are_one_line(
    run: Run, good: Path, tmp_path: Path, tensors: dict[str, Any] | None, words: str
) -> None:
    file = tmp_path / "mine.safetensors"
    if tensors is not None:
        file.write_bytes(save_tensors(tensors))
    code, _, error = run("conform", good, "--outputs", file)
    assert (code, error.count("\n")) == (2, 1) and words in error, error
    code, _, error = run("conform", good, "--outputs", file, "--backend", "reference")
    assert code == 2 and "--outputs and --backend cannot be used together" in error


def test_images_of_what_fails(run: Run, bundle: Path, tmp_path: Path) -> None:
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
    code, _, error = run("conform", bundle, "--backend", "reference", "--pictures", out)
    assert (code, error.count("\n")) == (2, 1) and "exists" in error


def test_the_report_needs_nothing_else(run: Run, tmp_path: Path) -> None:
    avatar = replace(full_avatar(), name="<script>alert(1)</script>")
    write_bundle(avatar, tmp_path / "out", preview=False, engine_files=False)
    page = tmp_path / "report.html"
    arguments = ("conform", tmp_path / "out", "--backend", "reference", "--report", page)
    assert run(*arguments)[0] == 0
    text = page.read_text("utf-8")
    assert "<script" not in text and "http:" not in text and "https:" not in text
    sources = re.findall(r'src="([^"]+)"', text)
    assert len(sources) == 3 * 2 * 3, "reference, drawn and difference of two profiles of three cases"
    for source in sources:
        kind, data = source.split(",")
        assert kind == "data:image/png;base64"
        assert Image.open(io.BytesIO(base64.b64decode(data))).size == (256, 256)
    for stage in STAGES:
        assert f"<td>{stage}" in text
    code, _, error = run(*arguments)
    assert (code, error.count("\n")) == (2, 1) and "--force" in error
    assert run(*arguments, "--force")[0] == 0
    assert page.read_text("utf-8") == text, "the same results give the same bytes"
    code, _, error = run(*arguments[:-1], tmp_path / "no" / "report.html")
    assert (code, error.count("\n")) == (2, 1) and "its folder does not exist" in error


def test_user_errors(run: Run, good: Path, tmp_path: Path) -> None:
    code, _, error = run("conform", good, "--backend", "cuda")
    assert code == 2 and "--backend" in error
    code, _, error = run("conform", tmp_path / "no")
    assert (code, error.count("\n")) == (2, 1) and "no such file" in error
