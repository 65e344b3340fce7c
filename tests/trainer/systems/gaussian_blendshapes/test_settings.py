"""Settings of Gaussian Blendshapes: their ranges, and what the paper prints."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Any

import pytest

from avatar_trainer.loop.train import train
from avatar_trainer.settings import TrainSettings
from avatar_trainer.systems.gaussian_blendshapes.system import (
    PAPER,
    RULES,
    Settings,
    create,
)
from tests.trainer.systems.gaussian_blendshapes.subjects import FACE, MOUTH, capture, settings

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


def test_a_line_says_why_there_are_more_gaussians_than_asked_for(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    own, scene = settings(iterations=1), capture(tmp_path)
    again = partial(train, create(scene, own, 0), scene, TrainSettings(iterations=1), tmp_path / "out")
    again(system_settings=own, upstream=False)
    said = (
        f"note: {FACE + 2 * MOUTH} Gaussians at the start: {FACE} on the face (--gaussians) and {2 * MOUTH} in the "
        f"mouth ({MOUTH} in each set of teeth; --set mouth_gaussians=N)\n"
    )
    assert said in capsys.readouterr().err
    again(system_settings=own, upstream=False)
    assert said not in capsys.readouterr().err, "a run that goes on has said it"
