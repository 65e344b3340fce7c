"""The project's own conformance cases, as data: which avatar, which pose, which camera, and why.

`regenerate.py` makes their vectors, `test_conformance.py` runs them.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from avatar_runtime.avatar import Avatar
from avatar_runtime.camera import Camera
from avatar_runtime.conformance import Case
from avatar_runtime.light import DirectLight, Light, even
from avatar_runtime.pose import Pose
from avatar_runtime.rotation import homogeneous, matrix_from_rotvec

DATA = Path(__file__).parent / "data"
ROWS, PIXELS = 512, 384  # kept of every case


@dataclass(frozen=True)
class Row:
    """One case of one avatar. Yaw, pitch and field of view are radians, distances metres."""

    avatar: str  # a key of avatars.AVATARS
    name: str
    why: str
    seed: int | None = None  # of the pose; None: the avatar is not posed
    size: tuple[int, int] = (64, 48)
    orbit: tuple[float, float, float, float] = (
        0.35,
        0.4,
        0.2,
        0.7,
    )  # distance, yaw, pitch, vertical field of view
    background: tuple[float, float, float] = (0.1, 0.25, 0.4)
    joint_turn: tuple[float, float] | None = None  # radians, from and to, of every joint; None: about 0.6
    light: Light | None = None


ASIDE = (0.3, -0.9, -0.35, 0.9)
SUN, LAMP = (
    DirectLight((0.6, 1.1, 0.9), (1.4, 1.2, 1.0)),
    DirectLight((-0.3, 0.2, 0.4), (0.1, 0.2, 0.3), point=True),
)
BEHIND, BESIDE = (
    DirectLight((-0.3, 0.2, -1.0), (0.2, 0.1, 0.6)),
    DirectLight((0.4, -0.3, 0.0), (0.05, 0.01, 0.0), True),
)
SKY = np.random.default_rng(41).normal(0, 0.2, (9, 3)).astype(np.float32)
STUDIO = Light(SKY + even((0.5, 0.6, 0.7)), (SUN, LAMP, BEHIND, BESIDE), shadow=True)

CASES: tuple[Row, ...] = (
    Row("skin_polar", "rest", "the neutral pose: nothing moves, SH are still seen from the camera's side"),
    Row(
        "skin_polar",
        "posed",
        "late morphs unrotated, correctives, five joints a row, anchored and mixed mouth groups, rotations of "
        "covariance and SH, the whole turned: rotation about the origin, wxyz or xyzw, SH left behind",
        seed=1,
    ),
    Row("skin_polar", "aside", "another side, a picture that is no multiple of the tile", 2, (53, 37), ASIDE),
    Row("skin_head_bone", "posed", "one joint turns all Gaussians, their own weights move them", seed=3),
    Row(
        "skin_unturned", "posed", "covariance and SH stay as they are, positions do not", seed=4, orbit=ASIDE
    ),
    Row(
        "still",
        "posed",
        "blendshapes without a rig: negative weights, weights above 1, a weight of 0",
        seed=5,
    ),
    Row(
        "surface_area",
        "posed",
        "the ratio of areas multiplies the logarithm of the scale; displacement along the interpolated normal; "
        "vertex quaternions averaged without a check of hemispheres, w made positive",
        seed=6,
    ),
    Row("surface_area", "aside", "the same from another side", 7, (53, 37), ASIDE),
    Row(
        "surface_world", "posed", "SH seen along the world's direction; the largest component is positive", 8
    ),
    Row("surface_mirrored", "posed", "the sign policy of left-handed bundles", seed=9),
    *(
        Row(
            avatar,
            "turned",
            "joints turned by 120 to 179 degrees: each rule quaternion_sign gives another sum, and so does a check "
            "of hemispheres, which no trainer makes",
            seed=33,
            joint_turn=(2.1, 3.1),
        )
        for avatar in ("surface_area", "surface_world", "surface_mirrored")
    ),
    Row(
        "surface_paper",
        "posed",
        "SplattingAvatar as its paper has it: neither the interpolated normal nor the vertex quaternions made unit, "
        "the ratio of areas on the scale itself",
        seed=14,
    ),
    Row(
        "surface_joints",
        "posed",
        "PSAvatar: Gaussians turn by the polar factor of their corners' blended skin matrices, not by the mesh's shape",
        seed=15,
        joint_turn=(0.9, 1.4),
    ),
    Row(
        "surface_frame",
        "posed",
        "a triangle's own frame and edge scale, SH turned with it",
        seed=10,
        orbit=ASIDE,
    ),
    Row(
        "surface_fine",
        "posed",
        "vertex normals and quaternions divided by their floors, areas in training units",
        seed=13,
    ),
    *(
        Row(
            "surface_unbound",
            name,
            "a rig that does not rest in its binding pose (ASM): inverse bind matrices are not those of rest, joints "
            "turn in spaces that are stretched unevenly",
            seed=seed,
        )
        for name, seed in (("rest", None), ("posed", 22))
    ),
    Row("surface_unrigged", "placed", "no rig: only the whole moves", seed=11),
    Row(
        "edges",
        "thresholds",
        "alpha at 0.99 and at 1/255, ties by id, z against distance, splats thinner than a pixel, the near plane, "
        "the clamp of the Jacobian, colours below 0 and above 1, a quaternion without length",
        orbit=(1.0, 0.0, 0.0, 1.2),
    ),
    Row("edges", "blended", "the same with expressions on every row", 12, (72, 56), (1.0, 0.0, 0.0, 1.2)),
    Row("lit_head", "rest", "the light of the capture: colours as trained"),
    Row(
        "lit_head",
        "studio",
        "nine rows of ambient light, four lights, the first of which casts a shadow; the light of the capture turns "
        "with the head, normals turn with their Gaussians",
        seed=17,
        light=STUDIO,
    ),
    Row(
        "lit_head",
        "lamp",
        "one near lamp that casts a shadow, and no other light: dark colours, a shadow map in perspective",
        seed=18,
        orbit=ASIDE,
        light=Light(even((0.0, 0.0, 0.0)), (LAMP,), shadow=True),
    ),
    Row(
        "lit_world",
        "studio",
        "the light of the capture stays where it was when the avatar turns; no shadow",
        seed=19,
        light=replace(STUDIO, shadow=False),
    ),
    Row(
        "lit_joints",
        "studio",
        "joints turn the Gaussians, and triangles their normals",
        seed=20,
        light=replace(STUDIO, shadow=False),
    ),
)


def cases_of(name: str, avatar: Avatar) -> tuple[Case, ...]:
    """The cases of the avatar called `name`, which is `avatar`."""
    return tuple(_case(row, avatar) for row in CASES if row.avatar == name)


def _case(row: Row, avatar: Avatar) -> Case:
    distance, yaw, pitch, fov_y = row.orbit
    camera = Camera.orbit(np.zeros(3), distance, yaw, pitch, fov_y, *row.size)
    pose = Pose() if row.seed is None else _pose(avatar, row)
    return Case(row.name, row.why, pose, camera, row.background, light=row.light)


def _pose(avatar: Avatar, row: Row) -> Pose:
    """Every input in use: joints far from rest, one expression exactly 0, the whole turned and moved."""
    rng = np.random.default_rng(row.seed)
    weights = rng.uniform(-0.4, 1.3, len(avatar.expressions))
    weights[-1:] = 0
    return Pose(
        dict(zip(avatar.expression_names, _rounded(weights), strict=True)),
        dict(_joints(avatar, rng, row.joint_turn)),
        dict(zip(avatar.eyelids, _rounded(rng.uniform(0.3, 1, len(avatar.eyelids))), strict=True)),
        homogeneous(matrix_from_rotvec(rng.normal(0, 0.3, 3)), rng.normal(0, 0.01, 3)),
    )


def _joints(
    avatar: Avatar, rng: np.random.Generator, turn: tuple[float, float] | None
) -> Iterator[tuple[str, np.ndarray]]:
    for name in avatar.rig.joint_names if avatar.rig else ():
        rotvec = rng.normal(0, 0.35, 3)
        if turn is not None:
            rotvec *= rng.uniform(*turn) / np.linalg.norm(rotvec)
        yield name, homogeneous(matrix_from_rotvec(rotvec), rng.normal(0, 4e-3, 3))


def _rounded(weights: np.ndarray) -> list[float]:
    """Readable in cases.json."""
    return [float(w) for w in np.round(weights, 3)]
