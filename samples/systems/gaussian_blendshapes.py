"""The head as 3D Gaussian Blendshapes: the content of a trained checkpoint."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from avatar_runtime.rotation import matrix_from_rotvec, quat_from_matrix, quat_multiply
from avatar_trainer.head import GAUSSIAN_SHAPES, JAW, JAW_SHAPES, BodyModel, Head, unit
from samples.subjects.colour import logit, surface_colour, surface_opacity
from samples.subjects.surface import Samples, deformation, sample_mesh

Array = npt.NDArray[Any]
Fields = dict[str, Array]

SH_C0, SH_C1 = 0.28209479177387814, 0.4886025119029199
CHUNK = 1024  # Gaussians made at a time
MOUTH_SHARE = 0.1  # Gaussians in each set of teeth, as a share of the face's, as in the trainer

# Deviation and thickness of a splat, in sample spacings: no hole shows, flat along the normal.
WIDTH, THICKNESS = 0.68, 0.07
FADED_THICKNESS = 0.5  # added where the bust fades out, since flat splats would fray its edge
OPACITY_LOGIT = 6.0
STRETCH = (-0.6, 1.0)
# Joints and eyelid fields bring no scale of their own: splats bridge closed lids and a jaw turned this far.
HELD_JAW = (np.radians(15.0), 0.0, 0.0)
SHEEN = 0.09  # how much brighter skin looks from the front than at a grazing angle

# The trainer's mask thresholds, metres (train.py: 0.1 * 0.000237277025008 and 0.005703532602638).
MASK_NONE, MASK_FULL = 0.1 * 0.000237277025008, 0.005703532602638

# Regions of the face set, and the spacing of their samples relative to each other.
REGION_SPACING = np.array([1.0, 0.72, 0.5, 1.35, 1.1, 0.6, 0.3])
SKIN, FEATURE, FINE, BACK, SOCKET, EYE, IRIS = range(len(REGION_SPACING))
LID_REACH = 0.021  # metres from the centre of the eyeball

RAW_STATIC = ("xyz", "features_dc", "features_rest", "scaling", "rotation", "opacity")
# Field -> shape of one Gaussian's values, without the 50 expressions.
LEARNED: dict[str, tuple[int, ...]] = {
    "xyz_b": (3,),
    "features_b": (16, 3),
    "scaling_b": (3,),
    "rotation_b": (4,),
    "opacity_b": (1,),
}
INIT: dict[str, tuple[int, ...]] = {"init_rot": (4,), "init_sh": (16, 3), "init_xyz": (3,)}
# dump file -> (learned field, init field or None)
DELTAS = {
    "xyz_t": ("xyz_b", "init_xyz"),
    "shs_t": ("features_b", "init_sh"),
    "scale_t": ("scaling_b", None),
    "rot_t": ("rotation_b", "init_rot"),
    "opacity_t": ("opacity_b", None),
}
# Size of a conformance avatar's random learned values; zero where the mask is zero, as training leaves them.
NOISE = {
    "xyz_b": 3e-4,
    "features_b": 0.05,
    "scaling_b": 0.06,
    "rotation_b": 0.02,
    "opacity_b": 0.2,
    "init_sh": 0.02,
}
# Rows of a conformance avatar's raw checkpoint that hold a NaN, and in which field; the dump lacks them.
NAN_ROWS = {7: "xyz", 300: "features_rest", 1201: "features_dc"}


@dataclass(frozen=True)
class Model:
    """The content of a checkpoint: P raw rows of the face set, and the two sets of teeth."""

    body: BodyModel
    vertices: Array  # f64 [V, 3], the body's template with the subject's identity shape
    held: Array  # f64 [V, 3], the same with the lids closed and the jaw turned: what the splats at rest cover
    samples: Samples
    face: Fields  # RAW_STATIC, pose [36, P, 3], eye [P, 3, 2], W [P, 5]; float32
    jaw_motion: dict[
        int, Array
    ]  # column of a jaw shape -> its whole offsets [V, 3], joint and morph together
    mouth: tuple[Fields, Fields]  # RAW_STATIC of the upper and lower teeth
    noise_seed: int | None = (
        None  # random learned values in every field, for conformance; None: those that follow from the mesh
    )

    @property
    def count(self) -> int:
        return len(self.samples.face)

    @property
    def kept(self) -> Array:
        """Mask [P] of the raw rows without a NaN."""
        mask = np.ones(self.count, bool)
        for name in ("xyz", "features_dc", "features_rest"):
            mask &= np.isfinite(self.face[name]).reshape(self.count, -1).all(axis=1)
        return mask


def face_regions(head: Head) -> Array:
    """Region of each triangle for the face set, -1 for teeth, gums and the hidden back of the eyeballs."""
    centre = head.vertices[head.triangles].mean(axis=1)
    regions = np.full(len(centre), -1)
    regions[head.triangles_in("face")] = SKIN
    near = (np.abs(centre[:, 0]) < 0.055) & (centre[:, 1] < 0.075) & (centre[:, 2] > 0.055)
    ears = np.abs(centre[:, 0]) > 0.074
    regions[head.triangles_in("face") & (near | ears) & (centre[:, 1] > -0.075)] = FEATURE
    regions[head.triangles_in("head")] = BACK
    regions[head.triangles_in("face", "head") & (centre[:, 1] < -0.135)] = FEATURE
    regions[head.triangles_in("mouth_socket", "eye_sockets")] = SOCKET
    lips = (np.abs(centre[:, 0]) < 0.034) & (np.abs(centre[:, 1] + 0.042) < 0.02) & (centre[:, 2] > 0.085)
    regions[head.triangles_in("face") & lips] = FINE
    for eye, name in enumerate(("left_eye", "right_eye")):
        arm = centre - head.eye_centres[eye]
        regions[head.triangles_in("face") & (np.linalg.norm(arm, axis=1) < LID_REACH)] = FINE
        axis = unit(arm)[:, 2]
        regions[head.triangles_in(name) & (axis > -0.35)] = EYE
        regions[head.triangles_in(name) & (axis > np.cos(np.radians(24)))] = IRIS
    return regions


def static_fields(head: Head, samples: Samples) -> Fields:
    """RAW_STATIC of splats that lie flat on the surface, coloured by the scan."""
    n = len(samples.face)
    colour = surface_colour(head, samples)
    # A degree-1 lobe along the normal: seen along d, it adds -SHEEN * colour * (d . normal).
    x, y, z = samples.frame[:, :, 2].T
    lobe = np.stack([y, -z, x], axis=1)[:, :, None] * (SHEEN / SH_C1) * colour[:, None]
    rest = np.zeros((n, 15, 3))
    rest[:, :3] = lobe
    opacity = surface_opacity(head, samples)
    sigma = samples.spacing[:, None] * np.array([WIDTH, WIDTH, THICKNESS])
    sigma[:, 2] += FADED_THICKNESS * samples.spacing * (1 - opacity)
    fields = {
        "xyz": samples.position,
        "features_dc": ((colour * (1 - SHEEN) - 0.5) / SH_C0)[:, None],
        "features_rest": rest,
        "scaling": np.log(sigma),
        "rotation": quat_from_matrix(samples.frame),
        "opacity": logit(opacity, OPACITY_LOGIT)[:, None],
    }
    return {name: a.astype(np.float32) for name, a in fields.items()}


def rigged_fields(body: BodyModel, samples: Samples) -> Fields:
    """Pose shapes [36, P, 3] (the sum over the triangle, as trained), lids [P, 3, 2], weights [P, 5]."""
    triangles = body.faces
    pose = body.posedirs[triangles[samples.face]].sum(axis=1)
    lids = np.stack([samples.interpolate(lid, triangles) for lid in (body.l_eyelid, body.r_eyelid)], axis=-1)
    weights = samples.interpolate(body.lbs_weights.astype(np.float64), triangles)
    fields = {
        "pose": np.moveaxis(pose, -1, 0),
        "eye": lids,
        "W": weights / weights.sum(axis=1, keepdims=True),
    }
    return {name: np.ascontiguousarray(a, np.float32) for name, a in fields.items()}


def build_model(
    head: Head, body: BodyModel, gaussians: int, *, shape: Array | None = None, noise_seed: int | None = None
) -> Model:
    """A checkpoint of `gaussians` splats in the face set and a tenth of that in each set of teeth.

    `shape` [M]: identity coefficients of the subject. With `noise_seed` every field gets random values and
    the rows of NAN_ROWS are added; of few Gaussians, those of them that there are.
    """
    vertices = head.vertices
    if shape is not None:
        vertices = vertices + body.shapedirs_identity[:, :, : len(shape)] @ shape
    subject = replace(head, vertices=vertices)
    count = gaussians + (len(NAN_ROWS) if noise_seed is not None else 0)
    held = replace(head, vertices=held_vertices(body, vertices))
    samples = sample_mesh(subject, face_regions(subject), REGION_SPACING, count, seed=1, held=held)
    face = static_fields(subject, samples) | rigged_fields(body, samples)
    mouth = []
    for k, parts in enumerate((("upper_teeth", "upper_gums"), ("lower_teeth", "lower_gums"))):
        regions = np.where(head.triangles_in(*parts), 0, -1)
        inside = sample_mesh(subject, regions, np.ones(1), max(1, round(gaussians * MOUTH_SHARE)), seed=2 + k)
        mouth.append(static_fields(subject, inside))
    if noise_seed is not None:
        rng = np.random.default_rng(noise_seed)
        for fields in (face, *mouth):
            add_noise(fields, rng)
        for row, name in NAN_ROWS.items():
            face[name][row : row + 1].reshape(-1)[-1:] = np.nan
    columns = body.expression_names[:GAUSSIAN_SHAPES]
    jaw_motion = {columns.index(n): head.expression(n) for n in JAW_SHAPES if n in columns}
    return Model(body, vertices, held.vertices, samples, face, jaw_motion, (mouth[0], mouth[1]), noise_seed)


def held_vertices(body: BodyModel, vertices: Array) -> Array:
    """Vertices [V, 3] with both eyelid fields at full weight and the jaw joint turned by HELD_JAW."""
    moved = vertices + body.l_eyelid + body.r_eyelid
    arm = moved - body.joints[JAW]
    turn = arm @ matrix_from_rotvec(np.array(HELD_JAW)).T - arm
    result: Array = moved + body.lbs_weights[:, JAW, None] * turn
    return result


def add_noise(fields: Fields, rng: np.random.Generator) -> None:
    """Random SH of all bands, opacities, and quaternions that are not unit, in place."""
    n = len(fields["xyz"])
    fields["features_rest"] += rng.normal(0, 0.06, (n, 15, 3)).astype(np.float32)
    fields["features_dc"] += rng.normal(0, 0.1, (n, 1, 3)).astype(np.float32)
    fields["opacity"] += rng.normal(-4, 2, (n, 1)).astype(np.float32)
    fields["scaling"] += rng.normal(0, 0.3, (n, 3)).astype(np.float32)
    fields["rotation"] += rng.normal(0, 0.1, (n, 4)).astype(np.float32)
    fields["rotation"] *= rng.uniform(0.5, 1.6, (n, 1)).astype(np.float32)


def moved_rows(model: Model, rows: slice) -> Fields:
    """The fields with one column for each expression, of some Gaussians; float32.

    Init terms are the triangle's motion of the Gaussian. The mask follows the distance that the triangle moves. The
    learned scale is the stretch of the triangle beyond the splat's size at rest, for jaw shapes with the joint's
    rotation; the rest is zero.
    """
    face = model.samples.face[rows]
    corner = model.body.faces[face]
    before = model.vertices[corner]
    position = model.samples.position[rows]
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
    _, _, gradient_held = deformation(before, model.held[corner], position)
    covered = np.maximum(log_stretch(gradient_held, frame), 0)
    stretch = log_stretch(gradient, frame[row])
    for j, full in model.jaw_motion.items():
        jaw = shape == j
        _, _, gradient = deformation(
            before[row[jaw]], before[row[jaw]] + full[corner[row[jaw]]], position[row[jaw]]
        )
        stretch[jaw] = log_stretch(gradient, frame[row[jaw]])
    stretch = np.clip(stretch - np.clip(stretch, 0, covered[row]), *STRETCH)
    mask = out["mask"][row, shape][:, None].astype(np.float64)
    out["scaling_b"][row, :2, shape] = stretch / np.where(mask > 0, mask, np.inf)
    if model.noise_seed is not None:
        rng = np.random.default_rng([model.noise_seed, rows.start])
        for name, size in NOISE.items():
            noise = rng.normal(0, size, out[name].shape).astype(np.float32)
            moves = (out["mask"] > 0).reshape(n, *[1] * (noise.ndim - 2), k)
            out[name] += noise * moves
    return out


def log_stretch(gradient: Array, frame: Array) -> Array:
    """The growth of the two tangents of a splat [N, 2], natural logarithm."""
    length = np.linalg.norm(gradient @ frame[:, :, :2], axis=1)
    result: Array = np.log(np.maximum(length, 1e-3))
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
