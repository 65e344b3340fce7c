"""Every stage of backend `gl` alone, and its images, against the NumPy reference: desktop OpenGL and OpenGL ES."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import moderngl
import numpy as np
import pytest

from avatar_runtime.avatar import Rules
from avatar_runtime.backends.gl.context import own_context
from avatar_runtime.backends.reference import ReferenceBackend
from avatar_runtime.camera import Camera
from avatar_runtime.checks.avatar import check_avatar
from avatar_runtime.player import Player
from avatar_runtime.posed import Clock
from avatar_runtime.rules import QUATERNION_SIGNS
from tests.avatars import surface_avatar
from tests.measured import Measure
from tests.runtime.backends.gl_cases import (
    BACKGROUND,
    IMAGE_LIMIT,
    STAGE_LIMIT,
    avatars,
    backend,
    camera,
    check_stage,
    pose_of,
    posed_of,
    reference_image,
    relative,
    stage_inputs,
)

AVATARS = avatars()


@pytest.fixture(scope="module", params=[False, True], ids=["desktop", "es"])
def context(request: pytest.FixtureRequest) -> Iterator[moderngl.Context]:
    made = own_context(es=request.param)
    yield made
    made.release()


@pytest.mark.parametrize("name", AVATARS)
def test_every_stage_alone(name: str, context: moderngl.Context, measured: Measure) -> None:
    avatar = AVATARS[name]
    with backend(avatar, context=context) as gl:
        for stage, (inputs, outputs) in stage_inputs(avatar, camera()).items():
            check_stage(stage, gl.stage(stage, inputs, camera(), "engine"), outputs, measured)


@pytest.mark.parametrize("name", AVATARS)
def test_frame_and_animate(name: str, context: moderngl.Context, measured: Measure) -> None:
    avatar = AVATARS[name]
    want = reference_image(avatar, camera())
    assert want.transmittance.min() < 0.1
    with backend(avatar, context=context) as gl:
        got = gl.frame(posed_of(gl), camera(), BACKGROUND, "engine", Clock())
        for array in ("colour", "transmittance"):
            worst = float(np.abs(getattr(got, array) - getattr(want, array)).max())
            measured("gl image end to end, absolute", worst, IMAGE_LIMIT)
            assert worst <= IMAGE_LIMIT, array
        splats = Player(avatar, "reference").animate(pose_of(avatar))
        found = gl.animate(posed_of(gl), Clock())
        for array in ("mean", "scale", "quat_wxyz", "opacity", "sh", "sh_rotation"):
            assert relative(getattr(found, array), getattr(splats, array)) <= STAGE_LIMIT, array
        if avatar.rig is not None:
            mesh = Player(avatar, "reference").mesh(pose_of(avatar))
            assert relative(gl.mesh(posed_of(gl), Clock()), mesh) <= STAGE_LIMIT


ABSURD = {
    "mean": (1e6, -1e20, 1e38, np.inf, -np.inf, np.nan),
    "scale": (np.exp(20), np.exp(38), 1e19, 3e38, np.inf, np.nan, 0),
    "quat_wxyz": (1e10, 1e30, np.inf, np.nan),
    "opacity": (0.0, 1e-30),
}


def test_absurd_numbers_are_culled_as_the_reference_culls_them(context: moderngl.Context) -> None:
    """What overflows on the way to the screen has no radius; nothing else of the image changes."""
    avatar = AVATARS["full"]
    inputs, _ = stage_inputs(avatar, camera())["project"]
    inputs, row = {name: np.array(value) for name, value in inputs.items()}, 0
    for name, values in ABSURD.items():
        for value in values:
            inputs[name].reshape(avatar.gaussians.count, -1)[row, 0] = value
            row += 1
    assert row < avatar.gaussians.count
    with np.errstate(all="ignore"):
        want = ReferenceBackend(avatar).stage("project", inputs, camera(), "engine")
    assert 0 < (want["radius"][:row] == 0).sum() < row
    with backend(avatar, context=context) as gl:
        got = gl.stage("project", inputs, camera(), "engine")
    np.testing.assert_array_equal(got["radius"] == 0, want["radius"] == 0)
    np.testing.assert_array_equal(got["radius"][row:], want["radius"][row:])
    assert np.isfinite(got["conic"]).all() and np.isfinite(got["centre"]).all()


def test_an_overflowing_splat_paints_nothing(context: moderngl.Context) -> None:
    avatar = AVATARS["full"]
    log_scale = avatar.gaussians.log_scale.copy()
    log_scale[0] = (20, 19, 18)
    huge = check_avatar(replace(avatar, gaussians=replace(avatar.gaussians, log_scale=log_scale)))
    with np.errstate(all="ignore"):
        want = reference_image(huge, camera())
    with backend(huge, context=context) as gl:
        got = gl.frame(posed_of(gl), camera(), BACKGROUND, "engine", Clock())
    assert np.abs(got.colour - want.colour).max() <= IMAGE_LIMIT


def test_an_eye_among_the_splats(context: moderngl.Context) -> None:
    """Near, far off axis and behind: the frustum clamp, the near plane, splats of no radius."""
    avatar = AVATARS["full"]
    inside: Camera = camera(distance=0.05)
    inputs, outputs = stage_inputs(avatar, inside)["project"]
    assert 0 < np.count_nonzero(outputs["radius"]) < avatar.gaussians.count
    with backend(avatar, context=context) as gl:
        got = gl.stage("project", inputs, inside, "engine")
        for array, want in outputs.items():
            assert relative(got[array], want) <= STAGE_LIMIT, array
        want = reference_image(avatar, inside)
        image = gl.frame(posed_of(gl), inside, BACKGROUND, "engine", Clock())
        assert np.abs(image.colour - want.colour).max() <= IMAGE_LIMIT


def test_equal_depths_stay_in_the_order_of_ids(context: moderngl.Context) -> None:
    avatar = AVATARS["full"]
    rng = np.random.default_rng(0)
    depth = rng.choice(np.array([0.3, 0.30000004, 0.5, 2.0], np.float32), avatar.gaussians.count)
    radius = rng.integers(0, 2, avatar.gaussians.count).astype(np.int32)
    drawn = np.flatnonzero(radius)
    with backend(avatar, context=context) as gl:
        order = gl.stage("sort", {"depth": depth, "radius": radius}, None, "engine")["order"]
    np.testing.assert_array_equal(order, drawn[np.argsort(depth[drawn], kind="stable")])


def test_posed_vertices_stand_in_for_the_rig(context: moderngl.Context) -> None:
    avatar = AVATARS["surface world"]
    assert avatar.embedding is not None
    vertices = avatar.embedding.canonical_vertices * np.float32(1.1)
    player = Player(avatar, "reference")
    want = player.animate(pose_of(avatar), posed_vertices=vertices)
    with backend(avatar, context=context) as gl:
        got = gl.animate(player.posed(pose_of(avatar), posed_vertices=vertices), Clock())
    assert relative(got.mean, want.mean) <= STAGE_LIMIT
    assert relative(got.quat_wxyz, want.quat_wxyz) <= STAGE_LIMIT


WILD = {
    "code": Rules("vertex_quaternion", scale="log_area"),
    "paper": Rules("vertex_quaternion_mean", position="interpolated_normal", scale="linear_area"),
}


@pytest.mark.parametrize("sign", QUATERNION_SIGNS)
@pytest.mark.parametrize("size", [1.0, 0.01, 0.003])
@pytest.mark.parametrize("rules", WILD.values(), ids=WILD)
def test_a_mesh_turned_all_ways(
    rules: Rules, size: float, sign: str, context: moderngl.Context, measured: Measure
) -> None:
    """Triangles beyond half a turn, where the sign rules part; and so small that the floors decide."""
    rules = replace(rules, quaternion_sign=sign)
    avatar = surface_avatar(3, rules)
    inputs, _ = stage_inputs(avatar, camera())["bind"]
    assert avatar.embedding is not None
    canonical = avatar.embedding.canonical_vertices * np.float32(size)
    avatar = replace(avatar, embedding=replace(avatar.embedding, canonical_vertices=canonical))
    wild = np.random.default_rng(5).normal(0, 0.06 * size, canonical.shape)
    inputs["posed_vertices"] = wild.astype(np.float32)
    want = ReferenceBackend(avatar).stage("bind", inputs, None, "engine")
    with backend(avatar, context=context) as gl:
        got = gl.stage("bind", inputs, None, "engine")
    check_stage("bind", got, want, measured)
