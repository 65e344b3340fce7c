"""ASM faces fitted to scans: the toy face against faces and expressions that are known."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
import torch

from avatar_export.asm.maths import posed
from avatar_export.asm.model import AsmFace
from avatar_runtime.backends.cpu.threads import using
from avatar_runtime.errors import AvatarError
from avatar_trainer.systems.asm_align import Scan
from avatar_trainer.systems.asm_register import (
    Registration,
    register,
    register_takes,
    scan_error,
    template_keypoints,
)
from avatar_trainer.systems.asm_register_settings import RegisterSettings
from tests.measured import Measure
from tests.trainer.systems.asm_toy import binding, changed, grid, scan, template
from tests.trainer.systems.test_asm_align import a_motion, moved

TEMPLATE = template()
BINDING = binding(TEMPLATE)
QUICK = RegisterSettings(iterations=60, learning_rate=4e-3, prior=1e-3)


def fitted(given: Scan, **settings: object) -> float:
    """Error in mm."""
    return scan_error(
        register(TEMPLATE, BINDING, given, dataclasses.replace(QUICK, **settings)), given
    ).mean_mm


def test_the_error_falls_from_static_to_bound_to_tunable_and_random_weights_are_worst(
    measured: Measure,
) -> None:
    """The order of the paper's Table 7."""
    given = scan(1.5)
    errors = {
        name: fitted(given, variant=name) for name in ("static", "dynamic_binding", "full", "random_weights")
    }
    assert errors["full"] < 0.8 * errors["dynamic_binding"]
    assert errors["dynamic_binding"] < errors["static"] < errors["random_weights"]
    measured("toy face fitted to a scan, mm", errors["full"])


def test_a_scan_anywhere_and_in_any_unit_is_fitted_as_well() -> None:
    given, by = scan(1.0), a_motion(3, scale=1000.0, shift=500.0)
    here = register(TEMPLATE, BINDING, given, QUICK)
    there = register(TEMPLATE, BINDING, moved(by, given), dataclasses.replace(QUICK, similarity=True))
    # The scale is the keypoints', which lie a little differently on another person.
    assert there.placements[0].scale == pytest.approx(1e-3, rel=0.02)
    assert scan_error(there, moved(by, given)).mean_mm == pytest.approx(
        scan_error(here, given).mean_mm, abs=0.02
    )
    back = there.placements[0].apply(by.apply(given.points))
    assert np.abs(back - here.placements[0].apply(given.points)).max() < 5e-3


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


def test_the_face_found_plays_as_it_was_fitted(measured: Measure) -> None:
    """Face and take, through the exporter's float64 maths, give the fitted vertices: for every variant."""
    for variant in ("static", "dynamic_binding", "full"):
        found = register(
            TEMPLATE, BINDING, scan(1.0), dataclasses.replace(QUICK, variant=variant, iterations=30)
        )
        off = np.abs(posed(found.face, found.face.takes[0]) - found.vertices[0]).max()
        assert off < 2e-7
        measured("ASM face replayed against its fit, m", float(off))


def test_expressions_share_a_binding_and_have_their_own_poses() -> None:
    scans = [scan(0.5, name="ann"), scan(2.0, seed=1, name="chin_out"), scan(-1.0, seed=2, name="chin_in")]
    found = register_takes(TEMPLATE, BINDING, scans, dataclasses.replace(QUICK, iterations=150))
    assert [take.name for take in found.face.takes] == ["neutral", "chin_out", "chin_in"]
    assert found.face.name == "ann"
    assert all(take.translation.shape == (1, 9, 3) for take in found.face.takes)
    errors = [scan_error(found, given, i).mean_mm for i, given in enumerate(scans)]
    assert max(errors) < 0.15
    at_rest = [scan_error(found, given, 0).mean_mm for given in scans]
    assert errors[1] < 0.3 * at_rest[1]


def test_known_vertices_are_followed_one_by_one() -> None:
    """Slid along a plane, a surface fits itself; its vertices do not."""
    uv, triangles = grid(len(np.unique(TEMPLATE.uv[:, 0])))
    goal = changed(uv, 2.0)
    marks = {
        n: goal[row] for n, row in zip(template_keypoints(TEMPLATE), TEMPLATE.landmarks.values(), strict=True)
    }
    given = Scan("s", goal, triangles, marks, np.arange(len(goal)))
    free = dataclasses.replace(given, vertex=None)
    apart = []
    for target in (given, free):
        found = register(TEMPLATE, BINDING, target, dataclasses.replace(QUICK, widened=9.0))
        off = found.vertices[0] - found.placements[0].apply(goal)
        apart.append(np.linalg.norm(off, axis=1).mean())
    assert apart[0] < 3e-4 < 2 * apart[0] < apart[1]
    unknown = dataclasses.replace(given, vertex=np.full(len(goal), -1))
    with pytest.raises(AvatarError, match="no point"):
        register(TEMPLATE, BINDING, unknown, QUICK)


def test_a_strong_prior_holds_the_face_at_rest() -> None:
    given = scan(1.5)
    found = register(TEMPLATE, BINDING, given, dataclasses.replace(QUICK, prior=1e5))
    assert np.abs(found.vertices[0] - TEMPLATE.vertices).max() < 2e-4
    assert np.abs(found.face.binding.mu - BINDING.mu).max() < 2e-3


def test_the_prior_is_equation_19() -> None:
    """Against the same sum written out for the face that comes out of one step."""
    weights = (2.0, 0.3, 0.5, 0.7, 0.11)
    names = ("lambda_pose", "lambda_zeta", "lambda_pi", "lambda_mu", "lambda_sigma")
    settings = dataclasses.replace(QUICK, prior=1.0, iterations=2, **dict(zip(names, weights, strict=True)))
    energies = [
        register(TEMPLATE, BINDING, scan(1.0), s).energy
        for s in (settings, dataclasses.replace(settings, prior=0.0))
    ]
    # Both take the same first step only where the prior has no gradient: at rest. Its value is then the difference.
    one = register(TEMPLATE, BINDING, scan(1.0), dataclasses.replace(settings, iterations=1)).face
    assert energies[0][1] - energies[1][1] == pytest.approx(written_out(one, weights), rel=1e-3)


def written_out(face: AsmFace, weights: tuple[float, ...]) -> float:
    take, now = face.takes[0], face.binding
    factors = []
    for of in (now, BINDING):
        cholesky = np.linalg.cholesky(of.covariance[..., [0, 1, 1, 2]].reshape(*of.pi.shape, 2, 2))
        factors.append(
            np.stack([np.log(cholesky[..., 0, 0]), np.log(cholesky[..., 1, 1]), cholesky[..., 1, 0]])
        )
    parts = (
        (take.rotation_vector**2).sum()
        + ((10 * take.translation) ** 2).sum()
        + (np.log(take.scale) ** 2).sum(),
        ((10 * (now.zeta - BINDING.zeta)) ** 2).sum(),
        ((now.pi - BINDING.pi) ** 2).sum(),
        ((10 * (now.mu - BINDING.mu)) ** 2).sum(),
        ((factors[0] - factors[1]) ** 2).sum(),
    )
    return float(np.dot(weights, parts))


def bits(found: Registration) -> list[bytes]:
    take, person = found.face.takes[0], found.face.binding
    arrays = (take.translation, take.scale, person.mu, person.covariance, found.vertices, found.energy)
    return [array.tobytes() for array in arrays]


def test_the_same_bits_again_and_on_any_number_of_threads() -> None:
    short = dataclasses.replace(QUICK, iterations=5)
    runs = []
    for threads in (1, 2, 1):
        with using(threads):
            runs.append(bits(register(TEMPLATE, BINDING, scan(1.0), short)))
    assert runs[0] == runs[1] == runs[2]
    seeds = [dataclasses.replace(short, variant="random_weights", seed=s) for s in (0, 0, 1)]
    a, b, c = (bits(register(TEMPLATE, BINDING, scan(1.0), s)) for s in seeds)
    assert a == b != c


def test_given_weights_are_what_a_static_face_has() -> None:
    """With all of every vertex on the root, a static face can only move, turn and grow as a whole."""
    root = torch.zeros(len(TEMPLATE.vertices), 9)
    root[:, 0] = 1
    settings = dataclasses.replace(QUICK, variant="static")
    found = register(TEMPLATE, BINDING, scan(1.5), settings, root)
    plain = np.c_[TEMPLATE.vertices, np.ones(len(TEMPLATE.vertices))]
    left = plain @ np.linalg.lstsq(plain, found.vertices[0], rcond=None)[0] - found.vertices[0]
    assert np.abs(left).max() < 1e-6


def test_bad_scans_and_templates_are_one_line() -> None:
    given = scan()
    line = {name: np.array([float(i), 0, 0]) for i, name in enumerate(given.keypoints)}
    with pytest.raises(AvatarError, match="scan: keypoints: the points lie on a line"):
        register(TEMPLATE, BINDING, dataclasses.replace(given, keypoints=line), QUICK)
    with pytest.raises(AvatarError, match="unit"):
        register(TEMPLATE, BINDING, dataclasses.replace(given, points=given.points * 1000), QUICK)
    with pytest.raises(AvatarError, match="landmarks: has no ibug_36"):
        register(dataclasses.replace(TEMPLATE, landmarks={}), BINDING, given, QUICK)
    with pytest.raises(AvatarError, match="went astray"):
        nowhere = torch.full((len(TEMPLATE.vertices), 9), torch.nan)
        register(TEMPLATE, BINDING, given, dataclasses.replace(QUICK, variant="static"), nowhere)
    with pytest.raises(ValueError, match="one scan at least"):
        register_takes(TEMPLATE, BINDING, [], QUICK)
    for wrong in ({"variant": "x"}, {"iterations": 0}, {"prior": -1.0}):
        with pytest.raises(ValueError):
            RegisterSettings(**wrong)  # type: ignore[arg-type]
