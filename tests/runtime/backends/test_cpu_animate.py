"""Backend `cpu` up to activate: every rule against the reference, and against what the released code computed."""

from __future__ import annotations

import sys
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from avatar_runtime.avatar import Avatar, Rules
from avatar_runtime.backends import make_backend
from avatar_runtime.camera import Camera
from avatar_runtime.player import Player
from avatar_runtime.pose import Pose
from avatar_runtime.rotation import homogeneous, matrix_from_rotvec
from avatar_runtime.rules import (
    ANCHOR_RULES,
    QUATERNION_SIGNS,
    RIGGED_ROTATIONS,
    SH_DIRECTIONS,
    SKIN_ROTATIONS,
    SURFACE_RULES,
)
from avatar_runtime.stages.activate import Splats
from tests.avatars import full_avatar, surface_avatar
from tests.measured import Measure

Array = npt.NDArray[Any]
FIELDS = ("mean", "scale", "quat_wxyz", "opacity", "sh", "sh_rotation")
RELATIVE = 1e-5
CAMERA = Camera.orbit(np.zeros(3), 0.6, 0.3, 0.1, 0.5, 48, 40)
RULES = [
    Rules(rotation, "neck", direction, anchor)
    for rotation in SKIN_ROTATIONS
    for direction in SH_DIRECTIONS
    for anchor in ANCHOR_RULES
]
SURFACES = [
    (Rules(rotation, None, direction, position=position, scale=scale, quaternion_sign=sign), rigged)
    for rotation, position, scale in SURFACE_RULES
    for sign in QUATERNION_SIGNS
    for direction in SH_DIRECTIONS
    for rigged in ((True,) if rotation in RIGGED_ROTATIONS else (True, False))
]


def random_pose(avatar: Avatar, seed: int) -> Pose:
    """About half of the weights are 0, every joint turns and moves; every second pose is placed in the world."""
    rng = np.random.default_rng(seed)
    names = avatar.expression_names
    weights = np.where(rng.uniform(size=len(names)) < 0.5, 0, rng.uniform(-0.4, 1.2, len(names)))
    joints = avatar.rig.joint_names if avatar.rig else ()
    turns = {
        j: homogeneous(matrix_from_rotvec(rng.normal(0, 0.5, 3)), rng.normal(0, 0.01, 3)) for j in joints
    }
    lids = {name: float(rng.uniform(0, 1)) * (seed % 3 > 0) for name in avatar.eyelids}
    world = homogeneous(matrix_from_rotvec(rng.normal(0, 1, 3)), rng.normal(0, 0.1, 3))
    return Pose(dict(zip(names, weights, strict=True)), turns, lids, world if seed % 2 else np.eye(4))


def half_turned(avatar: Avatar, rng: np.random.Generator) -> Array:
    """The canonical mesh turned by about half a turn and crumpled: there the sign policies part. [V, 3]."""
    assert avatar.embedding is not None
    axis = rng.normal(0, 1, 3)
    turn = matrix_from_rotvec(np.pi * axis / np.linalg.norm(axis))
    canonical = avatar.embedding.canonical_vertices
    return canonical @ turn.T + rng.normal(0, 5e-3, canonical.shape)


def agree(got: Splats, want: Splats, measured: Measure) -> None:
    """Each array within RELATIVE of the largest value of its kind, of its own value for scales."""
    for name in FIELDS:
        a, b = getattr(got, name), getattr(want, name)
        assert a.dtype == np.float32 and a.shape == b.shape and a.flags.c_contiguous
        size = np.abs(b) if name == "scale" else np.abs(b).max()
        error = float((np.abs(a - b) / size).max())
        measured(f"cpu animate, {name}, relative", error, RELATIVE)
        assert error <= RELATIVE, name


@pytest.mark.parametrize("rules", RULES, ids=lambda r: f"{r.rotation}-{r.sh_direction}-{r.anchor}")
def test_skin_and_groups(rules: Rules, measured: Measure) -> None:
    avatar = replace(full_avatar(3), rules=rules)
    fast, slow = Player(avatar, "cpu", threads=1), Player(avatar, "reference")
    for seed in range(4):
        pose = random_pose(avatar, seed)
        agree(fast.animate(pose), slow.animate(pose), measured)


@pytest.mark.parametrize(
    ("rules", "rigged"),
    SURFACES,
    ids=[f"{r.rotation}-{r.scale}-{r.quaternion_sign}-{r.sh_direction}-{rigged}" for r, rigged in SURFACES],
)
def test_surfaces(rules: Rules, rigged: bool, measured: Measure) -> None:
    avatar = surface_avatar(2, rules, rigged=rigged)
    fast, slow = Player(avatar, "cpu", threads=1), Player(avatar, "reference")
    rng = np.random.default_rng(0)
    for seed in range(3):
        pose = random_pose(avatar, seed)
        agree(fast.animate(pose), slow.animate(pose), measured)
        vertices = half_turned(avatar, rng)
        got = fast.animate(pose, posed_vertices=vertices)
        agree(got, slow.animate(pose, posed_vertices=vertices), measured)


def test_scales_and_opacities_of_any_size(measured: Measure) -> None:
    """From the least normal float32 to the largest, and beyond, against float64."""
    avatar = full_avatar(0)
    n = avatar.gaussians.count
    rng = np.random.default_rng(0)
    for _ in range(50):
        log_scale = rng.uniform(-86.9, 88.7, (n, 3)).astype(np.float32)
        logit = rng.uniform(-86, 86, n).astype(np.float32)
        quats = np.ones((n, 4), np.float32)
        inputs = {"log_scale": log_scale, "quat_wxyz": quats, "opacity_logit": logit}
        got = make_backend("cpu", avatar).stage("activate", inputs, None, "trainer")
        want = {"scale": np.exp(log_scale.astype(float)), "opacity": 1 / (1 + np.exp(-logit.astype(float)))}
        for name, value in want.items():
            error = float((np.abs(got[name] - value) / value).max())
            measured(f"cpu activate, {name}, relative to float64", error, 1e-6)
            assert error <= 1e-6
    absurd = np.array([[88.8, np.inf, np.nan]], np.float32).repeat(n, 0)
    got = make_backend("cpu", avatar).stage("activate", inputs | {"log_scale": absurd}, None, "trainer")
    np.testing.assert_array_equal(got["scale"], np.array([[np.inf, np.inf, np.nan]]).repeat(n, 0))


@pytest.mark.parametrize("surface", [False, True])
def test_a_frame_keeps_nothing_of_the_one_before(surface: bool) -> None:
    """Frames reuse their arrays and skip what no expression moves; the image must not show it."""
    avatar = surface_avatar(1) if surface else full_avatar(5)
    player = Player(avatar, "cpu", threads=1)
    poses = [random_pose(avatar, 1), Pose(), random_pose(avatar, 2), Pose({avatar.expression_names[0]: 0.7})]
    for pose in poses:
        fresh = Player(avatar, "cpu", threads=1).frame(pose, CAMERA).image
        np.testing.assert_array_equal(player.frame(pose, CAMERA).image.colour, fresh.colour)


@pytest.mark.parametrize("surface", [False, True])
def test_one_player_for_three_threads(surface: bool) -> None:
    """Its arrays are its own: frames asked for at the same time must not be drawn from one another's."""
    avatar = surface_avatar(1) if surface else full_avatar(5)
    player, poses = Player(avatar, "cpu", threads=1), [random_pose(avatar, seed) for seed in range(30)]

    def played(first: int) -> list[tuple[Array, Array]]:
        turned = poses[first:] + poses[:first]
        return [(player.frame(p, CAMERA).image.colour, player.animate(p).mean) for p in turned]

    want = played(0)
    before = sys.getswitchinterval()
    sys.setswitchinterval(1e-5)
    try:
        with ThreadPoolExecutor(3) as pool:
            got = list(pool.map(played, range(3)))
    finally:
        sys.setswitchinterval(before)
    for k in range(3):
        for (colour, mean), (own_colour, own_mean) in zip(got[k], want[k:] + want[:k], strict=True):
            np.testing.assert_array_equal(colour, own_colour)
            np.testing.assert_array_equal(mean, own_mean)


@pytest.mark.parametrize("rules", [Rules(r[0], position=r[1], scale=r[2]) for r in SURFACE_RULES])
def test_absurd_meshes_raise_and_warn_nothing(rules: Rules) -> None:
    avatar = surface_avatar(0, rules)
    for value in (0.0, np.nan, np.inf, 3e38):
        vertices = np.full((20, 3), value, np.float32)
        Player(avatar, "cpu").animate(Pose(), posed_vertices=vertices)
        Player(avatar, "cpu").frame(Pose(), CAMERA, posed_vertices=vertices)
