"""ASM faces fitted to scans: the toy face against faces and expressions that are known."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator

import numpy as np
import pytest
import torch

from avatar_runtime.io.errors import AvatarError
from avatar_trainer.asm.align import Scan
from avatar_trainer.asm.register.fit import register, register_takes, scan_error
from avatar_trainer.asm.register.settings import RegisterSettings
from avatar_trainer.loop.machine import reproducible
from tests.measured import Measure
from tests.trainer.asm.toy import binding, changed, scan, template

TEMPLATE = template()
BINDING = binding(TEMPLATE)
QUICK = RegisterSettings(iterations=60, learning_rate=4e-3, prior=1e-3)


@pytest.fixture(autouse=True)
def on_one_thread() -> Iterator[None]:
    """The toy is too small to share out."""
    with reproducible(0, threads=1):
        yield


def fitted(given: Scan, **settings: object) -> float:
    """Error in mm."""
    return scan_error(
        register(TEMPLATE, BINDING, given, dataclasses.replace(QUICK, **settings)), given
    ).mean_mm


def test_the_error_falls_from_static_to_bound_to_tunable_and_random_weights_are_worst(
    measured: Measure,
) -> None:
    given = scan(1.5)
    errors = {
        name: fitted(given, variant=name) for name in ("static", "dynamic_binding", "full", "random_weights")
    }
    assert errors["full"] < 0.8 * errors["dynamic_binding"]
    assert errors["dynamic_binding"] < errors["static"] < errors["random_weights"]
    measured("toy face fitted to a scan, mm", errors["full"])


def test_holes_and_points_of_something_else_do_no_harm() -> None:
    given = scan(1.0)
    cheek = np.linalg.norm(given.points - changed(np.array([[0.7, 0.45]]), 1.0), axis=1) < 0.022
    random = np.random.default_rng(1)
    hair = given.points[:150] + (0, 0, 0.06) + random.normal(size=(150, 3)) * 0.003
    holed = dataclasses.replace(given, points=np.concatenate([given.points[~cheek], hair]))
    assert cheek.sum() > 100
    whole, capped = fitted(given), scan_error(register(TEMPLATE, BINDING, holed, QUICK), given).mean_mm
    uncapped = dataclasses.replace(QUICK, first_cap_mm=1e6, last_cap_mm=1e6)
    assert capped < 1.2 * whole
    assert scan_error(register(TEMPLATE, BINDING, holed, uncapped), given).mean_mm > 2 * whole


def test_bad_scans_and_templates_are_one_line() -> None:
    given = scan()
    line = {name: np.array([float(i), 0, 0]) for i, name in enumerate(given.keypoints)}
    with pytest.raises(AvatarError, match="scan: keypoints: the points lie on a line"):
        register(TEMPLATE, BINDING, dataclasses.replace(given, keypoints=line), QUICK)
    with pytest.raises(AvatarError, match="unit"):
        register(TEMPLATE, BINDING, dataclasses.replace(given, points=given.points * 1000), QUICK)
    with pytest.raises(AvatarError, match="landmarks: has no ibug_36"):
        register(dataclasses.replace(TEMPLATE, landmarks={}), BINDING, given, QUICK)
    with pytest.raises(AvatarError, match="the fit diverged"):
        nowhere = torch.full((len(TEMPLATE.vertices), 9), torch.nan)
        register(TEMPLATE, BINDING, given, dataclasses.replace(QUICK, variant="static"), nowhere)
    with pytest.raises(ValueError, match="one scan at least"):
        register_takes(TEMPLATE, BINDING, [], QUICK)
    for wrong in ({"variant": "x"}, {"iterations": 0}, {"prior": -1.0}):
        with pytest.raises(ValueError):
            RegisterSettings(**wrong)  # type: ignore[arg-type]
