"""Which way Gaussians face, and the light of a capture that is estimated."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from avatar_export.levels.fit import changed
from avatar_export.levels.merge import merged, merging
from avatar_export.ops.normals import bound_normals
from avatar_export.relight import relightable
from avatar_runtime.avatar import Avatar
from avatar_runtime.checks.avatar import check_avatar
from avatar_runtime.light import Light, ambient_of, even, light_of, sh_bases
from tests.avatars import avatar_of, full_avatar, surface_avatar
from tests.exporter.relight.balls import RADIUS, ball, sphere
from tests.golden import Array

WHITE = even((1.0, 1.0, 1.0))


def shown(linear: Array) -> Array:
    """Display-referred."""
    x = np.clip(linear, 0, 1)
    return np.where(x <= 0.0031308, 12.92 * x, 1.055 * x ** (1 / 2.4) - 0.055)


def test_a_ball_faces_outwards() -> None:
    avatar = relightable(ball(), WHITE)
    assert avatar.relight is not None
    outwards = avatar.gaussians.mean / np.linalg.norm(avatar.gaussians.mean, axis=1, keepdims=True)
    assert (
        np.quantile(np.sum(bound_normals(avatar) * outwards, axis=1), 0.01) > 0.99
    )  # all but some that are hardly seen
    assert np.linalg.norm(avatar.relight.centre) < 1e-3 and RADIUS < avatar.relight.radius < 1.5 * RADIUS


def test_what_is_seen_from_behind_its_mesh_faces_who_sees_it() -> None:
    """A sheet whose triangles face away from all viewers, as the inner side of lips does before teeth."""
    corner = np.linspace(-0.1, 0.1, 9)
    vertices = np.stack([*np.meshgrid(corner, corner, indexing="ij"), np.zeros((9, 9))], axis=-1).reshape(
        -1, 3
    )
    first = (9 * np.arange(8)[:, None] + np.arange(8)).reshape(-1, 1)
    triangles = np.concatenate([first + np.array(corners) for corners in ([0, 1, 9], [1, 10, 9])])
    across = np.cross(*(vertices[triangles[0, k]] - vertices[triangles[0, 0]] for k in (1, 2)))
    assert across[2] < 0
    ahead = bound_normals(relightable(ball(mesh=(vertices, triangles)), WHITE))[:, 2]
    assert ahead.min() > 0.5


@pytest.mark.parametrize("name", ["joints", "surface", "unrigged", "no mesh", "wild"])
def test_every_avatar_gets_unit_normals_and_a_finite_light(name: str) -> None:
    full, huge = full_avatar(3), np.float32(1e18)
    wild = replace(full, gaussians=replace(full.gaussians, mean=full.gaussians.mean * huge))
    wild = replace(full, gaussians=replace(full.gaussians, mean=full.gaussians.mean * huge))
    avatar = {
        "joints": full,
        "surface": surface_avatar(3),
        "unrigged": surface_avatar(3, rigged=False),
        "no mesh": avatar_of(),
        "wild": wild,
    }[name]
    sound(relightable(avatar))


def sound(avatar: Avatar) -> None:
    relight = avatar.relight
    assert relight is not None
    assert np.abs(np.linalg.norm(relight.normal, axis=1) - 1).max() < 1e-5
    assert np.isfinite(relight.ambient).all() and np.isfinite(relight.radius)


@pytest.mark.parametrize(
    "name", ["blendshapes_avatar", "lam_avatar", "splatting_head_sh3_avatar", "body_avatar"]
)
def test_the_avatars_of_readers(name: str, request: pytest.FixtureRequest) -> None:
    avatar = relightable(request.getfixturevalue(name))
    sound(check_avatar(avatar))


LIGHTS = {
    "white": {"ambient": [1, 1, 1]},
    "from the left": {"ambient": [0.4] * 3, "lights": [{"direction": [1, 0.1, 0.6], "colour": [0.7] * 3}]},
    "from above": {"ambient": [0.5] * 3, "lights": [{"direction": [0, 1, 0.4], "colour": [0.5] * 3}]},
}


def unlike(avatar: Avatar, want: Light) -> float:
    """The root mean square by which the estimate and `want` differ in the logarithm, but for brightness and tint."""
    assert avatar.relight is not None
    bases = sh_bases(bound_normals(avatar))
    apart = np.log(np.maximum(bases @ avatar.relight.ambient, 0.05) / (bases @ ambient_of(want)))
    return float((apart - apart.mean(axis=0)).std())


def coloured(light: Light, *, hair: bool) -> Array:
    """[V, 3] a ball of skin with spots, in a light; with hair above and behind."""
    vertices, _ = sphere()
    normal, rng = vertices / RADIUS, np.random.default_rng(0)
    albedo = np.array((0.5, 0.3, 0.2)) * rng.lognormal(0, 0.15, (len(vertices), 1))
    if hair:
        albedo = np.where(normal[:, [1]] - 0.8 * normal[:, [2]] > 0.75, albedo * 0.1, albedo)
    return shown(albedo * (sh_bases(normal) @ ambient_of(light)))


@pytest.mark.parametrize("hair", [False, True])
@pytest.mark.parametrize("name", LIGHTS)
def test_a_known_light_is_found_again(name: str, hair: bool) -> None:
    light = light_of(LIGHTS[name])
    found = relightable(ball(coloured(light, hair=hair)))
    assert unlike(found, light) < max(
        0.02, 0.75 * unlike(relightable(ball(), WHITE), light)
    )  # than of even light
    assert found.relight is not None
    front = sh_bases(np.array([0.0, 0, 1])) @ found.relight.ambient
    # Bright where it is lit, and white.
    assert front.min() > 0.6 and front.max() < 1.2 and np.ptp(front) < 0.1


def test_levels_face_as_what_they_are_made_of() -> None:
    avatar = relightable(ball(), WHITE)
    count = avatar.gaussians.count
    pairs = merging(np.arange(count) // 2, np.arange(count), np.ones(count), count)
    coarse = merged(avatar, pairs)
    assert np.quantile(np.sum(bound_normals(coarse) * bound_normals(avatar)[::2], axis=1), 0.05) > 0.95
    change = {"log_scale": np.zeros((count // 2, 3)), "turn": np.full((count // 2, 3), 0.3)}
    change |= {"opacity_logit": np.zeros(count // 2), "colour": np.zeros((count // 2, 3))}
    turned = changed(coarse, change)
    assert np.abs(turned.gaussians.quat_wxyz - coarse.gaussians.quat_wxyz).max() > 0.05
    np.testing.assert_allclose(bound_normals(turned), bound_normals(coarse), atol=1e-5)
