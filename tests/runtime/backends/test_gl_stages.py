"""Every stage of backend `gl` alone, and its images, against the NumPy reference: desktop OpenGL and OpenGL ES."""

from __future__ import annotations

from dataclasses import replace

import moderngl
import numpy as np
import pytest

from avatar_runtime.avatar import F32
from avatar_runtime.backends.gl.draw import FLIP_Y
from avatar_runtime.backends.gl.gpu import Gpu
from avatar_runtime.backends.gl.programs import Programs
from avatar_runtime.backends.reference import ReferenceBackend
from avatar_runtime.player import Player
from avatar_runtime.posed import Clock
from avatar_runtime.stages.project import Projected, project
from avatar_runtime.stages.raster import raster_depth
from tests.measured import Measure
from tests.runtime.backends.gl_cases import (
    BACKGROUND,
    IMAGE_LIMIT,
    SIZE,
    STAGE_LIMIT,
    avatars,
    backend,
    camera,
    pose_of,
    posed_of,
    reference_image,
    relative,
    stage_inputs,
)

AVATARS = avatars()


@pytest.mark.parametrize("name", ["full", "surface world", "surface without a rig"])
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


DEPTH_LIMIT = 4 * 2.0**-24  # roundings of 24 bits, of a depth near 1


def depth_drawn(projected: Projected, clip_depth: F32, depth_alpha: float) -> F32:
    """The depth that entries raster_vertex and raster_depth_pixel leave, [H, W]."""
    quads = np.zeros((len(clip_depth), 12), np.float32)
    quads[:, :2], quads[:, 2], quads[:, 3] = projected.centre, clip_depth, projected.opacity
    quads[:, 4:7] = projected.conic
    gpu = Gpu(None, False, 1 << 20)  # OpenGL ES cannot read depth
    with gpu.current():
        programs, made = Programs(gpu), gpu.context
        inputs = [item["name"] for item in programs.table["raster_vertex"]["inputs"]]
        program = programs.draw("raster_vertex", "raster_depth_pixel")
        array = made.vertex_array(program, [(made.buffer(quads), "4f 4f 4x4/i", *inputs[:2])])
        depth = made.depth_texture(SIZE)
        made.framebuffer(depth_attachment=depth).use()
        made.clear(depth=1.0)
        made.enable_only(moderngl.DEPTH_TEST)
        constants = {"raster_constants": (*SIZE, FLIP_Y), "depth_alpha": depth_alpha}
        programs.constants("raster_depth_pixel", constants).bind()
        array.render(moderngl.TRIANGLE_STRIP, vertices=4, instances=len(quads))
        found = np.frombuffer(depth.read(), np.float32).reshape(SIZE[::-1])
    gpu.release()
    return found


@pytest.mark.parametrize("depth_alpha", [0.1, 0.5])
def test_depth_is_written_as_it_is_defined(depth_alpha: float, measured: Measure) -> None:
    """Where an alpha is the threshold but for rounding, the splat may write or not."""
    avatar = AVATARS["full"]
    splats = Player(avatar, "reference").animate(pose_of(avatar))
    projected = project(splats, camera(), avatar.raster, avatar.sh_degree)
    projected = replace(projected, opacity=projected.opacity**0.2)  # so that many pass
    at = np.append(splats.mean, np.ones((len(splats.mean), 1)), axis=1) @ camera().clip_from_world.T
    clip_depth = (at[:, 2] / at[:, 3]).astype(np.float32)
    got = depth_drawn(projected, clip_depth, depth_alpha)
    nearest, farthest = (
        raster_depth(projected, clip_depth, camera(), depth_alpha + side * 1e-5) for side in (-1, 1)
    )
    assert 300 < (got < 1).sum() < got.size / 2
    worst = float(np.maximum(nearest - got, got - farthest).max())
    measured("gl depth written, roundings of 24 bits", worst * 2.0**24, DEPTH_LIMIT * 2.0**24)
    assert worst <= DEPTH_LIMIT
