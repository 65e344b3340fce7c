"""A mirrored avatar plays the mirror image: means, covariances, colours and images, for every rule."""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from avatar_runtime.avatar import Avatar, Rules
from avatar_runtime.camera import Camera
from avatar_runtime.checks.avatar import check_avatar
from avatar_runtime.clips import frame_pose
from avatar_runtime.handedness import SH_IN_X, SH_IN_Y, mirrored
from avatar_runtime.player import Player
from avatar_runtime.pose import Pose
from avatar_runtime.stages.activate import Splats
from avatar_runtime.stages.project import sh_colour
from avatar_runtime.stages.raster import PROFILES
from tests.avatars import assert_same, bits, full_avatar, leaves, surface_avatar
from tests.measured import Measure
from tests.oracles import rotation_sh
from tests.oracles.lbs import rodrigues

Array = npt.NDArray[Any]
S = np.diag([-1.0, 1.0, 1.0])
IN_TRIANGLES = Rules("triangle_frame", position="triangle_frame", scale="triangle_linear")
ON_NORMALS = Rules("vertex_quaternion", scale="log_area")
BY_PAPER = Rules("vertex_quaternion_mean", position="interpolated_normal", scale="linear_area")
SURFACES = {
    "on normals": ON_NORMALS,
    "on normals, seen in the world": replace(ON_NORMALS, sh_direction="world"),
    "on normals, largest_positive": replace(ON_NORMALS, quaternion_sign="largest_positive", scale="none"),
    "on normals, by the paper": BY_PAPER,
    "on normals, by the paper, largest_positive": replace(BY_PAPER, quaternion_sign="largest_positive"),
    "in triangles": IN_TRIANGLES,
    "in triangles, seen in the world": replace(IN_TRIANGLES, sh_direction="world"),
}
BY_JOINTS = Rules("bary_vertex_lbs", position="interpolated_normal")
RIGGED = {"by joints": BY_JOINTS, "by joints, seen in the world": replace(BY_JOINTS, sh_direction="world")}
AVATARS: dict[str, Callable[[], Avatar]] = {
    "polar3": full_avatar,
    "head_bone": lambda: replace(full_avatar(), rules=Rules("head_bone", "jaw", anchor="repeats")),
    "none": lambda: replace(full_avatar(), rules=Rules("none", sh_direction="world")),
    **{name: lambda rules=rules: surface_avatar(rules=rules) for name, rules in (SURFACES | RIGGED).items()},
    **{
        f"{name}, no rig": lambda rules=rules: surface_avatar(rules=rules, rigged=False)
        for name, rules in SURFACES.items()
    },
}
SPEC = (Path(__file__).parents[2] / "schema" / "SPEC.md").read_text("utf-8").split("## 15.")[1]


def made(name: str) -> Avatar:
    """That avatar, with all stored SH coefficients in use."""
    avatar = AVATARS[name]()
    return replace(avatar, sh_degree=avatar.gaussians.sh_degree)


def affine(rng: np.random.Generator, turn: float, move: float) -> Array:
    m = np.eye(4)
    m[:3, :3], m[:3, 3] = rodrigues(rng.normal(0, turn, 3)), rng.normal(0, move, 3)
    return m


def poses(avatar: Avatar) -> list[tuple[Pose, Pose]]:
    """(pose, the same in the other frame): far turns, every weight, and where the avatar has clips a frame."""
    found = []
    for seed in range(3):
        rng = np.random.default_rng(seed)
        weights = {name: float(rng.normal()) for name in avatar.expression_names}
        lids = {name: float(rng.uniform()) for name in avatar.eyelids}
        joints = {n: affine(rng, 1.0, 0.01) for n in (avatar.rig.joint_names if avatar.rig else ())}
        world, s = affine(rng, 1.0, 0.1), np.diag([-1.0, 1, 1, 1])
        other = {name: s @ delta @ s for name, delta in joints.items()}
        found.append((Pose(weights, joints, lids, world), Pose(weights, other, lids, s @ world @ s)))
    other_avatar = mirrored(avatar)
    for clip, other_clip in zip(avatar.clips, other_avatar.clips, strict=True):
        found.append((frame_pose(avatar, clip, 2), frame_pose(other_avatar, other_clip, 2)))
    return found


def posed_meshes(avatar: Avatar) -> list[dict[str, Array]]:
    """For an avatar on a mesh without a rig, meshes whose vertices turned far; else nothing."""
    if avatar.embedding is None or avatar.rig is not None:
        return [{}] * len(poses(avatar))
    meshes = []
    for seed in range(3):
        rng = np.random.default_rng(seed)
        v = avatar.embedding.canonical_vertices.astype(np.float64)
        turned = v @ rodrigues(np.array([0.2, [1.7, -1.9, 0.4][seed], 0.3])).T + rng.normal(0, 0.02, v.shape)
        meshes.append({"posed_vertices": turned.astype(np.float32)})
    return meshes


def sigma(splats: Splats) -> Array:
    """Covariances [N, 3, 3], through axis and angle, float64."""
    result = []
    for q, scale in zip(splats.quat_wxyz.astype(np.float64), splats.scale.astype(np.float64), strict=True):
        length = float(np.linalg.norm(q[1:]))
        r = rodrigues(2 * math.atan2(length, q[0]) * q[1:] / length)
        result.append(r @ np.diag(scale**2) @ r.T)
    return np.array(result)


def colours(splats: Splats, eye: Array, degree: int) -> Array:
    """By the harmonics' definition, seen from `eye` along sh_rotation^T d."""
    assert splats.sh_rotation is not None
    d = splats.mean - eye
    seen = np.einsum("nji,nj->ni", splats.sh_rotation, d / np.linalg.norm(d, axis=1, keepdims=True))
    return rotation_sh.evaluate(splats.sh, seen / np.linalg.norm(seen, axis=1, keepdims=True), degree)


@pytest.mark.parametrize("name", AVATARS)
def test_the_mirrored_avatar_plays_the_mirror_image(name: str, measured: Measure) -> None:
    avatar = made(name)
    player, other = Player(avatar, "reference"), Player(check_avatar(mirrored(avatar)), "reference")
    for (pose, other_pose), mesh in zip(poses(avatar), posed_meshes(avatar), strict=True):
        other_mesh = {key: (v * [-1, 1, 1]).astype(np.float32) for key, v in mesh.items()}
        found, want = (other.animate(other_pose, None, **other_mesh), player.animate(pose, None, **mesh))
        away = float(np.abs(found.mean - want.mean @ S).max())
        covariance = sigma(want)
        spread = float(np.abs(sigma(found) - S @ covariance @ S).max() / np.abs(covariance).max())
        np.testing.assert_array_equal(found.opacity, want.opacity)
        eye = np.array([0.3, -0.2, 0.6])
        seen = colours(found, S @ eye, avatar.sh_degree) - colours(want, eye, avatar.sh_degree)
        measured("mirrored means apart m", away)
        measured("mirrored covariances apart, of the largest", spread)
        measured("mirrored colours apart", float(np.abs(seen).max()))
        assert away <= 1e-6 and spread <= 1e-6 and np.abs(seen).max() <= 1e-6


@pytest.mark.parametrize("name", AVATARS)
def test_the_mirrored_camera_sees_the_same_image(name: str, measured: Measure) -> None:
    avatar = made(name)
    player, other = Player(avatar, "reference"), Player(mirrored(avatar), "reference")
    (pose, other_pose), mesh = poses(avatar)[0], posed_meshes(avatar)[0]
    other_mesh = {key: (v * [-1, 1, 1]).astype(np.float32) for key, v in mesh.items()}
    target = player.animate(pose, None, **mesh).mean.mean(axis=0)
    camera = Camera.orbit(target, 0.6, 0.4, 0.2, 0.6, 40, 32)
    for profile in PROFILES:
        found = other.frame(other_pose, camera.mirrored(), None, profile, **other_mesh).image.colour
        want = player.frame(pose, camera, None, profile, **mesh).image.colour
        assert want.std() > 0.05, "nothing is seen"
        measured("mirrored images apart", float(np.abs(found - want).max()))
        np.testing.assert_allclose(found, want, atol=1e-6)


@pytest.mark.parametrize("name", [*AVATARS, "largest_positive_mirrored"])
def test_twice_gives_every_bit_back(name: str) -> None:
    avatar = mirrored(made("on normals, largest_positive")) if name not in AVATARS else made(name)
    assert_same(mirrored(mirrored(avatar)), avatar)


CHANGED = {
    "full": {
        *(".gaussians.mean", ".gaussians.quat_wxyz", ".gaussians.sh"),
        *(f".blendshapes.geometry.values.{part}" for part in ("mean", "quat_wxyz")),
        ".blendshapes.appearance.values.sh",
        *(f".blendshapes.{part}.values.mean" for part in ("correctives", "late_morphs")),
        *(f".rig.{part}.values.position" for part in ("morphs", "correctives", "late_morphs")),
        *(f".rig.{part}" for part in ("vertices", "rest_local", "inverse_bind_matrix", "joint_basis")),
        *(".driving.matrix", ".driving.head_pivot[0]", ".rules.quaternion_sign"),
        *(f".clips[{i}].{part}" for i in range(2) for part in ("joint_delta", "world_from_avatar")),
    },
    "embedding": {
        f".embedding.{part}"
        for part in ("canonical_vertices", "displacement", "local_offset", "local_quat_wxyz")
    },
}


def test_what_is_mirrored_and_what_stays() -> None:
    """Names, indices, weights, scales and opacities keep their bits; all else changes some."""
    avatar = full_avatar()
    before, after = leaves(avatar), leaves(mirrored(avatar))
    assert {path for path in before if bits(before[path]) != bits(after[path])} == CHANGED["full"]
    changed = set()
    for rules in (ON_NORMALS, IN_TRIANGLES):
        surface = surface_avatar(rules=rules)
        before, after = leaves(surface), leaves(mirrored(surface))
        changed |= {path for path in before if bits(before[path]) != bits(after[path])}
    assert {path for path in changed if path.startswith(".embedding")} == CHANGED["embedding"]


@pytest.mark.parametrize("axis", ["x", "y"])
def test_signs_of_the_harmonics(axis: str) -> None:
    """By their definition, by the runtime's polynomials and in the table of SPEC.md."""
    rng = np.random.default_rng(0)
    d = rng.normal(size=(20, 3))
    d /= np.linalg.norm(d, axis=1, keepdims=True)
    mirror = np.array([-1, 1, 1] if axis == "x" else [1, -1, 1])
    signs = SH_IN_X if axis == "x" else SH_IN_Y
    y = rotation_sh.basis(d, 3)
    np.testing.assert_allclose(rotation_sh.basis(d * mirror, 3), y * signs, atol=1e-12)
    sh = rng.normal(size=(20, 16, 3)).astype(np.float32)
    there = sh_colour(sh * signs[:, None], (d * mirror).astype(np.float32), 3)
    np.testing.assert_allclose(there, sh_colour(sh, d.astype(np.float32), 3), atol=1e-6)
    (row,) = re.findall(
        r"^\| sign \|(.*)\|$" if axis == "x" else r"^\| sign, .*?`inverse_rotation` \|(.*)\|$", SPEC, re.M
    )
    assert [cell.strip() for cell in row.split("|")] == ["+" if sign > 0 else "-" for sign in signs]


def test_a_mirrored_camera() -> None:
    camera = Camera.orbit(np.array([0.1, 0.2, 0.3]), 2.0, 0.5, 0.3, 0.7, 64, 48)
    other = camera.mirrored()
    assert leaves(other).keys() == leaves(camera).keys()
    for path, value in leaves(other.mirrored()).items():
        assert bits(value) == bits(leaves(camera)[path]), path
    assert np.linalg.det(other.camera_from_world[:3, :3]) == pytest.approx(-1, abs=1e-6)
    point = np.array([0.4, -0.3, 0.2, 1.0])
    for name in ("camera_from_world", "clip_from_world"):
        np.testing.assert_allclose(
            getattr(other, name) @ (point * [-1, 1, 1, 1]), getattr(camera, name) @ point, rtol=1e-6
        )
    np.testing.assert_allclose(other.camera_from_world @ [*other.centre, 1], [0, 0, 0, 1], atol=1e-6)
