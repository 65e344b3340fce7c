"""Stages `shadow` and `light` on every backend, against the formulas of SPEC.md section 19 and scenes that one can
compute by hand.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from avatar_runtime.avatar import Avatar
from avatar_runtime.backends import Backend, make_backend
from avatar_runtime.backends.reference import ReferenceBackend
from avatar_runtime.camera import Camera
from avatar_runtime.handedness import mirrored, mirrored_light, mirrored_pose
from avatar_runtime.light import SHADOW_SIZE, DirectLight, Light, LightArrays, ambient_of, even, light_arrays
from avatar_runtime.player import Player
from avatar_runtime.pose import Pose
from avatar_runtime.posed import Clock
from avatar_runtime.rotation import homogeneous, matrix_from_rotvec
from avatar_runtime.stages.activate import Splats
from avatar_runtime.stages.light import shadow_map
from tests.conformance.avatars import AVATARS
from tests.conformance.cases import STUDIO, cases_of
from tests.golden import Array
from tests.oracles import light as oracle

BACKENDS = ("reference", "cpu", "gl")
DARK = even((0.0, 0.0, 0.0))
FAR = 1e30
COUNT = 48  # Gaussians of the avatars of light


@contextmanager
def played(avatar: Avatar, backend: str) -> Iterator[Backend]:
    made = make_backend(backend, avatar)
    try:
        yield made
    finally:
        made.release()


def white(normal: Array, frame: str = "world") -> Avatar:
    """Gaussians that face along `normal` [N, 3], captured in white light from all sides."""
    own = AVATARS["lit_world"]()
    assert own.relight is not None and len(normal) == COUNT
    relight = replace(
        own.relight, normal=normal.astype(np.float32), ambient=even((1.0, 1.0, 1.0)), frame=frame
    )
    return replace(own, relight=replace(relight, centre=(0.0, 0.0, 0.0), radius=1.0))


def given(
    avatar: Avatar,
    light: Light,
    mean: Array,
    rgb: float | Array = 1.0,
    world: Array | None = None,
    head: Array | None = None,
) -> dict[str, Any]:
    """The inputs of both stages: small opaque Gaussians at `mean` whose axes are the world's; no mesh."""
    assert avatar.relight is not None
    lit, n = light_arrays(light, avatar.relight, np.eye(4) if world is None else world, head), len(mean)
    return {
        "mean": np.asarray(mean, np.float32),
        "scale": np.full((n, 3), 0.01, np.float32),
        "quat_wxyz": np.tile(np.float32([1, 0, 0, 0]), (n, 1)),
        "opacity": np.full(n, 0.9, np.float32),
        "radius": np.ones(n, np.int32),
        "rgb": np.broadcast_to(np.float32(rgb), (n, 3)).copy(),
        "world_from_avatar": np.eye(4),
        **{f"light_{name}": getattr(lit, name) for name in ("ambient", "place", "colour", "turn")},
        "shadow_row": lit.shadow_row,
        "shadow_offset": lit.shadow_offset,
    }


def linear(display: Array) -> Array:
    c = np.asarray(display, np.float64)
    return np.where(c > 0.04045, ((c + 0.055) / 1.055) ** 2.4, c / 12.92)


def around(count: int = COUNT) -> Array:
    """Directions all over a sphere."""
    z = 1 - (2 * np.arange(count) + 1) / count
    angle = np.pi * (1 + 5**0.5) * np.arange(count)
    return np.stack([np.sqrt(1 - z * z) * np.cos(angle), np.sqrt(1 - z * z) * np.sin(angle), z], axis=1)


@pytest.mark.parametrize("backend", BACKENDS)
@pytest.mark.parametrize(("frame", "jointed"), [("head", True), ("head", False), ("world", True)])
def test_colours_are_those_of_the_formulas(frame: str, jointed: bool, backend: str) -> None:
    """Random Gaussians, colours from black to bright, lights of both kinds; the light of the capture turned."""
    avatar, rng = AVATARS["lit_head"](), np.random.default_rng(5)
    assert avatar.relight is not None
    avatar = replace(avatar, relight=replace(avatar.relight, frame=frame))
    world, head = homogeneous(matrix_from_rotvec(rng.normal(0, 1, (2, 3))), rng.normal(0, 1, (2, 3)))
    turn = {"head": world[:3, :3] @ head[:3, :3] if jointed else world[:3, :3], "world": np.eye(3)}[frame]
    light, mean = replace(STUDIO, shadow=False), rng.uniform(-0.3, 0.3, (COUNT, 3))
    rgb = rng.uniform(0, 1.4, (COUNT, 3)) ** 3
    x = given(avatar, light, mean, rgb, world, head.astype(np.float32) if jointed else None)
    x["quat_wxyz"] = rng.standard_normal((COUNT, 4)).astype(np.float32)
    x["quat_wxyz"] /= np.linalg.norm(x["quat_wxyz"], axis=1, keepdims=True)
    x["radius"][::7] = 0
    lights = [("position" if one.point else "direction", one.place, one.colour) for one in light.lights]
    want = [
        x["rgb"][i]
        if x["radius"][i] == 0
        else oracle.light(
            x["rgb"][i].tolist(),
            x["mean"][i].tolist(),
            x["quat_wxyz"][i].tolist(),
            avatar.relight.normal[i].tolist(),
            light.ambient.tolist(),
            lights,
            avatar.relight.ambient.tolist(),
            turn.tolist(),
        )
        for i in range(COUNT)
    ]
    with played(avatar, backend) as own:
        got = own.stage("light", x, None, "engine")["rgb"]
    np.testing.assert_allclose(got, want, rtol=1e-5, atol=2e-5)


@pytest.mark.parametrize("backend", BACKENDS)
def test_normals_turn_with_their_triangles_where_joints_turn_the_gaussians(backend: str) -> None:
    avatar, rng = AVATARS["lit_joints"](), np.random.default_rng(6)
    e, relight = avatar.embedding, avatar.relight
    assert e is not None and relight is not None
    world = homogeneous(matrix_from_rotvec(rng.normal(0, 1, 3)), rng.normal(0, 1, 3))
    light = replace(STUDIO, shadow=False)
    x = given(avatar, light, rng.uniform(-0.3, 0.3, (COUNT, 3)), 0.7, world)
    size = np.ptp(e.canonical_vertices, axis=0).max()
    posed = e.canonical_vertices + rng.normal(0, 0.1 * size, e.canonical_vertices.shape)
    x |= {"posed_vertices": posed.astype(np.float32), "world_from_avatar": world}
    lights = [("position" if one.point else "direction", one.place, one.colour) for one in light.lights]
    want = []
    for i, corners in enumerate(e.triangles[e.triangle]):
        posed_corners, canonical = (v[corners].tolist() for v in (x["posed_vertices"], e.canonical_vertices))
        own = e.local_quat_wxyz[i].tolist(), relight.normal[i].tolist()
        n = oracle.turned_by_triangle(posed_corners, canonical, *own, world[:3, :3].tolist())
        lit = (light.ambient.tolist(), lights, relight.ambient.tolist(), world[:3, :3].tolist())
        want.append(oracle.light(x["rgb"][i].tolist(), x["mean"][i].tolist(), [1, 0, 0, 0], n, *lit))
    with played(avatar, backend) as own_backend:
        got = own_backend.stage("light", x, None, "engine")["rgb"]
    np.testing.assert_allclose(got, want, rtol=1e-5, atol=2e-5)


@pytest.mark.parametrize("backend", BACKENDS)
def test_a_white_sphere_shows_the_cosine(backend: str) -> None:
    """Lambert: what faces the light reflects its colour, what faces away is black."""
    avatar, towards = white(around()), np.array([0.48, 0.6, -0.64])
    light = Light(DARK, (DirectLight(tuple(3 * towards), (0.9, 0.5, 0.001)),))
    with played(avatar, backend) as own:
        got = own.stage("light", given(avatar, light, around()), None, "engine")["rgb"]
    want = np.maximum(around() @ towards, 0)[:, None] * [0.9, 0.5, 0.001]
    np.testing.assert_allclose(linear(got), want, atol=2e-6)
    assert (want == 0).any() and (want[:, 2] > 0).any()


@pytest.mark.parametrize("backend", BACKENDS)
def test_a_lamp_falls_with_the_square_of_the_distance(backend: str) -> None:
    avatar = white(np.tile([0.0, 0, 1], (COUNT, 1)))
    light = Light(DARK, (DirectLight((0.0, 0.0, 2.0), (0.25, 0.25, 0.25), point=True),))
    away = np.geomspace(0.001, 4, COUNT)
    with played(avatar, backend) as own:
        x = given(avatar, light, np.stack([0 * away, 0 * away, 2 - away], axis=1))
        got = own.stage("light", x, None, "engine")["rgb"]
    np.testing.assert_allclose(
        linear(got[:, 0]), 0.25 / np.maximum(away, 0.01) ** 2, rtol=1e-3
    )  # 2 - away rounds
    assert (away < 0.01).any()


def test_ambient_rows_of_a_directional_light_are_its_projection() -> None:
    """sum_k Y_k(n) a_k is the projection of max(n.l, 0): integrals over the sphere, by quadrature."""
    towards = np.array([0.6, -0.48, 0.64])
    z, weight = np.polynomial.legendre.leggauss(400)
    angle = 2 * np.pi * np.arange(800) / 800
    ring = np.sqrt(1 - z * z)[:, None]
    n = np.stack(
        [ring * np.cos(angle), ring * np.sin(angle), np.broadcast_to(z[:, None], (400, 800))], axis=-1
    )
    basis = np.array(np.broadcast_arrays(*oracle.basis(np.moveaxis(n, -1, 0))))
    facing = np.maximum(n @ towards, 0) * weight[:, None] * 2 * np.pi / 800
    want = np.sum(basis * facing, axis=(1, 2))
    got = ambient_of(Light(DARK, (DirectLight(tuple(5 * towards), (1.0, 2.0, 0.0)),)))
    np.testing.assert_allclose(got, np.outer(want, [1, 2, 0]), atol=2e-5)


@pytest.mark.parametrize("backend", BACKENDS)
def test_the_light_of_the_capture_changes_no_bit(backend: str) -> None:
    """Where the captured light stays in the world; where it moves along, if it is the same from all sides."""
    for name, uneven in (("lit_world", 0.4), ("lit_head", 0)):
        avatar = AVATARS[name]()
        pose = cases_of(name, avatar)[-1].pose
        assert avatar.relight is not None
        rows = avatar.relight.ambient * np.float32([[1], *[[uneven]] * 8])  # nowhere below the floor
        avatar = replace(avatar, relight=replace(avatar.relight, ambient=rows))
        camera = Camera.orbit(np.zeros(3), 0.35, 0.4, 0.2, 0.7, 64, 48)
        with Player(avatar, backend) as player:
            plain = player.frame(pose, camera)
            assert not {"shadow", "light"} & set(plain.milliseconds)
            player.light = Light(rows)
            lit = player.frame(pose, camera).image
            player.light = Light(rows, (STUDIO.lights[0],))
            assert (player.frame(pose, camera).image.colour != plain.image.colour).any()
            player.light = None
            again = player.frame(pose, camera).image
        assert np.array_equal(lit.colour, plain.image.colour), name
        assert np.array_equal(again.colour, plain.image.colour), name


@pytest.mark.parametrize("backend", BACKENDS)
def test_a_splat_casts_its_shadow_where_geometry_says(backend: str) -> None:
    """A ball before a screen, seen from a sun and from a lamp: the edge of its shadow, to a texel or two."""
    screen = np.linspace(0, 0.3, COUNT - 1)
    avatar = white(np.tile([0.0, 0, 1], (COUNT, 1)))
    reach = 0.04 * np.sqrt(2 * np.log(0.9 / 0.3))  # where the alpha of the ball is 0.3
    for light, magnified in (
        (DirectLight((0.0, 0.0, 7.0), (1.0, 1.0, 1.0)), 1.0),
        (DirectLight((0.0, 0.0, 1.5), (1.0, 1.0, 1.0), point=True), 1.5 / (1.5 - 0.5)),
    ):
        mean = np.zeros((COUNT, 3))
        mean[0] = (0.1, 0.1 / magnified, 0.5)
        mean[1:, 0], mean[1:, 1] = screen, 0.1
        mean[0, 0] = 0.1 / magnified
        x = given(avatar, Light(DARK, (light,), shadow=True), mean)
        x["scale"][0], x["scale"][1:] = 0.04, 1e-4
        x["opacity"][1:] = 0.2  # the screen itself casts none
        with played(avatar, backend) as own:
            shadow = own.stage("shadow", x, None, "engine")["shadow"]
            got = own.stage("light", {**x, "shadow": shadow}, None, "engine")["rgb"][1:, 0]
        off, texel = np.abs(screen - 0.1) - reach * magnified, 2 * magnified * 2 / SHADOW_SIZE
        assert (got[off < -2.5 * texel] == 0).all() and (off < -2.5 * texel).sum() > 5
        assert (got[off > 2.5 * texel] > 0.3).all()


@pytest.mark.parametrize("backend", BACKENDS)
def test_a_shadow_map_is_what_its_light_sees(backend: str) -> None:
    """From +Z: columns run along +X, rows along -Y, distances begin before the sphere that is lit."""
    avatar = white(around())
    mean, sun = np.zeros((COUNT, 3)), DirectLight((0.0, 0.0, 1.0), (1.0, 1.0, 1.0))
    mean[0], mean[1] = (0.5, 0.25, 0.3), (0.5, 0.25, -0.3)
    x = given(avatar, Light(DARK, (sun,), shadow=True), mean)
    x["opacity"][2:] = 0.2
    with played(avatar, backend) as own:
        found = own.stage("shadow", x, None, "engine")["shadow"].reshape(SHADOW_SIZE, SHADOW_SIZE)
    row, column = np.nonzero(found < FAR)
    assert abs(column.mean() - (127.5 + 0.5 * 128)) < 0.5 and abs(row.mean() - (127.5 - 0.25 * 128)) < 0.5
    np.testing.assert_allclose(found[row, column], 1 - 0.3, atol=1e-6)
    # alpha is 0.3 at a circle of 0.01 sqrt(2 ln 3) m: 1.9 texels, and the low-pass of a quarter of a texel squared
    radius = np.sqrt(2 * np.log(0.9 / 0.3) * (1.28**2 + 0.25))
    assert len(row) == pytest.approx(np.pi * radius**2, rel=0.2)


def test_a_triangle_casts_the_shadow_of_its_plane() -> None:
    """Its three sides and its plane, in float64; one turned away from the light casts as well."""
    avatar, sun = white(around()), DirectLight((0.0, 0.0, 1.0), (1.0, 1.0, 1.0))
    x = given(avatar, Light(DARK, (sun,), shadow=True), around())
    lit = LightArrays.of(x)
    corners = np.array([[0.1, -0.05, 0.2], [0.3, 0.05, -0.1], [0.15, 0.13, 0.4]])
    clear = Splats(*(x[name] for name in ("mean", "scale", "quat_wxyz")), 0 * x["opacity"], x["rgb"][:, None])
    at = (np.arange(SHADOW_SIZE) - 127.5) / 128
    points = np.stack([*np.meshgrid(at, -at), np.ones((SHADOW_SIZE, SHADOW_SIZE))], axis=-1)
    weights = points @ np.linalg.inv(np.column_stack([corners[:, :2], np.ones(3)]))
    inside, edge = weights.min(axis=-1) >= 0, np.abs(weights).min(axis=-1) < 1e-4
    for order in ([0, 1, 2], [2, 1, 0]):
        found = shadow_map(clear, lit, (corners.astype(np.float32), np.array([order], np.uint32)))
        assert ((found < FAR) == inside)[~edge].all() and inside.sum() > 100
        np.testing.assert_allclose(
            found[inside & ~edge], (1 - weights @ corners[:, 2])[inside & ~edge], atol=1e-5
        )


def test_a_mirrored_avatar_in_the_mirrored_light_has_the_same_colours() -> None:
    for name in ("lit_head", "lit_world", "lit_joints"):
        avatar = AVATARS[name]()
        for case in cases_of(name, avatar):
            if case.light is not None:
                right = seen(avatar, case.pose, case.camera, case.light)
                left_light = mirrored_light(case.light)
                left = seen(mirrored(avatar), mirrored_pose(case.pose), case.camera.mirrored(), left_light)
                np.testing.assert_allclose(left, right, atol=2e-5)
                assert mirrored_light(left_light).lights == case.light.lights


def test_light_that_turns_with_the_avatar_changes_nothing() -> None:
    """Of an avatar that carries the light of its capture; of one that leaves it in the world it does."""
    turn = matrix_from_rotvec(np.array([0.4, -1.1, 0.7]))
    for name, same in (("lit_head", True), ("lit_world", False), ("lit_joints", True)):
        avatar = AVATARS[name]()
        case = cases_of(name, avatar)[-1]
        sun = (0.3, 0.5, 0.8)

        def colours(
            rotation: Array, avatar: Avatar = avatar, pose: Pose = case.pose, sun: Any = sun
        ) -> Array:
            world = homogeneous(rotation, np.zeros(3))
            to_sun = tuple((rotation @ sun).tolist())
            light = Light(even((0.2, 0.3, 0.4)), (DirectLight(to_sun, (0.9, 0.8, 0.7)),))
            orbit = Camera.orbit(np.zeros(3), 0.4, 0.4, 0.2, 0.9, 64, 48)
            view = orbit.camera_from_world[:3, :3].astype(np.float64) @ rotation.T
            k = np.array([[60.0, 0, 32], [0, 60, 24], [0, 0, 1]])
            camera = Camera.from_opencv(view, orbit.camera_from_world[:3, 3], k, 64, 48)
            return seen(
                avatar, replace(pose, world_from_avatar=world @ pose.world_from_avatar), camera, light
            )

        assert (np.abs(colours(turn) - colours(np.eye(3))).max() < 1e-5) == same, name


def test_the_light_of_the_capture_turns_with_the_head() -> None:
    avatar = AVATARS["lit_head"]()
    posed = Player(avatar, "reference", light=STUDIO).posed(cases_of("lit_head", avatar)[-1].pose)
    assert avatar.rig is not None and posed.light is not None
    head = posed.skin_matrix[avatar.rig.joint_names.index("neck"), :3, :3]
    np.testing.assert_allclose(posed.light.turn[:, :3].T, posed.world_from_avatar[:3, :3] @ head, atol=1e-6)
    assert np.abs(head - np.eye(3)).max() > 0.1 and (posed.light.turn[:, 3] == 0).all()


@pytest.mark.parametrize(
    ("ambient", "one", "error"),
    [
        (np.full((9, 3), 2e9), DirectLight((0, 0, 1), (1, 1, 1)), "ambient has a number beyond 1e[+]09"),
        (np.ones(3), DirectLight((0, 0, 1), (1, 1, 1)), "ambient has shape"),
        (even((1, 1, 1)), DirectLight((1e-200, 0, 0), (1, 1, 1)), "a direction needs a length"),
        (even((1, 1, 1)), DirectLight((0, 0, 1), (1, -1, 1)), "colour is"),
        (even((1, 1, 1)), {"direction": [0, 0, 1]}, "a DirectLight is needed"),
        (even((1, 1, 1)), DirectLight(("x", 0, 1), (1, 1, 1)), "place is"),
    ],
)
def test_what_is_no_light(ambient: Any, one: Any, error: str) -> None:
    with pytest.raises((TypeError, ValueError), match=error):
        Light(ambient, (one,))


def seen(avatar: Avatar, pose: Pose, camera: Camera, light: Light) -> Array:
    """[N, 3] colours after stage light."""
    posed = Player(avatar, "reference", light=light).posed(pose)
    return ReferenceBackend(avatar).seen(posed, camera, Clock()).rgb
