"""Every stage of backend `gl` alone, and its pictures, against the NumPy reference: desktop OpenGL and OpenGL ES."""

from __future__ import annotations

from collections.abc import Iterator

import moderngl
import numpy as np
import pytest

from avatar_runtime.backends.gl.context import own_context
from avatar_runtime.camera import Camera
from avatar_runtime.player import Player
from avatar_runtime.posed import Clock
from tests.measured import Measure
from tests.runtime.backends.gl_cases import (
    BACKGROUND,
    avatars,
    backend,
    camera,
    pose_of,
    posed_of,
    reference_picture,
    relative,
    stage_inputs,
)

AVATARS = avatars()
STAGE_LIMIT, PICTURE_LIMIT = 1e-5, 1 / 255


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
            got = gl.stage(stage, inputs, camera(), "engine")
            assert got.keys() == outputs.keys(), stage
            for array, want in outputs.items():
                assert got[array].dtype == want.dtype and got[array].shape == want.shape, (stage, array)
                if stage == "raster":
                    worst = float(np.abs(got[array] - want).max())
                    measured("gl raster fed golden splats, absolute", worst)
                    assert worst <= 2e-6, array
                elif want.dtype.kind == "i":
                    np.testing.assert_array_equal(got[array], want, f"{stage} {array}")
                else:
                    worst = relative(got[array], want)
                    measured(f"gl stage {stage}, relative", worst)
                    assert worst <= STAGE_LIMIT, (stage, array)


@pytest.mark.parametrize("name", AVATARS)
def test_frame_and_animate(name: str, context: moderngl.Context, measured: Measure) -> None:
    avatar = AVATARS[name]
    want = reference_picture(avatar, camera())
    assert want.transmittance.min() < 0.1
    with backend(avatar, context=context) as gl:
        got = gl.frame(posed_of(gl), camera(), BACKGROUND, "engine", Clock())
        for array in ("colour", "transmittance"):
            worst = float(np.abs(getattr(got, array) - getattr(want, array)).max())
            measured("gl picture end to end, absolute", worst)
            assert worst <= PICTURE_LIMIT, array
        splats = Player(avatar, "reference").animate(pose_of(avatar))
        found = gl.animate(posed_of(gl), Clock())
        for array in ("mean", "scale", "quat_wxyz", "opacity", "sh", "sh_rotation"):
            assert relative(getattr(found, array), getattr(splats, array)) <= STAGE_LIMIT, array
        if avatar.rig is not None:
            mesh = Player(avatar, "reference").mesh(pose_of(avatar))
            assert relative(gl.mesh(posed_of(gl), Clock()), mesh) <= STAGE_LIMIT


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
        want = reference_picture(avatar, inside)
        picture = gl.frame(posed_of(gl), inside, BACKGROUND, "engine", Clock())
        assert np.abs(picture.colour - want.colour).max() <= PICTURE_LIMIT


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
