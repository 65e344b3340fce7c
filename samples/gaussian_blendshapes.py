"""A 3D Gaussian Blendshapes checkpoint of the head, in both layouts that the released code writes."""

from __future__ import annotations

import shutil
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from avatar_runtime.rotation import quat_from_matrix, quat_multiply
from samples.body_model import FEATURES, GAUSSIAN_SHAPES, JAW_SHAPES, BodyModel
from samples.containers import Chunks, Parameter, save_npy, save_npy_dict, save_torch
from samples.head import Head, smoothstep, unit
from samples.surface import Samples, deformation, sample_head

Array = npt.NDArray[Any]
Fields = dict[str, Array]

SH_C0, SH_C1 = 0.28209479177387814, 0.4886025119029199
ITERATION = 40000
CHUNK = 1024  # Gaussians made at a time
MOUTH_SHARE = 0.1  # Gaussians in each set of teeth, as a share of the face's, as the trainer has it

# Deviation and thickness of a splat, in sample spacings: wide enough that no hole shows, flat along the normal.
WIDTH, THICKNESS = 0.62, 0.07
OPACITY_LOGIT = 6.0
STRETCH = (-0.6, 0.75)
SHEEN = 0.09  # how much brighter skin looks face on than edge on

# The trainer's mask thresholds, metres (train.py: 0.1 * 0.000237277025008 and 0.005703532602638).
MASK_NONE, MASK_FULL = 0.1 * 0.000237277025008, 0.005703532602638

# Regions of the face set, and the spacing of their samples relative to each other.
REGION_SPACING = np.array([1.0, 0.72, 0.5, 1.35, 1.1, 0.6, 0.3])
SKIN, FEATURE, LID, BACK, SOCKET, EYE, IRIS = range(len(REGION_SPACING))
LID_REACH = 0.021  # metres from the centre of the eyeball

RAW_STATIC = ("xyz", "features_dc", "features_rest", "scaling", "rotation", "opacity")
LEARNED = {"xyz_b": (3,), "features_b": (16, 3), "scaling_b": (3,), "rotation_b": (4,), "opacity_b": (1,)}
INIT = {"init_rot": (4,), "init_sh": (16, 3), "init_xyz": (3,)}
# dump file -> (learned field, init field or None)
DELTAS = {
    "xyz_t": ("xyz_b", "init_xyz"),
    "shs_t": ("features_b", "init_sh"),
    "scale_t": ("scaling_b", None),
    "rot_t": ("rotation_b", "init_rot"),
    "opacity_t": ("opacity_b", None),
}
# The optimiser's groups: name, tensor, learning rate.
GROUPS = (
    ("xyz", "xyz", 0.00016),
    ("f_dc", "features_dc", 0.0025),
    ("f_rest", "features_rest", 0.000125),
    ("opacity", "opacity", 0.05),
    ("scaling", "scaling", 0.005),
    ("rotation", "rotation", 0.001),
    ("xyz_b", "xyz_b", 3.2e-07),
    ("f_b", "features_b", 0.00125),
    ("opacity_b", "opacity_b", 5e-05),
    ("scaling_b", "scaling_b", 0.0005),
    ("rotation_b", "rotation_b", 0.0001),
)


@dataclass(frozen=True)
class Model:
    """Everything a checkpoint is written from."""

    body: BodyModel
    samples: Samples
    face: Fields  # RAW_STATIC, pose [36, P, 3], eye [P, 3, 2], W [P, 5]; float32
    jaw_motion: dict[int, Array]  # column of a jaw shape -> its whole offsets [V, 3], joint and morph together
    mouth: tuple[Fields, Fields]  # RAW_STATIC of the upper and lower teeth
    noise_seed: int | None  # random learned values in every field, for conformance; None: what the mesh says

    @property
    def count(self) -> int:
        return len(self.samples.face)


def face_regions(head: Head) -> Array:
    """Region of each triangle for the face set, -1 for teeth, gums and the hidden back of the eyeballs."""
    centre = head.vertices[head.triangles].mean(axis=1)
    regions = np.full(len(centre), -1)
    regions[head.triangles_in("face")] = SKIN
    near = (np.abs(centre[:, 0]) < 0.055) & (centre[:, 1] > -0.075) & (centre[:, 1] < 0.075) & (centre[:, 2] > 0.055)
    regions[head.triangles_in("face") & near] = FEATURE
    regions[head.triangles_in("head")] = BACK
    regions[head.triangles_in("mouth_socket", "eye_sockets")] = SOCKET
    for eye, name in enumerate(("left_eye", "right_eye")):
        arm = centre - head.eye_centres[eye]
        regions[head.triangles_in("face") & (np.linalg.norm(arm, axis=1) < LID_REACH)] = LID
        axis = unit(arm)[:, 2]
        regions[head.triangles_in(name) & (axis > -0.35)] = EYE
        regions[head.triangles_in(name) & (axis > np.cos(np.radians(24)))] = IRIS
    return regions


def iris_colour(head: Head, samples: Samples, colour: Array) -> Array:
    """The colours with pupil, iris and white painted on the eyeballs by the angle from their axis."""
    colour = colour.copy()
    for eye, name in enumerate(("left_eye", "right_eye")):
        rows = np.flatnonzero(head.triangles_in(name)[samples.face])
        direction = unit(samples.position[rows] - head.eye_centres[eye])
        angle = np.degrees(np.arccos(np.clip(direction[:, 2], -1, 1)))[:, None]
        spoke = np.sin(23 * np.arctan2(direction[:, 1], direction[:, 0]))[:, None]
        iris = np.array([0.33, 0.45, 0.50]) * (1.0 + 0.12 * spoke)
        iris = iris + (np.array([0.10, 0.14, 0.17]) - iris) * smoothstep(angle, 15.0, 20.0)
        iris = iris + (np.array([0.02, 0.02, 0.025]) - iris) * smoothstep(angle, 8.5, 6.5)
        white = np.array([0.90, 0.87, 0.84]) + np.array([-0.10, -0.28, -0.28]) * smoothstep(angle, 35.0, 75.0)
        colour[rows] = iris + (white - iris) * smoothstep(angle, 18.5, 21.5)
    return colour


def depth_shade(head: Head, samples: Samples) -> Array:
    """Factor [N, 1] that darkens the inside of the mouth with its depth, as no light gets there."""
    inside = head.triangles_in("mouth_socket", "upper_gums", "lower_gums", "upper_teeth", "lower_teeth")
    depth = smoothstep(samples.position[:, 2], 0.035, 0.105)
    return np.where(inside[samples.face], 0.15 + 0.85 * depth, 1.0)[:, None]


def static_fields(head: Head, samples: Samples) -> Fields:
    """RAW_STATIC of splats that lie flat on the surface, coloured by the scan."""
    n = len(samples.face)
    colour = samples.interpolate(head.colors, head.triangles)
    colour = iris_colour(head, samples, colour) * depth_shade(head, samples)
    # A degree-1 lobe along the normal: seen along d, it adds -SHEEN * colour * (d . normal).
    x, y, z = samples.frame[:, :, 2].T
    lobe = np.stack([y, -z, x], axis=1)[:, :, None] * (SHEEN / SH_C1) * colour[:, None]
    rest = np.zeros((n, 15, 3))
    rest[:, :3] = lobe
    sigma = samples.spacing[:, None] * np.array([WIDTH, WIDTH, THICKNESS])
    fields = {
        "xyz": samples.position,
        "features_dc": ((colour * (1 - SHEEN) - 0.5) / SH_C0)[:, None],
        "features_rest": rest,
        "scaling": np.log(sigma),
        "rotation": quat_from_matrix(samples.frame),
        "opacity": np.full((n, 1), OPACITY_LOGIT),
    }
    return {name: a.astype(np.float32) for name, a in fields.items()}


def rigged_fields(body: BodyModel, samples: Samples) -> Fields:
    """Pose shapes [36, P, 3] (the sum over the triangle's vertices, as trained), eyelids [P, 3, 2], weights [P, 5]."""
    triangles = body.faces
    pose = body.posedirs[triangles[samples.face]].sum(axis=1)
    lids = np.stack([samples.interpolate(lid, triangles) for lid in (body.l_eyelid, body.r_eyelid)], axis=-1)
    weights = samples.interpolate(body.lbs_weights.astype(np.float64), triangles)
    fields = {"pose": np.moveaxis(pose, -1, 0), "eye": lids, "W": weights / weights.sum(axis=1, keepdims=True)}
    return {name: np.ascontiguousarray(a, np.float32) for name, a in fields.items()}


def build_model(head: Head, body: BodyModel, gaussians: int, seed: int = 1) -> Model:
    """A checkpoint of `gaussians` splats in the face set and a tenth of that in each set of teeth."""
    samples = sample_head(head, face_regions(head), REGION_SPACING, gaussians, seed)
    mouth = []
    for k, parts in enumerate((("upper_teeth", "upper_gums"), ("lower_teeth", "lower_gums"))):
        regions = np.where(head.triangles_in(*parts), 0, -1)
        inside = sample_head(head, regions, np.ones(1), max(1, round(gaussians * MOUTH_SHARE)), seed + 1 + k)
        mouth.append(static_fields(head, inside))
    face = static_fields(head, samples) | rigged_fields(body, samples)
    columns = body.expression_names[:GAUSSIAN_SHAPES]
    jaw_motion = {columns.index(n): head.expression(n) for n in JAW_SHAPES if n in columns}
    return Model(body, samples, face, jaw_motion, (mouth[0], mouth[1]), None)


def moved_rows(model: Model, rows: slice) -> Fields:
    """The fields with one column for each expression, of some Gaussians; float32.

    Init terms are how the triangle carries the Gaussian. The mask follows how far the triangle moves. The
    learned scale is how the triangle stretches, for jaw shapes with the joint's turn; other learned values are zero.
    """
    face = model.samples.face[rows]
    corner = model.body.faces[face]
    before = model.body.v_template[corner].astype(np.float64)
    position = model.face["xyz"][rows].astype(np.float64)
    rotation = model.face["rotation"][rows].astype(np.float64)
    frame = model.samples.frame[rows]
    n, k = len(face), GAUSSIAN_SHAPES
    out = {name: np.zeros((n, *shape, k), np.float32) for name, shape in (LEARNED | INIT).items()}
    offsets = model.body.shapedirs_expression[corner, :, :k].astype(np.float64)
    out["mask"] = np.maximum(
        (np.linalg.norm(offsets.mean(axis=1), axis=1) - MASK_NONE) / (MASK_FULL - MASK_NONE), 0
    ).astype(np.float32)
    row, shape = np.nonzero(np.any(offsets != 0, axis=(1, 2)))
    after = before[row] + offsets[row, :, :, shape]
    shift, turn, gradient = deformation(before[row], after, position[row])
    out["init_xyz"][row, :, shape] = shift
    out["init_rot"][row, :, shape] = quat_multiply(turn - (1, 0, 0, 0), rotation[row])
    stretch = log_stretch(gradient, frame[row])
    for j, full in model.jaw_motion.items():
        jaw = shape == j
        _, _, gradient = deformation(before[row[jaw]], before[row[jaw]] + full[corner[row[jaw]]], position[row[jaw]])
        stretch[jaw] = log_stretch(gradient, frame[row[jaw]])
    mask = out["mask"][row, shape][:, None].astype(np.float64)
    out["scaling_b"][row, :2, shape] = stretch / np.where(mask > 0, mask, np.inf)
    return out


def log_stretch(gradient: Array, frame: Array) -> Array:
    """How much longer the two tangents of a splat grow [N, 2], natural logarithm, kept within STRETCH."""
    length = np.linalg.norm(gradient @ frame[:, :, :2], axis=1)
    result: Array = np.clip(np.log(np.maximum(length, 1e-3)), *STRETCH)
    return result


def fold(raw: Fields) -> Fields:
    """The dump's deltas: init + mask * learned in float32, in the trainer's order."""
    deltas: Fields = {}
    for name, (learned, init) in DELTAS.items():
        mask = raw["mask"].reshape(len(raw["mask"]), *[1] * (raw[learned].ndim - 2), -1)
        product = mask * raw[learned]
        deltas[name] = product if init is None else raw[init] + product
    return deltas


def chunks(model: Model) -> Iterator[tuple[slice, Fields]]:
    """The moved fields, CHUNK Gaussians at a time."""
    for first in range(0, model.count, CHUNK):
        rows = slice(first, min(first + CHUNK, model.count))
        yield rows, moved_rows(model, rows)


def save_dump(model: Model, folder: Path) -> None:
    """The folders that test.py writes for the viewer."""
    face = model.face
    out = folder / f"fix_chkpnt{ITERATION}"
    save_static(face, out)
    for name, field in (("pos_t", "pose"), ("W", "W"), ("eyelid", "eye")):
        save_npy(out / f"{name}.npy", Chunks.of(face[field]))
    shapes = {name: (model.count, *LEARNED[learned], GAUSSIAN_SHAPES) for name, (learned, _) in DELTAS.items()}
    files = {name: np.lib.format.open_memmap(out / f"{name}.npy", "w+", np.float32, s) for name, s in shapes.items()}
    for rows, raw in chunks(model):
        for name, delta in fold(raw).items():
            files[name][rows] = delta
    for k, fields in enumerate(model.mouth):
        save_static(fields, folder / f"mouth{k}_chkpnt{ITERATION}")


def save_static(fields: Fields, folder: Path) -> None:
    """pos, shs, scale, rot and opacity of one set."""
    folder.mkdir(parents=True, exist_ok=True)
    shs = np.concatenate([fields["features_dc"], fields["features_rest"]], axis=1)
    for name, array in {
        "pos": fields["xyz"],
        "shs": shs,
        "scale": fields["scaling"],
        "rot": fields["rotation"],
        "opacity": fields["opacity"],
    }.items():
        save_npy(folder / f"{name}.npy", Chunks.of(array))
