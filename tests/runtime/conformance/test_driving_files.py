"""Vectors of `driving` through files and back; files that are wrong get one line."""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from jsonschema import Draft202012Validator
from safetensors.numpy import load as load_with_library

from avatar_runtime.codec import safetensors
from avatar_runtime.conformance import DrivingReference, decode_driving, driving_cases, encode_driving
from avatar_runtime.driving.arkit import CHANNELS
from avatar_runtime.io.errors import AvatarError
from avatar_schema import LATEST, schema
from tests.avatars import full_avatar
from tests.conformance.avatars import AVATARS
from tests.session.fuzz import examples

MADE = driving_cases(full_avatar(), generator="made for tests")
FILES = encode_driving(MADE)
CASES, VECTORS = "driving.json", "driving.safetensors"
Document = dict[str, Any]


def read(files: dict[str, bytes]) -> DrivingReference:
    def one(name: str, limit: int) -> bytes:
        assert len(files[name]) <= limit
        return files[name]

    return decode_driving(one)


def refused(**changed: bytes) -> str:
    """The one line that a changed file is refused with; `cases` and `vectors` name the two."""
    names = {"cases": CASES, "vectors": VECTORS}
    with pytest.raises(AvatarError) as error:
        read(FILES | {names[key]: data for key, data in changed.items()})
    line = str(error.value)
    assert "\n" not in line and len(line) < 400
    return line


def changed_cases(change: Callable[[Document], object]) -> bytes:
    document = json.loads(FILES[CASES])
    change(document)
    return json.dumps(document).encode()


def changed_vectors(**changed: Any) -> bytes:
    tensors = safetensors.decode(FILES[VECTORS], "x") | {k.replace("__", "/"): v for k, v in changed.items()}
    return b"".join(safetensors.encode({name: a for name, a in tensors.items() if a is not None}))


def test_what_is_written_is_read_back_bit_for_bit() -> None:
    found = read(FILES)
    assert encode_driving(found) == FILES
    assert (found.avatar, found.handedness, found.generator) == ("Full Ävatar", "right", "made for tests")
    assert found.cases == MADE.cases and found.tensors.keys() == MADE.tensors.keys()
    for name, tensor in found.tensors.items():
        np.testing.assert_array_equal(tensor, MADE.tensors[name])
    with_library = load_with_library(FILES[VECTORS])
    assert with_library.keys() == found.tensors.keys()


def test_the_document_is_of_its_schema_and_names_the_channels() -> None:
    document = json.loads(FILES[CASES])
    Draft202012Validator.check_schema(schema("driving"))
    Draft202012Validator(schema("driving")).validate(document)
    assert document["channels"] == list(CHANNELS) and document["asset"]["version"] == LATEST
    steps = {step["stage"]: step for step in document["cases"][0]["stages"]}
    given = {array: said["tensor"] for array, said in steps["joints"]["inputs"].items()}
    made = {array: said["tensor"] for array, said in steps["driving"]["outputs"].items()}
    assert given["joint_delta"] == made["joint_delta"]


def test_a_still_avatar_without_driving_has_no_cases() -> None:
    still = driving_cases(AVATARS["still"]())
    assert still.cases == () and still.tensors == {}
    assert read(encode_driving(still)).cases == ()


def stage(document: Document, case: int = 1, at: int = 0) -> Document:
    found: Document = document["cases"][case]["stages"][at]
    return found


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda d: d["asset"].update(version="2.0", minVersion="2.0"), "update avatar-export"),
        (lambda d: d.update(handedness="up"), "$.handedness: 'up' is unknown"),
        (lambda d: d["channels"].reverse(), "channels: are not the 61 channels"),
        (lambda d: d["cases"][1].update(name="still"), "still: is the name of two cases"),
        (lambda d: d["cases"][1].update(within_range=1), "within_range"),
        (lambda d: d["cases"][1]["stages"].reverse(), "weights: has its stages twice or out of order"),
        (lambda d: stage(d).update(stage="blend"), "'blend' is unknown"),
        (lambda d: stage(d)["inputs"].pop("channels"), "weights/driving: lacks channels"),
        (lambda d: stage(d)["outputs"].pop("late_weights"), "weights/driving: lacks late_weights"),
        (lambda d: stage(d)["inputs"].update(x=stage(d)["inputs"]["channels"]), "'x' is not one of channels"),
        (lambda d: stage(d)["outputs"]["late_weights"].update(atol=1.0), "that would judge nothing"),
        (lambda d: stage(d)["outputs"]["late_weights"].update(rtol=0.1), "that would judge nothing"),
        (lambda d: stage(d)["outputs"]["late_weights"].update(flips="sign"), "'flips' is unknown"),
        (lambda d: stage(d)["outputs"]["late_weights"].update(weight=3), "'weight' is unknown"),
        (lambda d: stage(d).update(pixels=3), "'pixels' is unknown"),
        (lambda d: stage(d)["outputs"]["late_weights"].update(tensor="gone"), "gone: is missing"),
        (lambda d: stage(d)["outputs"]["late_weights"].update(shape=[3]), "is float32[2]"),
        (
            lambda d: stage(d)["outputs"]["late_weights"].update(
                tensor="weights/driving/expression_weights", shape=[4]
            ),
            "weights/driving/expression_weights: is float32[4], expected float32[2]",
        ),
    ],
)
def test_a_wrong_document_gets_one_line(change: Callable[[Document], object], said: str) -> None:
    assert said in refused(cases=changed_cases(change))


def test_wrong_vectors_get_one_line() -> None:
    nan = np.full((5, 4, 4), np.nan)
    assert "not finite" in refused(vectors=changed_vectors(weights__driving__joint_delta=nan))
    assert "is missing" in refused(vectors=changed_vectors(weights__channels=None))
    assert "driving.safetensors" in refused(vectors=FILES[VECTORS][:-1])
    assert "driving.json" in refused(cases=b"{")


@settings(max_examples=examples(60))
@given(st.lists(st.tuples(st.integers(0, 60_000), st.binary(max_size=5)), max_size=4), st.booleans())
def test_no_bytes_break_the_reader(edits: list[tuple[int, bytes]], of_cases: bool) -> None:
    name = CASES if of_cases else VECTORS
    data = FILES[name]
    for at, new in edits:
        at %= len(data) + 1
        data = data[:at] + new + data[at + max(len(new), 1) :]
    try:
        read(FILES | {name: data})
    except AvatarError as error:
        assert "\n" not in str(error)
