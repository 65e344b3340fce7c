"""The walking man as LHM saves him: posed Gaussians in one .ply, on a body model of SMPL-X's layout."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from avatar_runtime.rotation import quat_from_matrix
from avatar_trainer.head import Mesh
from samples.subjects.body import Body, node_matrices
from samples.subjects.surface import Samples, sample_mesh
from samples.systems.ply import ply_bytes, splat_columns
from samples.systems.splatting_body import shading

Array = npt.NDArray[Any]

IDENTITY, EXPRESSIONS = 10, 10
STATURE, GIRTH = 0.03, 0.02  # metres for one standard deviation of the first two identity directions
SMILE = 0.004  # metres that an expression moves the visor
WIDTH, THICKNESS = 0.75, 0.2  # deviation of a splat, in sample spacings
OPACITY_LOGIT, MOST_LOGIT = 5.0, 6.9067
OFF = 0.003  # metres of the suit from its mesh
SH_C0 = 0.28209479177387814
# Joint of SMPL-X, by number -> joint of CesiumMan that it stands at and whose weights it takes.
JOINTS = {
    0: 0, 1: 11, 2: 12, 3: 1, 4: 13, 5: 14, 7: 15, 8: 16, 9: 2, 10: 17, 11: 18, 12: 3, 15: 4, 16: 5, 17: 6,
    18: 7, 19: 8, 20: 9, 21: 10,
}  # fmt: skip
BODY_PARENTS = (-1, 0, 0, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 9, 9, 12, 13, 14, 16, 17, 18, 19, 15, 15, 15)
FINGER_PARENTS = (20, 25, 26, 20, 28, 29, 20, 31, 32, 20, 34, 35, 20, 37, 38)  # of the left hand
RIGHT = {20: 21}
PARENTS = BODY_PARENTS + FINGER_PARENTS + tuple(RIGHT.get(p, p + 15) for p in FINGER_PARENTS)


def body_model(body: Body) -> dict[str, Array]:
    """Arrays of SMPL-X's smaller file, 55 joints, of the man in his first step."""
    vertices = body.posed(0).vertices
    joints = joint_places(body)
    weights = np.zeros((len(vertices), len(PARENTS)))
    for joint, own in JOINTS.items():
        weights[:, joint] = body.weights[:, own]
    weights /= weights.sum(axis=1, keepdims=True)
    height = vertices[:, 1] - vertices[:, 1].min()
    middle = vertices - np.array([1.0, 0, 1.0]) * vertices.mean(axis=0)
    dirs = np.zeros((len(vertices), 3, IDENTITY + EXPRESSIONS))
    dirs[:, 1, 0] = STATURE * height
    dirs[:, [0, 2], 1] = GIRTH * middle[:, [0, 2]] / 0.3
    visor = weights[:, 15] * (middle[:, 2] > 0.05)
    for k in range(EXPRESSIONS):
        dirs[:, k % 3, IDENTITY + k] = SMILE * visor * np.sin(40 * vertices[:, 0] + k)
    return {
        "v_template": vertices.astype(np.float32),
        "f": body.triangles.astype(np.uint32),
        "shapedirs": dirs.astype(np.float32),
        "posedirs": np.zeros((len(vertices), 3, 9 * (len(PARENTS) - 1)), np.float32),
        "J_regressor": regressor(vertices, joints).astype(np.float32),
        "weights": weights.astype(np.float32),
        "kintree_table": np.array([PARENTS, range(len(PARENTS))]),
    }


def joint_places(body: Body) -> Array:
    """[55, 3] rest joints in the first step; those that the man lacks stand at their parents."""
    own = node_matrices(body.document, 0)[body.document.skins[0].joints][:, :3, 3]
    places = np.zeros((len(PARENTS), 3))
    for joint, parent in enumerate(PARENTS):
        places[joint] = own[JOINTS[joint]] if joint in JOINTS else places[parent]
    return places


def regressor(vertices: Array, joints: Array) -> Array:
    """[J, V] the smallest weights, with sum 1, by which vertices give the joints."""
    rows = np.concatenate([vertices, np.ones((len(vertices), 1))], axis=1)
    result: Array = np.c_[joints, np.ones(len(joints))] @ np.linalg.pinv(rows)
    return result


def save_lhm(body: Body, gaussians: int, folder: Path) -> None:
    """Write man.ply, betas.npy, and pretrained_models/ with the body model and the sampled points."""
    model = body_model(body)
    template = Mesh(model["v_template"].astype(np.float64), body.triangles)
    samples = sample_mesh(template, np.zeros(len(body.triangles), np.int64), np.ones(1), gaussians, seed=41)
    betas = np.zeros(IDENTITY)
    betas[:2] = 1.0, -0.5
    nearest = nearest_rows(samples.position, template.vertices)
    shaped = samples.position + (model["shapedirs"][:, :, :IDENTITY] @ betas)[nearest]
    colour = body.colour(samples.face, samples.bary)
    colour *= samples.interpolate(shading(template), body.triangles)[:, None]
    models = folder / "pretrained_models"
    for inside in ("human_model_files/smplx", "dense_sample_points"):
        (models / inside).mkdir(parents=True, exist_ok=True)
    (folder / "man.ply").write_bytes(splat_bytes(samples, shaped + OFF * samples.frame[:, :, 2], colour))
    points = dict(zip("xyz", samples.position.T, strict=True))
    (models / "dense_sample_points" / f"1_{gaussians}.ply").write_bytes(ply_bytes(points))
    np.savez(models / "human_model_files" / "smplx" / "SMPLX_NEUTRAL.npz", **model)
    np.save(folder / "betas.npy", betas)


def splat_bytes(samples: Samples, mean: Array, colour: Array) -> bytes:
    """The .ply of LHM: 3DGS without SH rest, opacities clamped to 0.001 .. 0.999."""
    n = len(mean)
    sigma = np.maximum(samples.spacing, 1e-4)[:, None] * np.array([WIDTH, WIDTH, THICKNESS])
    opacity = np.full(n, min(OPACITY_LOGIT, MOST_LOGIT))
    dc = (colour - 0.5) / SH_C0
    return ply_bytes(splat_columns(mean, dc, opacity, np.log(sigma), quat_from_matrix(samples.frame)))


def nearest_rows(points: Array, others: Array) -> Array:
    """The row of the nearest of `others` [M, 3] for each of `points` [N, 3]."""
    found = [
        np.argmin(((block[:, None] - others) ** 2).sum(axis=2), axis=1)
        for block in np.array_split(points, max(1, len(points) // 256))
    ]
    return np.concatenate(found)
