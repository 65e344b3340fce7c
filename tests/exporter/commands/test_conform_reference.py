"""`conform` with references that are damaged, stale, missing, or made by somebody else."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from avatar_export.checks.bundle import validate
from tests import bundles
from tests.avatars import full_avatar
from tests.commands import Run
from tests.exporter.commands.references import CASES, VECTORS, edit_cases, edit_vectors


def drop(name: str) -> Callable[[dict[str, Any]], None]:
    return lambda tensors: tensors.pop(name)


def put(name: str, change: Callable[[Any], Any]) -> Callable[[dict[str, Any]], None]:
    return lambda tensors: tensors.__setitem__(name, change(tensors[name]))


def nan(tensor: Any) -> Any:
    tensor[0] = np.nan
    return tensor


BAD: dict[str, tuple[Callable[[Path], None], str]] = {
    "a missing tensor": (
        lambda b: edit_vectors(b, drop("posed/blend/sh")),
        f"{VECTORS}: posed/blend/sh: is missing",
    ),
    "a wrong shape": (
        lambda b: edit_vectors(b, put("rest/morph/vertices", lambda t: t[:-1].copy())),
        f"{VECTORS}: rest/morph/vertices: is float32[19, 3]",
    ),
    "a wrong type": (
        lambda b: edit_vectors(b, put("rest/morph/vertices", lambda t: t.astype(np.float64))),
        f"{VECTORS}: rest/morph/vertices: is float64[20, 3]",
    ),
    "no number": (
        lambda b: edit_vectors(b, put("rest/bind/mean", nan)),
        f"{VECTORS}: rest/bind/mean: holds a number that is not finite",
    ),
    "a newer version": (
        lambda b: edit_cases(b, lambda d: d["asset"].update(version="2.0", minVersion="2.0")),
        f"{CASES}: $.asset.version: is 2.0",
    ),
    "another document": (lambda b: edit_cases(b, lambda d: d.pop("cases")), f"{CASES}: $: 'cases'"),
    "rows beyond the avatar": (
        lambda b: edit_vectors(b, put("rows", lambda t: t + 7)),
        f"{VECTORS}: rows: name 54, but this avatar has 48: the reference was made for another",
    ),
    "cut vectors": (
        lambda b: (cut(b / VECTORS), bundles.sign(b))[1],
        f"{VECTORS}: ",
    ),
    "cut vectors, not signed": (lambda b: cut(b / VECTORS), f"{VECTORS}: is "),
    "cut cases": (lambda b: (cut(b / CASES), bundles.sign(b))[1], f"{CASES}: is not JSON"),
    "an altered byte": (lambda b: flip(b / VECTORS), f"{VECTORS}: sha256"),
    "a cut image": (
        lambda b: (cut(b / "reference" / "rest.engine.png"), bundles.sign(b))[1],
        "reference/rest.engine.png: is cut off or damaged",
    ),
    "a missing image": (
        lambda b: (b / "reference" / "rest.engine.png").unlink(),
        "reference/rest.engine.png: cannot be read",
    ),
    "an image that is not listed": (
        lambda b: bundles.edit(b, lambda d: unlist(d, "reference/rest.engine.png")),
        "avatar.json: $.files: does not list reference/rest.engine.png",
    ),
    "a stage that is gone": (
        lambda b: edit_cases(b, lambda d: drop_stage(d, "bind")),
        f"{CASES}: case posed lacks stage bind",
    ),
    "a tolerance that judges nothing": (
        lambda b: edit_cases(b, lambda d: d["cases"][1]["stages"][4]["outputs"]["mean"].update(atol=1e5)),
        f"{CASES}: posed/bind: mean may be 1e+05 ",
    ),
    "an expression of another avatar": (
        lambda b: edit_cases(b, lambda d: d["cases"][1]["pose"]["expressions"].update(grin=0.5)),
        f"{CASES}: posed: 'grin' is not an expression of this avatar",
    ),
    "a joint of another avatar": (
        lambda b: edit_cases(b, lambda d: d["cases"][1]["pose"]["joints"].update(tail=[0] * 16)),
        f"{CASES}: posed: 'tail' is not a joint of this avatar",
    ),
    "an image elsewhere": (
        lambda b: edit_cases(b, lambda d: d["cases"][0]["pictures"][0].update(colour="../preview.png")),
        f"{CASES}: ",
    ),
}


def drop_stage(document: dict[str, Any], stage: str) -> None:
    stages = document["cases"][1]["stages"]
    stages.remove(next(s for s in stages if s["stage"] == stage))


def cut(path: Path) -> None:
    data = path.read_bytes()
    path.write_bytes(data[: len(data) // 2])


def flip(path: Path) -> None:
    data = bytearray(path.read_bytes())
    data[-1] ^= 1
    path.write_bytes(data)


def unlist(document: dict[str, Any], path: str) -> None:
    document["files"] = [entry for entry in document["files"] if entry["path"] != path]


@pytest.mark.parametrize("name", BAD)
def test_a_reference_that_cannot_be_used_is_one_line(run: Run, bundle: Path, name: str) -> None:
    change, words = BAD[name]
    change(bundle)
    code, out, error = run("conform", bundle, "--backend", "reference")
    assert (code, out) == (2, "")
    assert error.count("\n") == 1 and words in error, error
    errors = [str(p) for p in validate(bundle) if not p.warning]
    assert any(words in text for text in errors), errors
    assert len(errors) <= 2


def test_a_reference_of_other_files_is_stale(run: Run, bundle: Path, tmp_path: Path) -> None:
    other = bundles.write(tmp_path / "other", full_avatar(seed=4))
    shutil.copy(other / "blendshapes.safetensors", bundle)
    bundles.edit(bundle, lambda d: d.update(blendshapes=bundles.manifest(other)["blendshapes"]))
    bundles.sign(bundle)
    words = "reference/cases.json: was made for another blendshapes.safetensors; run `convert` again"
    code, _, error = run("conform", bundle)
    assert (code, error) == (2, f"avatar-export: {words}\n")
    assert words in [str(p) for p in validate(bundle)]


def test_rules_that_changed_show_at_their_stage(run: Run, bundle: Path) -> None:
    bundles.edit(bundle, lambda d: d["rules"].update(rotation="none"))
    code, text, _ = run("conform", bundle, "--backend", "reference")
    assert code == 1 and "fails first at bind;" in text


def test_none_there(run: Run, tmp_path: Path) -> None:
    bundle = bundles.write(tmp_path / "bare")
    code, _, error = run("conform", bundle)
    assert (code, error.count("\n")) == (2, 1)
    assert "reference: is missing" in error and "convert" in error
    assert validate(bundle) == []


def test_who_made_it_is_kept(run: Run, bundle: Path) -> None:
    edit_cases(bundle, lambda d: d.update(made_by="trainer"))
    assert [p.path for p in validate(bundle)] == ["avatar.json: $.reference"]
    bundles.edit(bundle, lambda d: d["reference"].update(made_by="trainer"))
    assert validate(bundle) == []
    code, text, _ = run("conform", bundle, "--backend", "reference")
    assert code == 0 and "made by trainer" in text
    bundles.edit(bundle, lambda d: d["reference"].update(made_by="somebody"))
    code, _, error = run("conform", bundle)
    assert code == 2 and "$.reference.made_by" in error
