"""The trainer's stages under the runtime's names, and the references they compute."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cache

import pytest

from avatar_export.writers.reference_cases import reference_cases
from avatar_runtime.avatar import Avatar, Rules
from avatar_runtime.conformance import Maker, Reference, conform, make_reference
from avatar_runtime.conformance.images import draw
from avatar_runtime.stages.raster import PROFILES
from avatar_trainer.bundles.definitions import TrainerStages
from tests.avatars import full_avatar, surface_avatar

Measured = Callable[[str, float], None]
PAPER = {"scale": "linear_area", "position": "interpolated_normal", "rotation": "vertex_quaternion_mean"}
AVATARS = {
    "skin": lambda: full_avatar(3),
    "surface": lambda: surface_avatar(4, rigged=True),
    "paper": lambda: surface_avatar(5, replace(surface_avatar(5).rules, **PAPER), rigged=True),
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
