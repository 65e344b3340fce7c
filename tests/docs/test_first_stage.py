"""The C program of the porter's guide compiles without a warning, agrees with the references, and notices a fault."""

from __future__ import annotations

import json
import shutil
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
SOURCE = ROOT / "docs" / "porter" / "first_stage.c"
BUNDLES = [ROOT / "samples" / "trained" / name for name in ("head_blendshapes", "head_splatting")]


def program(text: str, folder: Path) -> Path:
    """The source compiled, strictly."""
    compiler = shutil.which("cc") or shutil.which("gcc")
    assert compiler, "the guide's program needs a C compiler: sh .ci/packages tests"
    (folder / "first_stage.c").write_text(text, "utf-8")
    flags = ("-std=c99", "-Wall", "-Wextra", "-Werror", "-O2")
    subprocess.run([compiler, *flags, "-o", "first_stage", "first_stage.c", "-lm"], cwd=folder, check=True)
    return folder / "first_stage"


def test_it_agrees_with_every_case(tmp_path: Path) -> None:
    first_stage = program(SOURCE.read_text("utf-8"), tmp_path)
    for bundle in BUNDLES:
        cases = json.loads((bundle / "reference" / "cases.json").read_text("utf-8"))["cases"]
        names = [case["name"] for case in cases if any(stage["stage"] == "skin" for stage in case["stages"])]
        assert len(names) >= 3
        for name in names:
            command = [first_stage, bundle, name]
            done = subprocess.run(command, capture_output=True, text=True, check=False)
            assert done.returncode == 0 and "right" in done.stdout, done.stdout + done.stderr


@pytest.mark.parametrize(
    ("right", "wrong"),
    [
        (
            "m[0] * v[0] + m[1] * v[1] + m[2] * v[2] + m[3]",
            "sum[axis] * v[0] + sum[4 + axis] * v[1] + m[2] * v[2] + m[3]",
        ),
        ("posed += late_weight", "posed -= late_weight"),
        ("skin_weight[e] * matrix", "skin_weight[e] * NAN * matrix"),
        ("float posed = m[0]", "float posed = (row ? 0.0f : NAN) + m[0]"),  # one vertex alone
    ],
)
def test_it_notices_a_fault(right: str, wrong: str, tmp_path: Path) -> None:
    text = SOURCE.read_text("utf-8")
    assert right in text
    first_stage = program(text.replace(right, wrong), tmp_path)
    done = subprocess.run([first_stage, BUNDLES[0], "posed"], capture_output=True, text=True, check=False)
    assert done.returncode == 1 and "WRONG" in done.stdout


def test_the_page_shows_what_it_prints(tmp_path: Path) -> None:
    first_stage = program(SOURCE.read_text("utf-8"), tmp_path)
    said = subprocess.run(
        [first_stage, BUNDLES[0], "posed"], capture_output=True, text=True, check=True
    ).stdout
    page = (ROOT / "docs" / "porter" / "first_stage.md").read_text("utf-8")
    words = [word for word in said.split() if not word.startswith("7.5e-0")]  # rounding is the machine's own
    assert all(word in page for word in words)
