from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest

from avatar_export.driving.matrix import with_driving
from avatar_runtime.avatar import Driving, Expression
from avatar_runtime.checks.avatar import check_avatar
from tests.avatars import avatar_of, rig_of
from tests.exporter.refusals import refused

RIG = rig_of(("root", "head"), [-1, 0], np.tile(np.eye(4), (2, 1, 1)))

GOOD = {
    "inputs": ["JawOpen", "eyeBlink_L"],
    "outputs": ["expression/al", "joint/head/x"],
    "matrix": [[1, 0], [0, 2]],
}
TARGET = avatar_of((Expression("a", aliases=("al",)),), RIG, Driving(head_joint="head"), ("lid",))


def write(path: Path, document: object) -> Path:
    path.write_text(document if isinstance(document, str) else json.dumps(document))
    return path


def test_matrix_file(tmp_path: Path) -> None:
    avatar = check_avatar(with_driving(TARGET, write(tmp_path / "m.json", GOOD)))
    d = avatar.driving
    assert (d.mode, d.head_joint) == ("matrix", "head")
    assert (d.inputs, d.outputs) == (("jawOpen", "eyeBlinkLeft"), ("expression/a", "joint/head/x"))
    assert d.matrix is not None and d.matrix.tolist() == [[1, 0], [0, 2]]


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"inputs": ["JawOpn", "eyeBlink_L"]}, "inputs[0]: 'JawOpn' is not an ARKit name; did you mean jawOpen"),
        ({"inputs": ["jawOpen", "JawOpen"]}, "inputs: entries 0 and 1 are both jawOpen"),
        ({"inputs": []}, "inputs: is empty"),
        ({"outputs": ["expression/b", "joint/head/x"]}, "outputs[0]: 'expression/b' is not a driving output"),
        ({"outputs": ["expression/a", "expression/al"]}, "both expression/a"),
        ({"outputs": "expression/a"}, "needs an object with the lists"),
        ({"matrix": [[1, 0]]}, "matrix: has 1 rows for 2 outputs"),
        ({"matrix": [[1, 0], [1]]}, "matrix[1]: has 1 numbers for 2 inputs"),
        ({"matrix": [[1, 0], [float("nan"), 0]]}, "matrix[1][0]: nan is not a finite factor"),
        ({"matrix": [[10**400, 0], [0, 0]]}, "matrix[0][0]"),
    ],
)  # fmt: skip
def test_bad_matrix(tmp_path: Path, change: dict[str, object], said: str) -> None:
    refused(rf"m\.json.*{re.escape(said)}", with_driving, TARGET, write(tmp_path / "m.json", GOOD | change))


@pytest.mark.parametrize("text", ["", "[1]", "{", '{"inputs": ' + "[" * 100_000, "\ufeff{}", "1" * 5000])
def test_no_json(tmp_path: Path, text: str) -> None:
    refused(r"m\.json", with_driving, TARGET, write(tmp_path / "m.json", text))
