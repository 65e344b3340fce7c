"""Every case through every backend, from the committed vectors; and the vectors against the cases."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from avatar_runtime.conformance import STAGE_ARRAYS, Report, conform, make_reference
from avatar_runtime.conformance.arrays import WHEN
from avatar_runtime.rules import POSITION_RULES, QUATERNION_SIGNS, ROTATION_RULES, SCALE_RULES, SH_DIRECTIONS
from avatar_runtime.stages import STAGES
from avatar_runtime.stages.raster import PROFILES
from avatar_runtime.stages.surface import Surface
from avatar_runtime.stages.surface import _floored as floored
from tests.conformance.avatars import AVATARS
from tests.conformance.cases import CASES, PIXELS, ROWS, cases_of
from tests.conformance.references import committed
from tests.measured import Measure

BACKENDS: Mapping[str, tuple[str, dict[str, Any]]] = {  # name of the test -> backend, its options
    "reference": ("reference", {}),
    "cpu": ("cpu", {}),
    "gl": ("gl", {}),
    "gl_es": ("gl", {"es": True}),
    "gl_rgba16f": ("gl", {"target": "rgba16f"}),  # rgba8 cuts colours above 1, which these cases have
}


@pytest.mark.parametrize("avatar", AVATARS)
@pytest.mark.parametrize("backend", BACKENDS)
def test_a_backend_conforms(backend: str, avatar: str, measured: Measure) -> None:
    name, options = BACKENDS[backend]
    reference = committed(avatar)
    report = conform(AVATARS[avatar](), reference, name, **options)
    failures = [(r.case, r.stage, r.profile, r.array, r.verdict) for r in report.rows if not r.passed]
    assert not failures
    assert [(p.case, p.profile, p.difference) for p in report.images if not p.passed] == []
    assert report.passed and report.first_failure is None
    assert_complete(report, avatar, name)
    used = max(row.verdict.used for row in report.rows)
    measured(f"conformance, {backend}: a stage, share of its tolerance", used, 1)
    worst = max(image.difference for image in report.images)
    measured(f"conformance, {backend}: a image, 1/255", worst)


def assert_complete(report: Report, avatar: str, backend: str) -> None:
    """Every array of every stage of every case was judged, except for those that the backend does not draw."""
    made = AVATARS[avatar]()
    profiles = ("engine",) if backend == "gl" else PROFILES
    want = {
        (row.name, stage, profile, array.name)
        for row in CASES
        if row.avatar == avatar
        for stage, table in STAGE_ARRAYS.items()
        if WHEN[table.when](made, row.light)
        for profile in (profiles if stage == "raster" else (None,))
        for array in table.outputs
    }
    assert {(r.case, r.stage, r.profile, r.array) for r in report.rows} == want
    drawn = {(row.name, profile) for row in CASES if row.avatar == avatar for profile in profiles}
    assert {(p.case, p.profile) for p in report.images} == drawn
    assert len(report.skipped) == 2 * len(drawn) * (len(PROFILES) - len(profiles))


@pytest.mark.parametrize("avatar", AVATARS)
def test_committed_vectors_are_of_the_cases(avatar: str) -> None:
    """A case that was changed has to be regenerated."""
    want = cases_of(avatar, AVATARS[avatar]())
    vectors = committed(avatar).cases
    assert [(v.case.name, v.case.why, v.case.background) for v in vectors] == [
        (case.name, case.why, case.background) for case in want
    ]
    for case, found in zip(want, (v.case for v in vectors), strict=True):
        assert found.pose.expressions == case.pose.expressions
        assert found.pose.eyelids == case.pose.eyelids
        assert found.pose.joints.keys() == case.pose.joints.keys()
        for joint, matrix in case.pose.joints.items():
            np.testing.assert_allclose(found.pose.joints[joint], matrix, atol=1e-12)
        np.testing.assert_allclose(found.pose.world_from_avatar, case.pose.world_from_avatar, atol=1e-12)
        np.testing.assert_allclose(found.camera.clip_from_world, case.camera.clip_from_world, atol=1e-6)
        assert (found.camera.width, found.camera.height) == (case.camera.width, case.camera.height)


@pytest.mark.parametrize("avatar", AVATARS)
def test_committed_tolerances_are_those_of_the_table(avatar: str) -> None:
    made = AVATARS[avatar]()
    fresh = make_reference(made, cases_of(avatar, made), rows=ROWS, pixels=PIXELS)
    tensors = committed(avatar).tensors
    for vectors, want in zip(committed(avatar).cases, fresh.cases, strict=True):
        assert [(s.stage, s.profile, s.inputs) for s in vectors.steps] == [
            (s.stage, s.profile, s.inputs) for s in want.steps
        ]
        for found, wanted in zip(vectors.steps, want.steps, strict=True):
            assert found.outputs.keys() == wanted.outputs.keys()
            for array, expected in wanted.outputs.items():
                approximately = replace(found.outputs[array], atol=expected.atol)
                assert approximately == expected
                assert found.outputs[array].atol == pytest.approx(expected.atol, rel=1e-4)
                most = 12 if found.stage == "shadow" else 1  # 6000 texels are covered
                assert expected.most_flips <= most
                if expected.weight is not None:
                    weight = fresh.tensors[expected.weight]
                    np.testing.assert_allclose(tensors[expected.weight], weight, rtol=1e-3)


def test_avatars_have_every_value_of_every_rule() -> None:
    avatars = [make() for make in AVATARS.values()]
    rules = [avatar.rules for avatar in avatars]
    assert {r.rotation for r in rules} == set(ROTATION_RULES)
    assert {r.position for r in rules} == set(POSITION_RULES)
    assert {r.scale for r in rules} == set(SCALE_RULES)
    assert {r.sh_direction for r in rules} == set(SH_DIRECTIONS)
    turned = {r.quaternion_sign for r in rules if r.rotation == "vertex_quaternion"}
    assert turned == set(QUATERNION_SIGNS)
    assert {avatar.sh_degree for avatar in avatars} == {0, 1, 2, 3}
    assert tuple(STAGE_ARRAYS) == STAGES


def undivided(surface: Surface, by_triangle: Any, floor: float) -> Any:
    return floored(surface, by_triangle, floor * surface.training_per_bundle**2)


def ignored(surface: Surface, by_triangle: Any, floor: float) -> Any:
    return floored(surface, by_triangle, 0.0)


@pytest.mark.parametrize("wrong", [undivided, ignored])
@pytest.mark.parametrize(("columns", "arrays"), [(3, {"mean"}), (4, {"quat_wxyz", "sh_rotation"})])
def test_the_floors_of_a_fine_mesh_are_judged(
    wrong: Any, columns: int, arrays: set[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of vertex normals, of three columns, and of vertex quaternions."""

    def planted(surface: Surface, by_triangle: Any, floor: float) -> Any:
        rule = wrong if by_triangle.shape[1] == columns else floored
        return rule(surface, by_triangle, floor)

    avatar = AVATARS["surface_fine"]()
    monkeypatch.setattr("avatar_runtime.stages.surface._floored", planted)
    report = conform(avatar, committed("surface_fine"), "reference")
    assert {(row.stage, row.array) for row in report.rows if not row.passed} == {("bind", a) for a in arrays}
