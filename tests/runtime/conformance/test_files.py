"""Reference vectors through files and back; files that are wrong get one line."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from safetensors.numpy import load as load_with_library

from avatar_runtime.bundle import opener
from avatar_runtime.codec import safetensors
from avatar_runtime.conformance import Reference, decode, encode
from avatar_runtime.io.errors import AvatarError
from avatar_schema import LATEST
from tests.runtime.conformance.made import reference
from tests.session.fuzz import examples

FILES = encode(reference())
Document = dict[str, Any]


def read(files: dict[str, bytes]) -> Reference:
    def one(name: str, limit: int) -> bytes:
        assert len(files[name]) <= limit
        return files[name]

    return decode(one)


def refused(**changed: bytes) -> str:
    """The one line that a changed file is refused with; `cases` and `vectors` name the two."""
    names = {"cases": "cases.json", "vectors": "vectors.safetensors"}
    with pytest.raises(AvatarError) as error:
        read(FILES | {names.get(key, key): data for key, data in changed.items()})
    line = str(error.value)
    assert "\n" not in line and len(line) < 400
    return line


def changed_cases(change: Callable[[Document], object]) -> bytes:
    document = json.loads(FILES["cases.json"])
    change(document)
    return json.dumps(document).encode()


def changed_vectors(**changed: Any) -> bytes:
    tensors = safetensors.decode(FILES["vectors.safetensors"], "x") | changed
    return b"".join(safetensors.encode({name: a for name, a in tensors.items() if a is not None}))


def test_what_is_written_is_read_back_bit_for_bit() -> None:
    made, found = reference(), read(FILES)
    assert encode(found) == FILES
    case, again = made.cases[0].case, found.cases[0].case
    assert (again.name, again.why, again.background) == (case.name, case.why, case.background)
    assert again.pose.expressions == case.pose.expressions and again.pose.eyelids == case.pose.eyelids
    np.testing.assert_array_equal(again.camera.clip_from_world, case.camera.clip_from_world)
    for joint, matrix in case.pose.joints.items():
        np.testing.assert_array_equal(again.pose.joints[joint], matrix)
    assert found.cases[0].steps == made.cases[0].steps
    assert found.cases[0].engine_psnr_db == made.cases[0].engine_psnr_db
    for profile, view in made.cases[0].images.items():
        np.testing.assert_array_equal(found.cases[0].images[profile].colour, view.colour)
        np.testing.assert_array_equal(found.cases[0].images[profile].alpha, view.alpha)
    for name, tensor in found.tensors.items():
        if name not in ("rows", "vertices"):
            np.testing.assert_array_equal(tensor, made.tensors[name])


def test_the_container_is_what_the_library_reads() -> None:
    found = load_with_library(FILES["vectors.safetensors"])
    np.testing.assert_array_equal(found["nod/blend/mean"], reference().tensors["nod/blend/mean"])


def test_each_stage_starts_from_what_the_one_before_gave() -> None:
    steps = {(s.stage, s.profile): s for s in read(FILES).cases[0].steps}
    for stage, array, source in (
        ("skin", "skin_matrix", "joints"),
        ("skin", "vertices", "morph"),
        ("bind", "mean", "blend"),
        ("bind", "group_matrix", "joints"),
        ("activate", "log_scale", "bind"),
        ("project", "scale", "activate"),
        ("project", "mean", "bind"),
        ("sort", "depth", "project"),
    ):
        assert steps[stage, None].inputs[array] == steps[source, None].outputs[array].tensor
    assert steps["raster", "engine"].inputs["order"] == steps["sort", None].outputs["order"].tensor


def test_files_of_the_bundle_are_kept() -> None:
    digests = {"gaussians.ply": "0" * 64}
    assert read(encode(replace(reference(), files=digests))).files == digests


def test_the_document_says_who_may_read_it_and_who_made_it() -> None:
    document = json.loads(FILES["cases.json"])
    asset = {"version": LATEST, "minVersion": LATEST, "generator": "made for tests"}
    assert document["asset"] == asset and document["made_by"] == "runtime"
    assert document["avatar"] == "Full Ävatar"


def test_a_newer_version_is_refused() -> None:
    newer = changed_cases(lambda d: d["asset"].update(version="2.0", minVersion="2.0"))
    assert "update avatar-export" in refused(cases=newer)
    newer = changed_cases(lambda d: d["asset"].update(version="1.7", minVersion="1.6"))
    assert "1.6" in refused(cases=newer)


def test_a_newer_minor_that_asks_for_no_more_is_read() -> None:
    newer = changed_cases(lambda d: d["asset"].update(version="1.7") or d.update(future=[1]))
    assert read(FILES | {"cases.json": newer}).avatar == reference().avatar


def stage_of(document: Document, stage: str) -> Document:
    return next(s for s in document["cases"][0]["stages"] if s["stage"] == stage)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda d: d.update(format="gltf"), "$.format"),
        (lambda d: d.pop("cases"), "cases"),
        (lambda d: d.update(made_by="nobody"), "nobody"),
        (lambda d: stage_of(d, "morph").update(stage="paint"), "paint"),
        (lambda d: stage_of(d, "raster").pop("pixels"), "pixels"),
        (lambda d: stage_of(d, "blend")["outputs"]["mean"].update(tensor="nod/none"), "nod/none: is missing"),
        (lambda d: stage_of(d, "blend")["outputs"]["mean"].update(shape=[16, 4]), "float32[16, 3]"),
        (lambda d: stage_of(d, "blend")["outputs"]["mean"].update(atol=-1), "atol"),
        (
            lambda d: stage_of(d, "blend")["outputs"].update(warp=stage_of(d, "blend")["outputs"]["mean"]),
            "warp",
        ),
        (lambda d: stage_of(d, "blend")["outputs"].pop("sh"), "lacks sh"),
        (lambda d: stage_of(d, "sort")["inputs"].pop("depth"), "lacks depth"),
        (
            lambda d: stage_of(d, "activate")["inputs"]["log_scale"].update(
                stage_of(d, "morph")["inputs"]["pose_feature"]
            ),
            "expected float32[16, 3]",
        ),
        (lambda d: stage_of(d, "bind")["outputs"]["mean"].update(atol=1e4), "judge nothing"),
        (lambda d: stage_of(d, "bind")["outputs"]["mean"].update(atol=0.01), "judge nothing"),
        (lambda d: stage_of(d, "bind")["outputs"]["mean"].update(rtol=0.011), "judge nothing"),
        (lambda d: stage_of(d, "project")["outputs"]["conic"].update(atol=1), "judge nothing"),
        (lambda d: stage_of(d, "project")["outputs"]["radius"].update(atol=1), "judge nothing"),
        (lambda d: stage_of(d, "project")["outputs"]["radius"].update(most_flips=3), "judge nothing"),
        (lambda d: stage_of(d, "sort")["outputs"]["order"].update(rtol=1e-3), "judge nothing"),
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
    assert said in refused(cases=changed_cases(change))


def test_a_sane_tolerance_is_the_files_own() -> None:
    looser = changed_cases(lambda d: stage_of(d, "bind")["outputs"]["mean"].update(atol=1e-4, rtol=0.01))
    assert read(FILES | {"cases.json": looser}).cases[0].steps[4].outputs["mean"].rtol == 0.01


@pytest.mark.parametrize("text", [b"", b"[]", b"{", b'{"a": NaN}', b"[" * 100000, b"\xff\xfe"])
def test_what_is_no_json_object_is_refused(text: bytes) -> None:
    refused(cases=text)


def order() -> Any:
    return reference().tensors["nod/sort/order"].copy()


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
        ("nod/sort/order", order() + 100, "0..15"),
        ("nod/sort/order", order() * 0, "different"),
        ("nod/raster.engine/pixels", np.arange(64, dtype=np.int32) - 1, "0..959"),
        ("nod/raster.engine/pixels", np.arange(64, dtype=np.int32) + 960, "0..959"),
    ],
)
def test_a_tensor_that_is_wrong_is_refused(name: str, value: Any, said: str) -> None:
    line = refused(vectors=changed_vectors(**{name: value}))
    assert said in line and name in line


def test_a_missing_file_is_named(tmp_path: Path) -> None:
    for name, data in FILES.items():
        if not name.endswith("alpha.png"):
            (tmp_path / name).write_bytes(data)
    with pytest.raises(AvatarError, match=r"nod\.\w+\.alpha\.png: cannot be read"):
        decode(opener(tmp_path))


@settings(max_examples=examples(150))
@given(st.sampled_from(sorted(FILES)), st.integers(0, 10**6), st.integers(0, 255), st.booleans())
def test_damage_is_refused_or_harmless(name: str, at: int, byte: int, cut: bool) -> None:
    data = bytearray(FILES[name])
    at %= len(data)
    data[at] = byte
    try:
        read(FILES | {name: bytes(data[:at] if cut else data)})
    except AvatarError as error:
        assert "\n" not in str(error)
