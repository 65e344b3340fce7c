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

from avatar_runtime.conformance import decode_driving, driving_cases, encode_driving
from avatar_runtime.driving.arkit import CHANNELS
from avatar_schema import LATEST, schema
from tests.avatars import full_avatar
from tests.conformance.avatars import AVATARS
from tests.runtime.conformance.made import Held
from tests.session.fuzz import examples

MADE = driving_cases(full_avatar(), generator="made for tests")
HELD = Held(dict(encode_driving(MADE)), decode_driving, "driving.json", "driving.safetensors")
Document = dict[str, Any]


def test_what_is_written_is_read_back_bit_for_bit() -> None:
    found = HELD.read()
    assert encode_driving(found) == HELD.files
    assert (found.avatar, found.handedness, found.generator) == ("Full Ävatar", "right", "made for tests")
    assert found.cases == MADE.cases and found.tensors.keys() == MADE.tensors.keys()
    for name, tensor in found.tensors.items():
        np.testing.assert_array_equal(tensor, MADE.tensors[name])
    document = json.loads(HELD.files["driving.json"])
    Draft202012Validator(schema("driving")).validate(document)
    assert document["channels"] == list(CHANNELS) and document["asset"]["version"] == LATEST


def test_a_still_avatar_without_driving_has_no_cases() -> None:
    still = driving_cases(AVATARS["still"]())
    assert still.cases == () and still.tensors == {}
    assert HELD.read(encode_driving(still)).cases == ()


def stage(document: Document, case: int = 1, at: int = 0) -> Document:
    found: Document = document["cases"][case]["stages"][at]
    return found


def late(document: Document) -> Document:
    found: Document = stage(document)["outputs"]["late_weights"]
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
        (lambda d: late(d).update(atol=1.0), "that would judge nothing"),
        (lambda d: late(d).update(rtol=0.1), "that would judge nothing"),
        (lambda d: late(d).update(flips="sign"), "'flips' is unknown"),
        (lambda d: late(d).update(weight=3), "'weight' is unknown"),
        (lambda d: stage(d).update(pixels=3), "'pixels' is unknown"),
        (lambda d: late(d).update(tensor="gone"), "gone: is missing"),
        (lambda d: late(d).update(shape=[3]), "is float32[2]"),
        (
            lambda d: late(d).update(tensor="weights/driving/expression_weights", shape=[4]),
            "weights/driving/expression_weights: is float32[4], expected float32[2]",
        ),
    ],
)
def test_a_wrong_document_gets_one_line(change: Callable[[Document], object], said: str) -> None:
    assert said in HELD.refused(HELD.with_cases(change))


def test_wrong_vectors_get_one_line() -> None:
    nan = np.full((5, 4, 4), np.nan)
    assert "not finite" in HELD.refused(HELD.with_vectors({"weights/driving/joint_delta": nan}))
    assert "is missing" in HELD.refused(HELD.with_vectors({"weights/channels": None}))
    assert HELD.vectors in HELD.refused({HELD.vectors: HELD.files[HELD.vectors][:-1]})
    assert HELD.cases in HELD.refused({HELD.cases: b"{"})


@settings(max_examples=examples(60))
@given(
    st.sampled_from(sorted(HELD.files)),
    st.lists(st.tuples(st.integers(0, 60_000), st.binary(max_size=5)), max_size=4),
)
def test_no_bytes_break_the_reader(name: str, edits: list[tuple[int, bytes]]) -> None:
    HELD.damaged(name, edits)
