"""The head in RGBAvatar's layout: Gaussians in tangent frames of triangles, 20 bases, the network before them."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from avatar_runtime.rotation import quat_from_matrix, quat_multiply
from avatar_trainer.head import Head, unit
from samples.subjects.colour import logit, surface_colour, surface_opacity
from samples.subjects.surface import Samples, sample_mesh
from samples.systems.gaussian_blendshapes import THICKNESS, WIDTH, face_regions

Array = npt.NDArray[Any]

BASES, INPUTS, HIDDEN = 20, 129, 128
MEAN, TURN, COLOUR = 4e-4, 0.01, 0.04  # deviations of the bases: metres, quaternion, DC
WAVE = 25.0  # radians a metre, of the bases
GAIN = 0.25  # deviation of the network's weights
SHEAR = 0.2  # of the charts, so that tangent and bitangent are not orthogonal
OFF = 0.0005  # metres above the mesh
OPACITY_LOGIT = 6.0
SH_C0 = 0.28209479177387814
CONFIG = """template_type: Flame
model:
  tex_size: 256
  num_basis_in: {inputs}
  num_basis_blend: {bases}
  use_blend: True
  use_weight_proj: True
  use_mlp_proj: {deep}
"""


def uv_corners(head: Head) -> Array:
    """Texture coordinates [F, 3, 2]: each triangle's own chart, counter-clockwise as it is seen, sheared a little."""
    corner = head.vertices[head.triangles]
    normal = unit(np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]))
    up = np.where(np.abs(normal[:, 1:2]) < 0.9, (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
    across = unit(np.cross(up, normal))
    along = np.einsum("fcx,fx->fc", corner, np.cross(normal, across))
    result: Array = np.stack([np.einsum("fcx,fx->fc", corner, across) + SHEAR * along, along], axis=-1)
    return result


def tangent_frames(corner: Array, uv: Array) -> Array:
    """[F, 3, 3] columns tangent, bitangent, normal; each is unit, the first two need not be orthogonal."""
    frames = np.empty((len(corner), 3, 3))
    edge, step = corner[:, 1:] - corner[:, :1], uv[:, 1:] - uv[:, :1]
    inverse = np.linalg.inv(step)  # rows of `step` are (du, dv) of the two edges
    along = np.einsum("fij,fjx->fix", inverse, edge)
    frames[:, :, 0], frames[:, :, 1] = unit(along[:, 0]), unit(along[:, 1])
    frames[:, :, 2] = unit(np.cross(edge[:, 0], edge[:, 1]))
    return frames


def save_rgbavatar(head: Head, gaussians: int, folder: Path, *, deep: bool) -> None:
    """Write model.ply and config.yaml. `deep`: the network has hidden layers, as the release's own settings have it."""
    regions = face_regions(head)
    spacing = np.where(np.arange(regions.max() + 1) == 0, 0.8, 0.6)
    samples = sample_mesh(head, regions, spacing, gaussians, seed=31)
    frames = tangent_frames(head.vertices[head.triangles], uv_corners(head))[samples.face]
    turns = unit(quat_from_matrix(frames))
    sigma = samples.spacing[:, None] * np.array([WIDTH, WIDTH, THICKNESS])
    rng = np.random.default_rng(32)
    basis = waves(samples, rng)
    columns = {
        **named(
            "", np.linalg.solve(frames, (OFF * samples.frame[:, :, 2])[..., None])[..., 0], ("x", "y", "z")
        ),
        **named("", np.zeros((gaussians, 3)), ("nx", "ny", "nz")),
        "opacity": logit(surface_opacity(head, samples), OPACITY_LOGIT),
        **named("scale_", np.log(sigma)),
        **named("rot_", quat_multiply(turns * [1, -1, -1, -1], quat_from_matrix(samples.frame))),
        **named("f_dc_", (surface_colour(head, samples) - 0.5) / SH_C0),
        **named("f_rest_", np.zeros((gaussians, 45))),
        **named("xyz_b_", MEAN * basis[:, :, :3]),
        **named("rot_b_", TURN * basis[:, :, 3:7]),
        **named("f_dc_b_", COLOUR * basis[:, :, 7:]),
        "weight_module": module(gaussians, rng, deep),
    }
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "model.ply").write_bytes(with_binding(columns, samples))
    (folder / "config.yaml").write_text(CONFIG.format(inputs=INPUTS, bases=BASES, deep=deep))


def waves(samples: Samples, rng: np.random.Generator) -> Array:
    """[N, BASES, 10] smooth functions of the place."""
    direction, phase = rng.normal(0, WAVE, (3, BASES * 10)), rng.uniform(0, 2 * np.pi, BASES * 10)
    result: Array = np.sin(samples.position @ direction + phase).reshape(-1, BASES, 10)
    return result


def module(rows: int, rng: np.random.Generator, deep: bool) -> Array:
    """weight_module [rows]: the network's parameters, layer by layer, weight before bias; then zeros."""
    widths = (INPUTS, HIDDEN, HIDDEN, BASES) if deep else (INPUTS, BASES)
    parts = []
    for size_in, size_out in pairwise(widths):
        spread = GAIN * (np.sqrt(2 / size_in) * 3 if deep else 1)
        parts += [rng.normal(0, spread, size_in * size_out), rng.normal(0, 0.1, size_out)]
    flat = np.concatenate(parts)
    if len(flat) > rows:
        raise ValueError(f"the network has {len(flat)} parameters, more than {rows} Gaussians can store")
    result: Array = np.pad(flat, (0, rows - len(flat)))
    return result


def named(prefix: str, values: Array, names: tuple[str, ...] = ()) -> dict[str, Array]:
    """Columns of values [N, ...], flattened, as `prefix` and a number, or by `names`."""
    flat = values.reshape(len(values), -1)
    return {f"{prefix}{names[k] if names else k}": column for k, column in enumerate(flat.T)}


def with_binding(columns: dict[str, Array], samples: Samples) -> bytes:
    """A PLY of float columns, then the triangle as an int and its barycentric weights, as the release writes it."""
    kinds = [(name, "<f4") for name in columns] + [("face_id", "<i4")]
    kinds += [(f"face_bary_{c}", "<f4") for c in range(3)]
    rows = np.zeros(len(samples.face), kinds)
    for name, values in columns.items():
        rows[name] = values
    rows["face_id"] = samples.face
    for c in range(3):
        rows[f"face_bary_{c}"] = samples.bary[:, c]
    header = ["ply", "format binary_little_endian 1.0", f"element vertex {len(rows)}"]
    header += [f"property {'int' if kind == '<i4' else 'float'} {name}" for name, kind in kinds]
    return "\n".join([*header, "end_header", ""]).encode("ascii") + rows.tobytes()
