"""SplattingAvatar's checkpoint, in the layout of the released code, which the exporter reads.

    FOLDER/config.yaml, rules.json
    FOLDER/point_cloud/iteration_N/{point_cloud.ply, embedding.json, embedding.obj}

Source: SplattingAvatar 3847314 gauss_base.py save_ply, splatting_avatar_model.py save_embedding_json.
"""

from __future__ import annotations

import json
import os
import shutil
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import yaml

from avatar_export.readers import rules_file
from avatar_runtime import F32, F64, I64, Gaussians
from avatar_runtime.codec import ply

DECIMALS = 6  # of embedding.obj


@dataclass(frozen=True)
class Checkpoint:
    """What the files hold; lengths in training units."""

    vertices: F32  # [V, 3] the canonical mesh, `as_written`
    triangles: I64  # [F, 3]
    vertex_normals: F32  # [V, 3]; no reader needs them
    mean: F32  # [N, 3] in the canonical pose
    triangle: I64  # [N]
    barycentric: F32  # [N, 3]
    displacement: F32  # [N]
    quat_wxyz: F32  # [N, 4] as trained, any length and sign
    log_scale: F32  # [N, 3]
    opacity_logit: F32  # [N]
    sh: F32  # [N, K, 3]
    units: float  # training units in a metre
    frameset_type: str  # of the data set, which implies the units in the release
    mesh_scaling: bool
    inverse_sh_direction: bool
    rules: Mapping[str, str]
    system: str
    seed: int


def as_written(vertices: F64) -> F32:
    """`vertices` as a reader of embedding.obj gets them: six decimals, then float32."""
    return np.round(vertices, DECIMALS).astype(np.float32)


def save(checkpoint: Checkpoint, folder: Path, iteration: int) -> None:
    """Write the files; those of an iteration appear together or not at all. OSError if they cannot be written."""
    clouds = folder / "point_cloud"
    clouds.mkdir(parents=True, exist_ok=True)
    _write(folder / "config.yaml", yaml.safe_dump(_config(checkpoint), sort_keys=False))
    document = {
        "system": checkpoint.system,
        rules_file.UNITS: checkpoint.units,
        "rules": dict(checkpoint.rules),
    }
    _write(folder / "rules.json", json.dumps(document, indent=2) + "\n")
    final, partial = clouds / f"iteration_{iteration}", clouds / f".iteration_{iteration}.partial"
    shutil.rmtree(partial, ignore_errors=True)
    partial.mkdir()
    (partial / "point_cloud.ply").write_bytes(ply.encode(_canonical(checkpoint)))
    (partial / "embedding.json").write_text(json.dumps(_embedding(checkpoint)))
    (partial / "embedding.obj").write_text(obj_text(checkpoint))
    shutil.rmtree(final, ignore_errors=True)
    partial.rename(final)


def _write(path: Path, text: str) -> None:
    partial = path.with_name(f".{path.name}.partial")
    partial.write_text(text)
    os.replace(partial, path)


def _config(checkpoint: Checkpoint) -> dict[str, object]:
    """The keys that the release stores and that a reader asks for; its `frameset_type` implies the units."""
    degree = round(checkpoint.sh.shape[1] ** 0.5) - 1
    return {
        "seed": checkpoint.seed,
        "dataset": {"frameset_type": checkpoint.frameset_type},
        "model": {
            "sh_degree": degree,
            "num_init_samples": len(checkpoint.triangle),
            "xyz_as_uvd": True,
            "with_mesh_scaling": checkpoint.mesh_scaling,
        },
        "pipe": {"convert_SHs_python": checkpoint.inverse_sh_direction, "compute_cov3D_python": False},
    }


def _canonical(checkpoint: Checkpoint) -> Gaussians:
    """The Gaussians in the canonical pose; their rotations of unit length with w >= 0, as pytorch3d gives them."""
    quat = checkpoint.quat_wxyz.astype(np.float64)
    quat /= np.maximum(np.linalg.norm(quat, axis=1, keepdims=True), 1e-12)
    quat = np.where(quat[:, :1] < 0, -quat, quat)
    return Gaussians(
        checkpoint.mean,
        checkpoint.log_scale,
        quat.astype(np.float32),
        checkpoint.opacity_logit,
        checkpoint.sh,
    )


def _embedding(checkpoint: Checkpoint) -> dict[str, object]:
    """`_xyz` is (shift of u, shift of v, d), the shifts done; `_rotation` is raw, unlike rot_* of the .ply."""
    still = np.zeros((len(checkpoint.triangle), 2), np.float32)
    return {
        "cano_mesh": "embedding.obj",
        "sample_fidxs": checkpoint.triangle.tolist(),
        "sample_bary": checkpoint.barycentric.tolist(),
        "_xyz": np.column_stack([still, checkpoint.displacement]).tolist(),
        "_rotation": checkpoint.quat_wxyz.tolist(),
    }


def obj_text(checkpoint: Checkpoint) -> str:
    """Wavefront text with six decimals, a normal for each vertex, corners counted from 1."""

    def rows(tag: str, values: F32) -> list[str]:
        return [f"{tag} {x:.{DECIMALS}f} {y:.{DECIMALS}f} {z:.{DECIMALS}f}" for x, y, z in values.tolist()]

    faces = [f"f {a}//{a} {b}//{b} {c}//{c}" for a, b, c in (checkpoint.triangles + 1).tolist()]
    lines = [*rows("v", checkpoint.vertices), *rows("vn", checkpoint.vertex_normals), *faces]
    return "\n".join(lines) + "\n"
