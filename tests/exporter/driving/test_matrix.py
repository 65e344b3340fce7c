from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from avatar_export.driving.matrix import with_driving
from avatar_runtime.avatar import Driving, Expression
from avatar_runtime.checks.avatar import check_avatar
from avatar_runtime.io.errors import AvatarError
from tests.avatars import avatar_of, rig_of
from tests.session.fuzz import examples

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
    assert (d.mode, d.inputs, d.outputs, d.head_joint) == (
        "matrix",
        ("jawOpen", "eyeBlinkLeft"),
        ("expression/a", "joint/head/x"),
        "head",
    )
    assert d.matrix is not None and d.matrix.tolist() == [[1, 0], [0, 2]]


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (
            {"inputs": ["JawOpn", "eyeBlink_L"]},
            "inputs[0]: 'JawOpn' is not an ARKit name; did you mean jawOpen",
        ),
        ({"inputs": ["jawOpen", "JawOpen"]}, "inputs: entries 0 and 1 are both jawOpen"),
        ({"inputs": [1, 2]}, "inputs[0]: 1 is not a name"),
        ({"inputs": []}, "inputs: is empty"),
        ({"outputs": ["expression/b", "joint/head/x"]}, "outputs[0]: 'expression/b' is not a driving output"),
        ({"outputs": ["expression/a", "expression/al"]}, "both expression/a"),
        ({"outputs": ["expression/a", "joint/head/w"]}, "did you mean joint/head/"),
        ({"outputs": "expression/a"}, "needs an object with the lists"),
        ({"matrix": [[1, 0]]}, "matrix: has 1 rows for 2 outputs"),
        ({"matrix": [[1, 0], [1]]}, "matrix[1]: has 1 numbers for 2 inputs"),
        ({"matrix": [[1, 0], 3]}, "matrix[1]: has no numbers"),
        ({"matrix": [[1, 0], [float("nan"), 0]]}, "matrix[1][0]: nan is not a finite factor"),
        ({"matrix": [[1, True], [0, 0]]}, "matrix[0][1]"),
        ({"matrix": [[10**400, 0], [0, 0]]}, "matrix[0][0]"),
        ({"matrix": [[1, [2]], [0, 0]]}, "matrix[0][1]: list is no"),
    ],
)
def test_bad_matrix(tmp_path: Path, change: dict[str, object], said: str) -> None:
    with pytest.raises(AvatarError, match=r"m\.json") as caught:
        with_driving(TARGET, write(tmp_path / "m.json", GOOD | change))
    assert said in str(caught.value)


@pytest.mark.parametrize("text", ["", "[1]", "{", '{"inputs": ' + "[" * 100_000, "\ufeff{}", "1" * 5000])
def test_no_json(tmp_path: Path, text: str) -> None:
    with pytest.raises(AvatarError, match=r"m\.json"):
        with_driving(TARGET, write(tmp_path / "m.json", text))


LEAF = (
    st.none()
    | st.booleans()
    | st.integers()
    | st.floats()
    | st.sampled_from(["jawOpen", "expression/a", "x"])
)
TREE = st.recursive(LEAF, lambda inner: st.lists(inner, max_size=3), max_leaves=6)


@settings(max_examples=examples(100))
@given(st.fixed_dictionaries({}, optional={"inputs": TREE, "outputs": TREE, "matrix": TREE}))
def test_no_document_breaks_the_matrix_reader(tmp_path_factory: pytest.TempPathFactory, change: dict) -> None:
    path = tmp_path_factory.getbasetemp() / "any.json"
    try:
        check_avatar(with_driving(TARGET, write(path, GOOD | change)))
    except AvatarError as error:
        assert "\n" not in str(error)
