"""Reference vectors through files and back; files that are wrong get one line."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from avatar_runtime.conformance import decode, encode
from avatar_schema import LATEST
from tests.runtime.conformance.made import Held, reference
from tests.session.fuzz import examples

HELD = Held(dict(encode(reference())), decode, "cases.json", "vectors.safetensors")
Document = dict[str, Any]


def test_what_is_written_is_read_back_bit_for_bit() -> None:
    made, found = reference(), HELD.read()
    assert encode(found) == HELD.files
    case, again = made.cases[0].case, found.cases[0].case
    assert (again.name, again.why, again.background) == (case.name, case.why, case.background)
    assert again.pose.expressions == case.pose.expressions and again.pose.eyelids == case.pose.eyelids
    np.testing.assert_array_equal(again.camera.clip_from_world, case.camera.clip_from_world)
    np.testing.assert_array_equal(list(again.pose.joints.values()), list(case.pose.joints.values()))
    assert found.cases[0].steps == made.cases[0].steps
    assert found.cases[0].engine_psnr_db == made.cases[0].engine_psnr_db
    for profile, view in made.cases[0].images.items():
        np.testing.assert_array_equal(found.cases[0].images[profile].colour, view.colour)
        np.testing.assert_array_equal(found.cases[0].images[profile].alpha, view.alpha)
    for name, tensor in made.tensors.items():
        np.testing.assert_array_equal(found.tensors[name], tensor)


def test_versions() -> None:
    def versioned(**asset: str) -> dict[str, bytes]:
        return HELD.with_cases(lambda d: d["asset"].update(asset) or d.update(future=[1]))

    assert HELD.read(versioned(version="1.7", minVersion=LATEST)).avatar == reference().avatar
    assert "update avatar-export" in HELD.refused(versioned(version="2.0", minVersion="2.0"))
    assert "1.6" in HELD.refused(versioned(version="1.7", minVersion="1.6"))


def of(document: Document, stage: str) -> Document:
    return next(s for s in document["cases"][0]["stages"] if s["stage"] == stage)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda d: d.update(format="gltf"), "$.format"),
        (lambda d: d.pop("cases"), "cases"),
        (lambda d: d.update(made_by="nobody"), "nobody"),
        (lambda d: of(d, "morph").update(stage="paint"), "paint"),
        (lambda d: of(d, "raster").pop("pixels"), "pixels"),
        (lambda d: of(d, "blend")["outputs"]["mean"].update(tensor="nod/none"), "nod/none: is missing"),
        (lambda d: of(d, "blend")["outputs"]["mean"].update(shape=[16, 4]), "float32[16, 3]"),
        (lambda d: of(d, "blend")["outputs"]["mean"].update(atol=-1), "atol"),
        (lambda d: of(d, "blend")["outputs"].update(warp=of(d, "blend")["outputs"]["mean"]), "warp"),
        (lambda d: of(d, "blend")["outputs"].pop("sh"), "lacks sh"),
        (lambda d: of(d, "sort")["inputs"].pop("depth"), "lacks depth"),
        (
            lambda d: of(d, "activate")["inputs"]["log_scale"].update(
                of(d, "morph")["inputs"]["pose_feature"]
            ),
            "expected float32[16, 3]",
        ),
        (lambda d: of(d, "bind")["outputs"]["mean"].update(atol=1e4), "judge nothing"),
        (lambda d: of(d, "bind")["outputs"]["mean"].update(atol=0.01), "judge nothing"),
        (lambda d: of(d, "bind")["outputs"]["mean"].update(rtol=0.011), "judge nothing"),
        (lambda d: of(d, "project")["outputs"]["conic"].update(atol=1), "judge nothing"),
        (lambda d: of(d, "project")["outputs"]["radius"].update(atol=1), "judge nothing"),
        (lambda d: of(d, "project")["outputs"]["radius"].update(most_flips=3), "judge nothing"),
        (lambda d: of(d, "sort")["outputs"]["order"].update(rtol=1e-3), "judge nothing"),
        (lambda d: d["cases"][0]["camera"].update(width=41), "41x24"),
        (lambda d: d["cases"][0]["camera"].update(width=100000), "width"),
        (lambda d: d["cases"][0]["camera"].update(camera_from_world=[0] * 16), "no inverse"),
        (lambda d: d["cases"][0]["camera"].update(centre=[1e300, 0, 0]), "goes beyond"),
        (lambda d: d["cases"][0]["pictures"][0].update(colour="../secret.png"), "../secret.png"),
        (lambda d: d["cases"].append(d["cases"][0]), "two cases"),
        (lambda d: d["cases"][0].update(name="../x"), "name"),
    ],
)
def test_a_document_that_is_wrong_is_refused(change: Callable[[Document], object], said: str) -> None:
    assert said in HELD.refused(HELD.with_cases(change))


ORDER = reference().tensors["nod/sort/order"]


@pytest.mark.parametrize(
    ("name", "value", "said"),
    [
        ("nod/blend/mean", None, "is missing"),
        ("nod/blend/mean", np.zeros((16, 4), np.float32), "cases.json says float32[16, 3]"),
        ("nod/blend/mean", np.zeros((16, 3)), "float64"),
        ("nod/blend/mean", np.full((16, 3), np.nan, np.float32), "not finite"),
        ("nod/project/conic.weight", np.full(16, np.inf, np.float32), "not finite"),
        ("rows", np.arange(16)[::-1].copy(), "increasing"),
        ("rows", np.arange(16) - 3, "increasing"),
        ("rows", np.array([0.5]), "float64[1]"),
        ("nod/sort/order", ORDER + 100, "0..15"),
        ("nod/sort/order", ORDER * 0, "different"),
        ("nod/raster.engine/pixels", np.arange(64, dtype=np.int32) - 1, "0..959"),
        ("nod/raster.engine/pixels", np.arange(64, dtype=np.int32) + 960, "0..959"),
    ],
)
def test_a_tensor_that_is_wrong_is_refused(name: str, value: Any, said: str) -> None:
    line = HELD.refused(HELD.with_vectors({name: value}))
    assert said in line and name in line


@settings(max_examples=examples(150))
@given(
    st.sampled_from(sorted(HELD.files)),
    st.integers(0, 10**6),
    st.binary(min_size=1, max_size=1),
    st.booleans(),
)
def test_damage_is_refused_or_harmless(name: str, at: int, byte: bytes, cut: bool) -> None:
    HELD.damaged(name, [(at, byte)], cut=cut)
