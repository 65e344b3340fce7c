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
from tests.commands import Refused, Run
from tests.exporter.commands.conftest import CASES, VECTORS, edit_cases, edit_vectors


def tensor(name: str, change: Callable[[Any], Any]) -> Callable[[Path], None]:
    return lambda bundle: edit_vectors(bundle, lambda t: t.__setitem__(name, change(t[name])))


def case(change: Callable[[Any], Any]) -> Callable[[Path], None]:
    return lambda bundle: edit_cases(bundle, lambda d: change(d["cases"][1]))


def cut(name: str, signed: bool = True) -> Callable[[Path], None]:
    def change(bundle: Path) -> None:
        data = (bundle / name).read_bytes()
        (bundle / name).write_bytes(data[: len(data) // 2])
        if signed:
            bundles.sign(bundle)

    return change


def flip(bundle: Path) -> None:
    data = bytearray((bundle / VECTORS).read_bytes())
    data[-1] ^= 1
    (bundle / VECTORS).write_bytes(data)


def unlist(bundle: Path) -> None:
    bundles.edit(bundle, lambda d: d.update(files=[e for e in d["files"] if e["path"] != IMAGE]))


IMAGE = "reference/rest.engine.png"
BAD: dict[str, tuple[Callable[[Path], Any], str]] = {
    "a missing tensor": (
        lambda b: edit_vectors(b, lambda t: t.pop("posed/blend/sh")),
        f"{VECTORS}: posed/blend/sh",
    ),
    "a wrong shape": (tensor("rest/morph/vertices", lambda t: t[:-1].copy()), "float32[19, 3]"),
    "a wrong type": (tensor("rest/morph/vertices", lambda t: t.astype(np.float64)), "float64[20, 3]"),
    "no number": (tensor("rest/bind/mean", lambda t: t * np.float32(np.nan)), "rest/bind/mean"),
    "rows beyond the avatar": (tensor("rows", lambda t: t + 7), "made for another"),
    "a newer version": (
        lambda b: edit_cases(b, lambda d: d["asset"].update(version="2.0", minVersion="2.0")),
        f"{CASES}: $.asset.version: is 2.0",
    ),
    "another document": (lambda b: edit_cases(b, lambda d: d.pop("cases")), f"{CASES}: $: 'cases'"),
    "cut vectors": (cut(VECTORS), f"{VECTORS}: "),
    "cut vectors, not signed": (cut(VECTORS, False), f"{VECTORS}: is "),
    "cut cases": (cut(CASES), f"{CASES}: is not JSON"),
    "an altered byte": (flip, f"{VECTORS}: sha256"),
    "a cut image": (cut(IMAGE), f"{IMAGE}: is cut off"),
    "a missing image": (lambda b: (b / IMAGE).unlink(), f"{IMAGE}: cannot be read"),
    "an image that is not listed": (unlist, f"$.files: does not list {IMAGE}"),
    "a stage that is gone": (
        case(lambda c: c.update(stages=[s for s in c["stages"] if s["stage"] != "bind"])),
        "lacks stage bind",
    ),
    "a tolerance that judges nothing": (
        case(lambda c: c["stages"][4]["outputs"]["mean"].update(atol=1e5)),
        f"{CASES}: posed/bind: mean may be 1e+05 ",
    ),
    "an expression of another avatar": (case(lambda c: c["pose"]["expressions"].update(grin=0.5)), "'grin'"),
    "a joint of another avatar": (case(lambda c: c["pose"]["joints"].update(tail=[0] * 16)), "'tail'"),
    "an image elsewhere": (case(lambda c: c["pictures"][0].update(colour="../preview.png")), f"{CASES}: "),
}


@pytest.mark.parametrize("name", BAD)
def test_a_reference_that_cannot_be_used_is_one_line(refused: Refused, bundle: Path, name: str) -> None:
    change, words = BAD[name]
    change(bundle)
    assert words in refused("conform", bundle, "--backend", "reference")
    errors = [str(p) for p in validate(bundle) if not p.warning]
    assert any(words in text for text in errors) and len(errors) <= 2, errors


def test_a_reference_of_other_files_is_stale(refused: Refused, bundle: Path, tmp_path: Path) -> None:
    other = bundles.write(tmp_path / "other", full_avatar(seed=4))
    shutil.copy(other / "blendshapes.safetensors", bundle)
    bundles.edit(bundle, lambda d: d.update(blendshapes=bundles.manifest(other)["blendshapes"]))
    bundles.sign(bundle)
    words = "was made for another blendshapes.safetensors"
    assert words in refused("conform", bundle) and any(words in str(p) for p in validate(bundle))


def test_none_there(refused: Refused, tmp_path: Path) -> None:
    bundle = bundles.write(tmp_path / "bare")
    assert "reference: is missing" in refused("conform", bundle)
    assert "no such file" in refused("conform", tmp_path / "no")
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
