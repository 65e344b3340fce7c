"""The head as an animatable avatar in LAM's exported layout: one Gaussian on each vertex of a rigged glb."""

from __future__ import annotations

import json
import zipfile
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from avatar_runtime.rotation import matrix_from_rotvec, quat_from_matrix
from avatar_trainer.head import Head, neck_height, part_of, smoothstep, unit
from samples.subjects.colour import logit, surface_colour, surface_opacity
from samples.subjects.glb import Clip, Node, save_animation_glb, save_skin_glb
from samples.subjects.head import turned_eyes
from samples.subjects.surface import vertex_samples
from samples.systems.ply import ply_bytes, splat_columns

Array = npt.NDArray[Any]

NAME = "head"
GROUND = np.array([0.0, 1.6, 0.0])  # height of the head of the standing avatar, metres
MAX_LOG_SCALE = float(np.log(0.01))
MAX_LOGIT = 6.9067
OPACITY_LOGIT = 5.0
WIDTH = 0.95  # deviation of a splat, in edge lengths
# As trained, joints do not turn a splat: a flat one would stand on edge when the head turns. Eyes stay flat.
THICKNESS, EYE_THICKNESS, THICKEST = 0.55, 0.12, 0.0016  # of the shorter edges; the most in metres
PARTS = (
    "face",
    "head",
    "mouth_socket",
    "upper_gums",
    "lower_gums",
    "upper_teeth",
    "lower_teeth",
    "left_eye",
    "right_eye",
)
OPENING = (
    "eyeBlinkLeft",
    "eyeBlinkRight",
    "jawOpen",
    "cheekPuff",
)  # shapes that splats of fixed size have to bridge
# Joint, its parent, rest position (metres above the ground) and rest rotation vector, both in the world.
SKELETON = (
    ("hip", -1, (0.0, 1.05, 0.0), (0.0, 0.0, 0.0)),
    ("chestUpper", 0, (0.0, 1.33, -0.03), (-0.12, 0.0, 0.0)),
    ("neckLower", 1, (0.0, 1.445, -0.02), (0.35, 0.0, 0.0)),
    ("neckUpper", 2, (0.0, 1.5, -0.01), (0.2, 0.04, 0.0)),
    ("head", 3, (0.0, 1.56, 0.0), (-0.05, 0.1, 0.15)),
)
CHEST, NECK_LOWER, NECK_UPPER, HEAD = 1, 2, 3, 4
ARMATURE_TURN, ARMATURE_SCALE = (np.pi / 2, 0.0, 0.0), 0.01


@dataclass(frozen=True)
class LamAvatar:
    """Arrays of the export, N vertices and Gaussians in the same order."""

    head: Head  # the mesh of the glb, in the world
    offset: Array  # [N, 3] from vertex to Gaussian, metres
    rgb: Array  # [N, 3], 0..1
    log_scale: Array  # [N, 3]
    quat_wxyz: Array  # [N, 4] unit
    opacity_logit: Array  # [N]
    joints: Array  # u8 [N, 4]
    weights: Array  # f32 [N, 4]


def restrict(head: Head) -> Head:
    """The parts a Gaussian is put on, with the hidden back of the eyeballs left out."""
    centre = head.vertices[head.triangles].mean(axis=1)
    kept = head.triangles_in(*PARTS)
    for eye, name in enumerate(("left_eye", "right_eye")):
        kept &= ~(head.triangles_in(name) & (unit(centre - head.eye_centres[eye])[:, 2] < -0.35))
    used, flat = np.unique(head.triangles[kept], return_inverse=True)
    return part_of(head, used, flat.reshape(-1, 3), head.part[kept])


def skin(vertices: Array) -> tuple[Array, Array]:
    """Four joints u8 [N, 4] and weights f32 [N, 4] of each vertex, by height across the neck; shoulders stay."""
    height = neck_height(vertices)
    joints = np.array([HEAD, NECK_UPPER, NECK_LOWER, CHEST], np.uint8)
    top = smoothstep(height, -0.15, -0.065)
    middle = smoothstep(height, -0.165, -0.07)
    low = smoothstep(height, -0.185, -0.09) * smoothstep(np.abs(vertices[:, 0]), 0.11, 0.05)
    below, rest = 1 - top, (1 - top) * (1 - middle)
    weights = np.stack([top, below * middle, rest * low, rest * (1 - low)], axis=1)
    return np.tile(joints, (len(vertices), 1)), weights.astype(np.float32)


def build_lam(head: Head, noise_seed: int | None = None) -> LamAvatar:
    """One Gaussian a vertex, a few millimetres above it. With `noise_seed` nothing is regular."""
    head = restrict(turned_eyes(head))
    samples = vertex_samples(head, OPENING)
    ball = head.in_part("left_eye", "right_eye")[:, None]
    thick = np.where(ball, EYE_THICKNESS, THICKNESS) * samples.spacing.min(axis=1, keepdims=True)
    sigma = np.c_[WIDTH * samples.spacing, np.minimum(thick, THICKEST)]
    ripple = np.sin(head.vertices[:, [1, 2, 0]] * 40)
    offset = np.where(ball, 0.0005, 0.003) * head.vertex_normals + np.where(ball, 0.0, 0.001) * ripple
    joints, weights = skin(head.vertices)
    n = len(head.vertices)
    opacity = logit(surface_opacity(head, samples), OPACITY_LOGIT)
    quat = quat_from_matrix(samples.frame)
    if noise_seed is not None:
        rng = np.random.default_rng(noise_seed)
        offset = offset + rng.normal(0, 0.004, (n, 3))
        sigma = sigma * np.exp(rng.normal(0, 0.5, (n, 3)))
        opacity = rng.normal(1, 4, n)
        quat = unit(rng.normal(size=(n, 4)))
        weights = weights + rng.uniform(0.01, 0.3, weights.shape).astype(np.float32)
        weights /= weights.sum(axis=1, keepdims=True)
    return LamAvatar(
        head=replace(head, vertices=head.vertices + GROUND - offset),
        offset=offset,
        rgb=surface_colour(head, samples),
        log_scale=np.minimum(np.log(np.maximum(sigma, 1e-12)), MAX_LOG_SCALE),
        quat_wxyz=quat,
        opacity_logit=np.clip(opacity, -MAX_LOGIT, MAX_LOGIT),
        joints=joints,
        weights=weights,
    )


def skeleton() -> list[Node]:
    """Armature and joints as local TRS; the armature turns and scales, as in Blender's exports."""
    world = [(matrix_from_rotvec(np.array(r)), np.array(p)) for _, _, p, r in SKELETON]
    armature = matrix_from_rotvec(np.array(ARMATURE_TURN)), np.zeros(3)
    scale = (ARMATURE_SCALE,) * 3
    nodes = [Node("Armature", -1, (0.0, 0.0, 0.0), quat_from_matrix(armature[0]), scale)]
    for k, (name, parent, _, _) in enumerate(SKELETON):
        rotation, position = armature if parent < 0 else world[parent]
        turn = quat_from_matrix(rotation.T @ world[k][0])
        shift = rotation.T @ (world[k][1] - position) / ARMATURE_SCALE
        nodes.append(Node(name, parent + 1, tuple(shift.tolist()), turn))
    return nodes


def clips() -> list[Clip]:
    """Two loops: a calm sway, and a nod. Rotation vectors [T, 3] of joints, in their own rest frames."""
    t = np.linspace(0, 4, 61)
    wave = 2 * np.pi * t / t[-1]
    still = np.zeros_like(t)
    idle = {
        "head": np.stack([0.03 * np.sin(wave), 0.06 * np.sin(wave + 1), 0.02 * np.sin(2 * wave)], axis=1),
        "neckUpper": np.stack([0.02 * np.sin(wave + 2), 0.03 * np.sin(wave), still], axis=1),
    }
    short = np.linspace(0, 1.5, 31)
    bow = np.sin(2 * np.pi * short / short[-1])
    nod = {
        "head": np.stack([0.22 * bow, 0 * bow, 0 * bow], axis=1),
        "neckLower": np.stack([0.08 * bow, 0 * bow, 0 * bow], axis=1),
    }
    return [Clip("idle", t, idle), Clip("nod", short, nod)]


def offset_ply(avatar: LamAvatar) -> bytes:
    """17 floats a Gaussian: x, y, z are the offset from the vertex, f_dc plain RGB."""
    return ply_bytes(
        splat_columns(avatar.offset, avatar.rgb, avatar.opacity_logit, avatar.log_scale, avatar.quat_wxyz)
    )


def save_lam(avatar: LamAvatar, path: Path) -> None:
    """The zip NAME/{offset.ply, skin.glb, animation.glb, vertex_order.json}."""
    path.parent.mkdir(parents=True, exist_ok=True)
    nodes = skeleton()
    # Real exports contain the order of another mesh, which scrambles the face if it is applied.
    order = np.random.default_rng(5).permutation(len(avatar.offset))
    files = {
        "offset.ply": offset_ply(avatar),
        "skin.glb": save_skin_glb(avatar.head, nodes, avatar.joints, avatar.weights),
        "animation.glb": save_animation_glb(nodes, clips()),
        "vertex_order.json": json.dumps(order.tolist()).encode(),
    }
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as zip_:
        zip_.writestr(zipfile.ZipInfo(f"{NAME}/"), b"")
        for name, data in files.items():
            info = zipfile.ZipInfo(f"{NAME}/{name}")
            info.compress_type = zipfile.ZIP_DEFLATED
            zip_.writestr(info, data)
