"""The trainer's stages under the runtime's names, and the references they compute."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from avatar_export.writers.reference_cases import reference_cases
from avatar_runtime.avatar import Avatar, Rules
from avatar_runtime.conformance import Maker, Reference, conform, make_reference
from avatar_runtime.conformance.images import draw
from avatar_runtime.stages.raster import PROFILES
from avatar_trainer.bundles.definitions import TrainerStages
from tests.avatars import full_avatar, surface_avatar

Measured = Callable[[str, float], None]
AVATARS = {
    "skin": lambda: full_avatar(3),
    "surface": lambda: surface_avatar(4, rigged=True),
    "paper": lambda: surface_avatar(
        5,
        replace(
            surface_avatar(5).rules,
            scale="linear_area",
            position="interpolated_normal",
            rotation="vertex_quaternion_mean",
        ),
        rigged=True,
    ),
    "joints": lambda: surface_avatar(6, Rules("bary_vertex_lbs", position="interpolated_normal")),
}
TRAINER = Maker("trainer", TrainerStages, lambda avatar, case: draw(avatar, case, PROFILES))


@cache
def made(kind: str) -> Reference:
    """What the trainer computes for an avatar of AVATARS."""
    avatar: Avatar = AVATARS[kind]()
    return make_reference(avatar, reference_cases(avatar), maker=TRAINER)


@pytest.mark.parametrize("kind", AVATARS)
@pytest.mark.parametrize("backend", ["reference", "cpu"])
def test_the_runtime_meets_references_that_the_trainer_made(
    kind: str, backend: str, measured: Measured
) -> None:
    reference = made(kind)
    assert reference.made_by == "trainer"
    report = conform(AVATARS[kind](), reference, backend)
    assert [row for row in report.rows if not row.passed] == []
    assert report.passed
    measured("share of a tolerance, trainer-made vectors", max(row.verdict.used for row in report.rows))


def test_a_changed_avatar_does_not_meet_them() -> None:
    avatar, reference = full_avatar(3), made("skin")
    gaussians = replace(avatar.gaussians, log_scale=avatar.gaussians.log_scale + np.float32(1e-3))
    report = conform(replace(avatar, gaussians=gaussians), reference, "reference")
    assert report.first_failure == "blend"


def test_rules_that_are_not_trained_are_refused() -> None:
    avatar = surface_avatar(4)
    stages = TrainerStages(replace(avatar, rules=replace(avatar.rules, quaternion_sign="largest_positive")))
    with pytest.raises(ValueError, match="quaternion_sign"):
        make_reference(avatar, reference_cases(avatar)[:1], maker=replace(TRAINER, stages=lambda _: stages))
