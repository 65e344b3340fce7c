"""Making and running references: what is kept, what is refused, what a broken backend looks like."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from avatar_runtime.backends import reference as reference_backend
from avatar_runtime.conformance import Reference, conform, conform_outputs, decode, encode, make_reference
from avatar_runtime.conformance.model import Step
from avatar_runtime.io.errors import AvatarError
from avatar_runtime.pose import Pose
from tests.avatars import full_avatar, surface_avatar
from tests.runtime.conformance.made import CAMERA, avatar, reference


def test_an_image_that_differs_is_told_when_all_stages_pass() -> None:
    """The avatar's other rows are in the image alone."""
    made = avatar()
    other = np.setdiff1d(np.arange(made.gaussians.count), reference().rows)
    logits = made.gaussians.opacity_logit.copy()
    logits[other] = 6.0
    changed = replace(made, gaussians=replace(made.gaussians, opacity_logit=logits))
    report = conform(changed, reference(), "reference")
    assert all(row.passed for row in report.rows)
    assert report.first_failure == "image"
    assert not any(image.passed for image in report.images)
    assert all(image.psnr_db is not None and image.psnr_db < 40 for image in report.images)


@pytest.mark.parametrize(("steps", "passes"), [(1, True), (2, False), (-2, False)])
@pytest.mark.parametrize("what", ["colour", "alpha"])
def test_an_image_may_be_one_step_off(what: str, steps: int, passes: bool) -> None:
    vectors = reference().cases[0]
    shifted = {
        profile: replace(
            want, **{what: np.clip(getattr(want, what).astype(int) + steps, 0, 255).astype(np.uint8)}
        )
        for profile, want in vectors.images.items()
    }
    report = conform(avatar(), replace(reference(), cases=(replace(vectors, images=shifted),)), "reference")
    assert report.passed == passes


def without(values: Reference, stage: str, array: str) -> Reference:
    vectors = values.cases[0]
    steps = [
        replace(s, inputs={k: v for k, v in s.inputs.items() if (s.stage, k) != (stage, array)})
        for s in vectors.steps
    ]
    return replace(values, cases=(replace(vectors, steps=tuple(steps)),))


def changed_steps(change: Callable[[tuple[Step, ...]], Iterable[Step]]) -> Reference:
    vectors = reference().cases[0]
    return replace(reference(), cases=(replace(vectors, steps=tuple(change(vectors.steps))),))


def test_a_case_holds_every_stage_of_the_avatar_once() -> None:
    for stage, profile in ((s.stage, s.profile) for s in reference().cases[0].steps):
        kept = changed_steps(
            lambda steps, out=(stage, profile): [s for s in steps if (s.stage, s.profile) != out]
        )
        with pytest.raises(
            AvatarError, match=rf"^cases\.json: case nod lacks stage {stage}( in profile {profile})?$"
        ):
            conform(avatar(), kept, "reference")
    for change in (lambda steps: steps[:1] + steps, lambda steps: steps[::-1]):
        with pytest.raises(AvatarError, match="case nod has its stages twice or out of order"):
            conform(avatar(), changed_steps(change), "reference")


def test_a_case_without_images() -> None:
    case = replace(reference().cases[0].case, images=False)
    made = make_reference(avatar(), [case], rows=16, pixels=64)
    files = encode(made)
    assert (
        set(files) == {"cases.json", "vectors.safetensors"} and b"engine_psnr_db" not in files["cases.json"]
    )
    found = decode(lambda name, most: files[name])
    assert not found.cases[0].case.images and encode(found) == files
    report = conform(avatar(), found, "reference")
    assert report.passed and report.rows and not report.images


def test_the_worst_element_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    right = reference_backend.RUN

    def off(stage: str, array: str, index: tuple[int, ...]) -> tuple[Any, Any]:
        def wrong(*args: Any) -> dict[str, Any]:
            outputs = right_stage(*args)
            changed = outputs[array].copy()
            changed[index] += 0.25
            return outputs | {array: changed}

        right_stage = right[stage]
        with monkeypatch.context() as patch:
            patch.setitem(reference_backend.RUN, stage, wrong)
            report = conform(avatar(), reference(), "reference")
        rows = [row for row in report.rows if not row.passed and row.profile != "trainer"]
        assert [(row.stage, row.array) for row in rows] == [(stage, array)]
        (row,) = rows
        assert row.verdict.worst is not None
        assert row.verdict.worst.got == pytest.approx(row.verdict.worst.want + 0.25, abs=1e-6)
        return row.verdict.worst.index, row.place

    values = reference()
    assert off("blend", "sh", (5, 2, 1)) == ((5, 2, 1), {"gaussian": values.rows[5]})
    assert off("skin", "posed_vertices", (7, 2)) == ((7, 2), {"vertex": values.vertices[7]})
    pixel = int(values.tensors["nod/raster.engine/pixels"][40])
    y, x = divmod(pixel, CAMERA.width)
    assert off("raster", "colour", (y, x, 1)) == ((40, 1), {"x": x, "y": y})


def outputs_of(values: Reference) -> dict[str, Any]:
    steps = values.cases[0].steps
    return {e.tensor: values.tensors[e.tensor] for step in steps for e in step.outputs.values()}


def test_outputs_of_a_port() -> None:
    whole = outputs_of(reference())
    report = conform_outputs(avatar(), reference(), whole)
    assert report.passed and report.backend is None and report.skipped == () and report.images == ()
    assert len(report.rows) == len(whole)
    other_types = {
        name: a.astype(np.float64 if a.dtype.kind == "f" else np.int16) for name, a in whole.items()
    }
    assert conform_outputs(avatar(), reference(), other_types).passed
    part = {name: a for name, a in whole.items() if "/bind/" in name or "engine" in name}
    report = conform_outputs(avatar(), reference(), part)
    assert report.passed and len(report.rows) == len(part)
    assert "nod: stage skin" in report.skipped and "nod: stage raster in profile trainer" in report.skipped
    assert len(report.skipped) == 8
    part["nod/bind/mean"] = part["nod/bind/mean"] + np.float32(0.01)
    assert conform_outputs(avatar(), reference(), part).first_failure == "bind"
    del part["nod/bind/mean"]
    (row,) = [row for row in conform_outputs(avatar(), reference(), part).rows if not row.passed]
    assert (row.array, row.verdict.note) == ("mean", "gave nothing, expected [16, 3]")


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({}, "holds no output"),
        ({"nod/bind/maen": np.zeros(3)}, "'nod/bind/maen' is not an output.*nod/bind/mean"),
    ],
)
def test_outputs_that_are_none_are_refused(given: dict[str, Any], said: str) -> None:
    with pytest.raises(AvatarError, match=said):
        conform_outputs(avatar(), reference(), given)
    with pytest.raises(AvatarError, match="another"):
        conform_outputs(surface_avatar(2), reference(), outputs_of(reference()))


@pytest.mark.parametrize(
    ("pose", "said"),
    [
        (Pose({"jawOpne": 1.0}), "cases.json: nod: 'jawOpne' is not an expression"),
        (Pose(joints={"jwa": np.eye(4)}), "cases.json: nod: 'jwa' is not a joint"),
        (Pose({"jawOpen": 1e300}), "cases.json: nod: expression jawOpen: weight"),
    ],
)
def test_a_pose_of_another_avatar_names_the_file(pose: Pose, said: str) -> None:
    vectors = reference().cases[0]
    posed = replace(reference(), cases=(replace(vectors, case=replace(vectors.case, pose=pose)),))
    with pytest.raises(AvatarError, match=said):
        conform(avatar(), posed, "reference")


def without_mesh(values: Reference) -> Reference:
    return replace(values, vertices=values.vertices[:0])


@pytest.mark.parametrize(
    ("made", "values", "said"),
    [
        (
            lambda: full_avatar(2),
            lambda: replace(reference(), rows=reference().rows + 40),
            "made for another",
        ),
        (lambda: full_avatar(2), lambda: replace(reference(), vertices=reference().vertices + 9), "another"),
        (lambda: surface_avatar(2), reference, "another"),
        (lambda: replace(full_avatar(2), rig=None), reference, "another"),
        (lambda: replace(full_avatar(2), rig=None), lambda: without_mesh(reference()), "does not have"),
        (lambda: full_avatar(2), lambda: without(reference(), "bind", "skin_matrix"), "skin_matrix"),
        (
            lambda: full_avatar(2),
            lambda: without(reference(), "joints", "anchor_vertices"),
            "anchor_vertices",
        ),
    ],
)
def test_a_reference_of_another_avatar_is_refused(made: Any, values: Any, said: str) -> None:
    with pytest.raises(AvatarError, match=said):
        conform(made(), values(), "reference")
