"""What `conform` says that a reference does not test, against the conformance avatars."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from avatar_export.checks.conform_coverage import BUNDLES, Gap, gaps
from avatar_runtime.avatar import Avatar
from avatar_runtime.camera import Camera
from avatar_runtime.conformance import Reference, make_reference
from avatar_runtime.rules import names
from tests.conformance.avatars import AVATARS
from tests.conformance.cases import cases_of
from tests.conformance.references import committed

RULES = ("binding", "rotation", "position", "scale", "quaternion_sign", "sh_direction", "anchor")


@cache
def all_gaps() -> Mapping[str, tuple[Gap, ...]]:
    """Of every conformance avatar with its committed reference."""
    return {name: gaps(make(), committed(name)) for name, make in AVATARS.items()}


def test_each_item_is_tested_by_the_bundle_that_is_named() -> None:
    found = {name: {(g.kind, g.value) for g in missing} for name, missing in all_gaps().items()}
    for kind, items in BUNDLES.items():
        for value, bundle in items.items():
            assert (kind, value) not in found[bundle], f"{bundle} does not test {kind} {value}"


def test_every_value_of_every_rule_is_an_item() -> None:
    assert {rule: set(BUNDLES[rule]) for rule in RULES} == {rule: set(names(rule)) for rule in RULES}
    assert {gap.kind for missing in all_gaps().values() for gap in missing} == set(BUNDLES)


@pytest.mark.parametrize("case", ["posed", "turned"])
def test_a_rule_that_a_pose_does_not_reach_is_named(case: str) -> None:
    """Joints that turn little give the same sum of quaternions under every rule of signs; a half turn does not."""
    avatar, reference = AVATARS["surface_area"](), committed("surface_area")
    little = replace(reference, cases=tuple(c for c in reference.cases if c.case.name == "posed"))
    far = replace(reference, cases=tuple(c for c in reference.cases if c.case.name == "turned"))
    same = {g.value: g.same_as for g in gaps(avatar, {"posed": little, "turned": far}[case])}
    others = ("largest_positive", "largest_positive_mirrored")
    assert same.get("w_positive", ()) == (others if case == "posed" else ())
    assert same["largest_positive"] == (), "which this avatar does not have"


def test_coefficients_that_are_zero_test_no_degree() -> None:
    avatar = AVATARS["skin_polar"]()
    sh = avatar.gaussians.sh.copy()
    sh[:, 9:] = 0
    flat = replace(avatar, gaussians=replace(avatar.gaussians, sh=sh))
    reference = make_reference(flat, cases_of("skin_polar", avatar)[:1], rows=8, pixels=8)
    assert Gap("SH degree", "3") in gaps(flat, reference)
    assert Gap("SH degree", "3") not in gaps(avatar, reference)


def test_thresholds_are_those_that_rows_reach() -> None:
    """From far away all of `edges` is ahead, and nothing is on the border of the image."""
    avatar, reference = AVATARS["edges"](), committed("edges")
    assert thresholds(avatar, reference) == {"floors of vertex normals and quaternions"}
    (case, *_) = cases_of("edges", avatar)
    far = replace(case, camera=Camera.orbit(np.zeros(3), 400.0, 0.0, 0.0, 1.2, 64, 48))
    missed = thresholds(avatar, make_reference(avatar, [far], rows=512, pixels=64))
    assert {"near plane", "behind the camera", "clamp of the Jacobian"} <= missed
    assert not missed & {"equal depths", "quaternion without length", "opacity below 1/255"}


def thresholds(avatar: Avatar, reference: Reference) -> set[str]:
    return {gap.value for gap in gaps(avatar, reference) if gap.kind == "threshold"}
