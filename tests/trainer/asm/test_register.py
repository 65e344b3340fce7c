"""ASM faces fitted to scans: the toy face against faces and expressions that are known."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator

import numpy as np
import pytest
import torch

from avatar_export.asm.maths import posed
from avatar_export.asm.model import AsmFace, Take
from avatar_runtime.avatar import F64
from avatar_runtime.backends.cpu.threads import using
from avatar_runtime.io.errors import AvatarError
from avatar_trainer.asm.align import Scan
from avatar_trainer.asm.kernels.closest import nearest, triangle_tree
from avatar_trainer.asm.register.fit import (
    Registration,
    register,
    register_takes,
    scan_error,
    template_keypoints,
)
from avatar_trainer.asm.register.settings import RegisterSettings
from avatar_trainer.loop.machine import reproducible
from tests.measured import Measure
from tests.trainer.asm.test_align import a_motion, moved
from tests.trainer.asm.toy import binding, changed, grid, scan, template

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


def bumpy(given: F64, triangles: F64, height: float) -> tuple[F64, F64]:
    """A scan's surface, and the same turned inside out `height` metres behind it: what lies within."""
    inner = given - (0, 0, height)
    return np.concatenate([given, inner]), np.concatenate([triangles, triangles[:, ::-1] + len(given)])


def off(found: Registration, given: Scan) -> float:
    """Mean mm along z of a placed scan's points in the middle from the face, which no motion makes up for."""
    middle = np.linalg.norm(given.points[:, :2], axis=1) < 0.03
    tree = triangle_tree(found.vertices[0], TEMPLATE.triangles)
    return float(
        1e3 * np.sqrt(nearest(given.points[middle], found.vertices[0], tree).squared_distance).mean()
    )


def test_what_faces_the_other_way_does_not_attract() -> None:
    """The inner side of a surface 2 mm behind it, as in a nostril: by distance alone the face settles between."""
    uv, triangles = grid(41)
    keypoints = scan(1.0).keypoints
    points, both = bumpy(changed(uv, 1.0), triangles, 2e-3)
    given = Scan("s", points, both, keypoints)
    outer = Scan("s", changed(uv, 1.0), None, keypoints)
    deaf = dataclasses.replace(QUICK, facing=-1.0, smooth=0.0, placed=True)
    errors = []
    for settings in (deaf, dataclasses.replace(deaf, facing=0.5)):
        errors.append(off(register(TEMPLATE, BINDING, given, settings), outer))
    assert errors[1] < 0.3 < 0.7 < errors[0]


def roughness(moved: F64, of: F64) -> float:
    """Mean over the sheet's edges of how unevenly it `moved` from `of` [V, 3], by edge length, squared."""
    ends = np.unique(np.sort(TEMPLATE.triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)), axis=0)
    way = moved - of
    length = np.linalg.norm(TEMPLATE.vertices[ends[:, 0]] - TEMPLATE.vertices[ends[:, 1]], axis=1)
    return float(np.mean((np.linalg.norm(way[ends[:, 0]] - way[ends[:, 1]], axis=1) / length) ** 2))


def test_strain_keeps_the_surface_even() -> None:
    """A noisy scan crumples the face; the smooth term, of the size that is written out here, holds it."""
    given = scan(1.0, points=600)
    noise = np.random.default_rng(5).normal(size=given.points.shape) * 2e-3
    given = dataclasses.replace(given, points=given.points + noise)
    settings = dataclasses.replace(QUICK, smooth=0.0, prior=0.0, widened=9.0)
    still = TEMPLATE.vertices.astype(np.float64)
    rough = [
        roughness(register(TEMPLATE, BINDING, given, change).vertices[0], still)
        for change in (settings, dataclasses.replace(settings, smooth=300.0))
    ]
    assert rough[1] < 0.3 * rough[0]
    random, count = np.random.default_rng(6), len(TEMPLATE.bone_names)
    shift = random.normal(size=(1, count, 3)) * 3e-3
    start = Take("begun", 30.0, np.zeros_like(shift), shift, np.ones_like(shift))
    energies = [
        register_takes(
            TEMPLATE, BINDING, [given], dataclasses.replace(settings, smooth=s, iterations=1), start=start
        ).energy[0]
        for s in (0.0, 7000.0)
    ]
    begun = posed(AsmFace("a", TEMPLATE, BINDING, (start,)), start)
    assert energies[1] - energies[0] == pytest.approx(7000 * roughness(begun, still), rel=1e-4)


def test_known_vertices_may_stretch_as_they_will() -> None:
    """Their strain is that of what the face misses them by, not of their own motion."""
    uv, triangles = grid(len(np.unique(TEMPLATE.uv[:, 0])))
    goal = changed(uv, 1.0) * (1.3, 1.0, 1.0)
    given = Scan("s", goal, triangles, scan().keypoints, np.arange(len(goal)))
    settings = dataclasses.replace(QUICK, placed=True, widened=9.0, smooth=10.0, iterations=120)
    found = register(TEMPLATE, BINDING, given, settings)
    rest = TEMPLATE.vertices.astype(np.float64)
    assert roughness(found.vertices[0], goal) < 0.2 * roughness(found.vertices[0], rest)
    assert 1e3 * np.linalg.norm(found.vertices[0] - goal, axis=1).mean() < 1
    first = [
        register(TEMPLATE, BINDING, given, dataclasses.replace(settings, iterations=1, smooth=smooth)).energy[
            0
        ]
        for smooth in (0.0, 1000.0)
    ]
    assert first[1] - first[0] == pytest.approx(1000 * roughness(rest, goal), rel=1e-4)


def test_the_cap_shrinks_until_half_way() -> None:
    """Points that all lie 20 mm off pull while the cap is above that, and no longer."""
    given = scan()
    away = dataclasses.replace(given, points=np.add(given.points, (0, 0, 0.02)))
    settings = dataclasses.replace(
        QUICK, iterations=9, learning_rate=1e-9, placed=True, smooth=0.0, first_cap_mm=30.0, last_cap_mm=10.0
    )
    energy = register(TEMPLATE, BINDING, away, settings).energy
    # Nearest points lie 12 to 20 mm off. The cap falls by 40/9 mm an iteration: 30.0, 25.6, 21.1, 16.7, 12.2, 10, ...
    assert energy[0] > 100 and energy[1:3] == pytest.approx(energy[0], rel=1e-3)
    assert 0.1 * energy[0] < energy[3] < 0.9 * energy[0]
    assert (energy[5:] < 1e-3).all()


def test_bones_that_are_nowhere_are_one_line() -> None:
    lost = dataclasses.replace(BINDING, zeta=BINDING.zeta * np.nan)
    with pytest.raises(AvatarError, match="the fit diverged"):
        register(TEMPLATE, lost, scan(), QUICK)


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
