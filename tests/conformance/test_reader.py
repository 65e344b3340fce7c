"""The JavaScript that ports start from reads the vectors as Python does, and two stages in it pass."""

from __future__ import annotations

import json
import subprocess
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from avatar_runtime.conformance import encode
from avatar_runtime.conformance.files import ROWS, VERTICES, step_tensors
from tests.conformance.avatars import AVATARS
from tests.conformance.cases import DATA
from tests.conformance.references import committed
from tests.interop.clients import node_program

HERE = Path(__file__).parent
READER = HERE.parents[1] / "engine_shaders" / "web" / "read_reference.mjs"


def answer(folder: Path) -> dict[str, Any]:
    done = subprocess.run(
        [node_program(), str(HERE / "reader.mjs")],
        input=str(folder),
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert done.returncode == 0, done.stderr[-2000:]
    found: dict[str, Any] = json.loads(done.stdout)
    return found


@pytest.mark.parametrize("avatar", AVATARS)
def test_javascript_reads_every_tensor_and_passes_two_stages(avatar: str) -> None:
    reference, found = committed(avatar), answer(DATA / avatar)
    names = {ROWS, VERTICES}.union(*(step_tensors(s) for v in reference.cases for s in v.steps))
    assert found["sums"].keys() == names
    for name in names:
        length, total = found["sums"][name]
        assert length == reference.tensors[name].size
        assert total == pytest.approx(
            float(reference.tensors[name].astype("float64").sum()), rel=1e-9, abs=1e-9
        )
    stages = {(case.case.name, stage) for case in reference.cases for stage in ("activate", "sort")}
    assert {(case, stage) for case, stage, _, _ in found["used"]} == stages
    assert all(share is not None and share <= 1 for _, _, _, share in found["used"])


def test_javascript_says_what_is_beyond_its_tolerance(tmp_path: Path) -> None:
    reference = committed("still")
    name = "posed/activate/scale"
    altered = replace(
        reference, tensors={**reference.tensors, name: reference.tensors[name] * np.float32(1.0001)}
    )
    for file, data in encode(altered).items():
        (tmp_path / file).write_bytes(data)
    shares = {(stage, array): share for _, stage, array, share in answer(tmp_path)["used"]}
    assert {key for key, share in shares.items() if share > 1} == {("activate", "scale")}
    assert shares["activate", "scale"] == pytest.approx(1e-4 / (64 * 2.0**-24), rel=0.05)


def test_the_reader_fits_into_twenty_lines() -> None:
    assert len(READER.read_text("utf-8").splitlines()) <= 20
