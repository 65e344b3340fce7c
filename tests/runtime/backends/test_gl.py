"""Backend `gl` besides the stages: limits, targets, orders, depth, several avatars, ownership of the context."""

from __future__ import annotations

from dataclasses import fields, replace
from typing import Any

import moderngl
import numpy as np
import pytest

import avatar_shaders
from avatar_runtime.avatar import Avatar
from avatar_runtime.backends.gl import GlBackend, make_scene
from avatar_runtime.backends.gl.gpu import Gpu
from avatar_runtime.io.errors import AvatarError
from avatar_runtime.player import Player
from avatar_runtime.posed import Clock
from avatar_runtime.stages.activate import Splats
from avatar_runtime.stages.project import project
from avatar_runtime.stages.raster import raster
from avatar_runtime.stages.sort import sort
from tests.avatars import full_avatar, surface_avatar
from tests.measured import Measure
from tests.runtime.backends.gl_cases import (
    BACKGROUND,
    SIZE,
    backend,
    camera,
    pose_of,
    posed_of,
    reference_image,
)

FULL, SURFACE = full_avatar(3), surface_avatar(3)
WIDTH, HEIGHT = SIZE


def image(gl: GlBackend, **options: Any) -> Any:
    return gl.scene.image([posed_of(gl)], camera(), BACKGROUND, **options)


def same(a: Any, b: Any) -> bool:
    return np.array_equal(a.colour, b.colour) and np.array_equal(a.transmittance, b.transmittance)


@pytest.mark.parametrize("avatar", [FULL, SURFACE], ids=["joints", "surface"])
def test_a_small_limit_is_never_exceeded(
    avatar: Avatar, context: moderngl.Context, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The same bytes come out of many small buffers; sizes are those that GL reserved."""
    sizes: list[int] = []
    reserve = moderngl.Context.buffer

    def noted(*arguments: Any, **options: Any) -> moderngl.Buffer:
        made = reserve(*arguments, **options)
        sizes.append(made.size)
        return made

    with backend(avatar, context=context) as gl:
        want, splats = image(gl), gl.animate(posed_of(gl), Clock())
    monkeypatch.setattr(moderngl.Context, "buffer", noted)
    with backend(avatar, context=context, buffer_limit=1600) as gl:
        assert len(gl.interpreter.chunks) > 5
        got, found = image(gl), gl.animate(posed_of(gl), Clock())
        gl.mesh(posed_of(gl), Clock())
    assert 1000 < max(sizes) <= 1600
    assert same(got, want)
    for field in fields(splats):
        np.testing.assert_array_equal(getattr(found, field.name), getattr(splats, field.name))


# One rounding a splat: halves have 11 bits, bytes 8; up to about 20 splats lie on one pixel here.
@pytest.mark.parametrize(("target", "limit"), [("rgba32f", 1e-5), ("rgba16f", 2 / 255), ("rgba8", 6 / 255)])
@pytest.mark.parametrize("order", ["back_to_front", "front_to_back"])
def test_targets_and_orders(
    target: str, limit: float, order: str, context: moderngl.Context, measured: Measure
) -> None:
    want = reference_image(FULL, camera())
    with backend(FULL, context=context, target=target, order=order) as gl:
        got = image(gl)
    inside = want.colour.max(axis=2) <= 1  # bytes hold no more than 1
    worst = float(np.abs(got.colour - want.colour)[inside].max())
    measured(f"gl {target} {order}, 1/255", 255 * worst, 255 * limit)
    assert worst <= limit and np.abs(got.transmittance - want.transmittance).max() <= limit
    assert worst > 1e-5 or target == "rgba32f"


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"target": "rgba64"}, "'rgba64' is not one of rgba32f, rgba16f, rgba8"),
        ({"order": "sideways"}, "'sideways' is not one of back_to_front, front_to_back"),
        ({"es": True}, "es asks for a context"),
        ({"buffer_limit": 1023}, "buffer_limit is 1023 bytes; 1024 to"),
        ({"buffer_limit": 1 << 31}, "buffer_limit is 2147483648 bytes"),
        ({"buffer_limit": float("nan")}, "float"),
    ],
)
def test_unknown_options_are_a_callers_mistake(
    options: dict[str, Any], said: str, context: moderngl.Context
) -> None:
    with pytest.raises((TypeError, ValueError), match=said):
        GlBackend(FULL, context, **options)


def seen_by_reference(parts: list[Splats], hidden: Any = None) -> Any:
    """The reference's image of concatenated splats, without those whose z / w lies behind `hidden`."""
    joined = Splats(*(np.concatenate([getattr(s, f.name) for s in parts]) for f in fields(Splats)))
    projected = project(joined, camera(), FULL.raster, FULL.sh_degree)
    if hidden is not None:
        at = np.append(joined.mean, np.ones((len(joined.mean), 1)), axis=1) @ camera().clip_from_world.T
        keep = at[:, 2] / at[:, 3] <= hidden
        projected = replace(projected, radius=np.where(keep, projected.radius, 0))
    return raster(projected, sort(projected), camera(), BACKGROUND, "engine")


def test_depth_hides_what_lies_behind(context: moderngl.Context) -> None:
    """Left half: a plane in the middle of the splats; right half: far away."""
    splats = Player(FULL, "reference").animate(pose_of(FULL))
    at = np.append(splats.mean, np.ones((len(splats.mean), 1)), axis=1) @ camera().clip_from_world.T
    window = at[:, 2] / at[:, 3]
    plane = float(np.median(window))
    assert np.abs(window - plane).min() > 1e-5  # no splat on the plane, where rounding would decide
    depth = np.ones((HEIGHT, WIDTH), np.float32)
    depth[20:, : WIDTH // 2] = plane
    whole, cut = seen_by_reference([splats]), seen_by_reference([splats], plane)
    assert np.abs(whole.colour - cut.colour)[:, : WIDTH // 2].max() > 0.1
    mixed = np.where(depth[..., None] < 1, cut.colour, whole.colour)
    for order in ("back_to_front", "front_to_back"):
        with backend(FULL, context=context, order=order) as gl:
            assert np.abs(image(gl, depth=depth).colour - mixed).max() <= 1 / 255
            assert np.abs(image(gl).colour - whole.colour).max() <= 1 / 255  # and is forgotten after
            with pytest.raises(ValueError, match=r"the depth is \(4, 3\), the image \(200, 160\)"):
                image(gl, depth=np.ones((3, 4), np.float32))


def test_several_avatars_in_one_draw(context: moderngl.Context) -> None:
    """Interleaved in depth: as the reference draws their splats as one avatar's."""
    other = replace(SURFACE, raster=FULL.raster)
    parts = [Player(avatar, "reference").animate(pose_of(avatar)) for avatar in (FULL, other)]
    want = seen_by_reference(parts)
    for limit in (1 << 20, 1600):
        with (
            backend(FULL, context=context, buffer_limit=limit) as first,
            backend(other, context=context, buffer_limit=limit) as second,
        ):
            scene = make_scene([first, second])
            posed = [posed_of(first), posed_of(second)]
            assert np.abs(scene.image(posed, camera(), BACKGROUND).colour - want.colour).max() <= 1 / 255
            alone = image(first)
            assert same(alone, make_scene([first]).image(posed[:1], camera(), BACKGROUND))
            with pytest.raises(ValueError, match="1 poses for 2 avatars"):
                scene.image(posed[:1], camera())


class Altered:
    """The shaders, one of them altered."""

    def __init__(self, entry: str, old: str, new: str) -> None:
        self.entry, self.old, self.new = entry, old, new

    def source(self, entry: str, language: str) -> str:
        text = avatar_shaders.source(entry, language)
        if entry != self.entry:
            return text
        assert self.old in text
        return text.replace(self.old, self.new)

    def reflection(self, language: str) -> Any:
        return avatar_shaders.reflection(language)


def test_a_shader_that_does_not_compile(context: moderngl.Context) -> None:
    language = Gpu(context, False, 1 << 20).language
    for entry, named in (("blend", "blend"), ("raster_pixel", "raster_vertex and raster_pixel")):
        broken = Altered(entry, "void main()\n{", "void main()\n{ undeclared = 1;")
        with pytest.raises(AvatarError, match=f"shader {named} \\({language}\\): .*undeclared") as caught:
            GlBackend(FULL, context, shaders=broken)
        assert "\n" not in str(caught.value)


def test_the_size_may_change_from_frame_to_frame(context: moderngl.Context) -> None:
    small = replace(camera(), width=40, height=30)
    with backend(FULL, context=context) as gl:
        want = image(gl, depth=np.ones((HEIGHT, WIDTH), np.float32))
        held = len(gl.gpu.held)
        got = gl.scene.image([posed_of(gl)], small, BACKGROUND, depth=np.ones((30, 40), np.float32))
        assert len(gl.gpu.held) == held
        assert got.colour.shape == (30, 40, 3)
        assert np.abs(got.colour - reference_image(FULL, small).colour).max() <= 1 / 255
        assert same(image(gl), want)
