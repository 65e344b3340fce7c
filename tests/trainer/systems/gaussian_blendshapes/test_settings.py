"""Settings of Gaussian Blendshapes: their ranges, and what the paper prints."""

from __future__ import annotations

from typing import Any

import pytest

from avatar_trainer.systems.gaussian_blendshapes.system import (
    PAPER,
    RULES,
    Settings,
)

BAD: list[dict[str, Any]] = [
    {"sh_degree": 4},
    {"delta_sh_degree": 2},
    {"gaussians": 3},
    {"background": "pink"},
    {"unseen": 0.0},
    {"mouth_cylinder": (0.0, 0.0, 0.0, -1.0, 0.0)},
]


@pytest.mark.parametrize("changed", BAD, ids=[next(iter(b)) for b in BAD])
def test_settings_out_of_range(changed: dict[str, Any]) -> None:
    with pytest.raises(ValueError, match=next(iter(changed))):
        Settings(**changed)


def test_the_papers_settings_are_the_papers() -> None:
    """Section 3.4 and Eq. 6."""
    r, w = PAPER.rates, PAPER.weights
    assert (r.mean, r.log_scale) == (1.6e-4, 5e-3)
    assert (r.delta_mean, r.delta_opacity_logit, r.delta_log_scale) == (3.2e-7, 5e-5, 5e-4)
    assert (r.delta_quat_wxyz, r.delta_sh) == (1e-4, 1.25e-3)
    assert (w.dssim, w.alpha, w.mouth, PAPER.gaussians, PAPER.expressions) == (0.2, 10, 100, 50_000, 50)
    assert all(rule.default in rule.values for rule in RULES.values())
    elsewhere = {"weights": "grid", "anchor": "left open"}  # not to be chosen
    for name, rule in RULES.items():
        assert rule.paper == elsewhere.get(name, PAPER.rules[name])
    assert Settings().rules == {name: rule.default for name, rule in RULES.items()}
