"""Mutation check of the kit: each planted fault fails the stages that it is in, and no other."""

from __future__ import annotations

from pathlib import Path

import pytest

from avatar_runtime.conformance import STAGE_ARRAYS, conform
from tests.conformance.avatars import AVATARS
from tests.conformance.faults import FAULTS, Fault, FaultyShaders
from tests.conformance.references import committed


@pytest.mark.parametrize("fault", FAULTS, ids=lambda fault: fault.name)
def test_the_kit_names_the_stage_of_a_planted_fault(fault: Fault, tmp_path: Path) -> None:
    shaders = FaultyShaders(fault, tmp_path)
    report = conform(AVATARS[fault.avatar](), committed(fault.avatar), "gl", shaders=shaders)
    failed = {row.stage for row in report.rows if not row.passed}
    assert failed == set(fault.stages)
    case = fault.case.partition("/")[2]
    assert {row.stage for row in report.rows if not row.passed and row.case == case} == set(fault.stages)
    assert report.first_failure == fault.stages[0]


def test_every_stage_that_has_shaders_is_planted_or_exact() -> None:
    """Sums and exp of morph, blend and activate are covered by tolerances; the sort is exact."""
    planted = {stage for fault in FAULTS for stage in fault.stages}
    assert planted <= set(STAGE_ARRAYS)
    assert {"skin", "bind", "shadow", "project", "light", "raster"} <= planted
