"""PSAvatar's checkpoint. The released repository holds no code, so the layout is our own: see PSAVATAR.md.

FOLDER/rules.json
FOLDER/point_cloud/iteration_N/{point_cloud.ply, psavatar.npz}, and where one is trained {enhancer.onnx, enhancer.json}
"""

from __future__ import annotations

import json
import os
import shutil
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from avatar_export.readers import enhancer_file, rules_file
from avatar_runtime import F32, I64, Enhancer, Gaussians, Rig
from avatar_runtime.codec import ply


@dataclass(frozen=True)
class Checkpoint:
    """What the files hold; lengths in metres."""

    gaussians: Gaussians  # in the canonical pose: mean and rotation as the mesh at rest carries them
    vertices: F32  # [V, 3] the body model at rest, which is the canonical mesh
    triangles: I64  # [F, 3]
    triangle: I64  # [N]
    barycentric: F32  # [N, 3]
    displacement: F32  # [N]
    quat_wxyz: F32  # [N, 4] R' as trained, any length and sign
    bases: F32  # [U, V, 3] P' and E'
    basis_names: Sequence[str]  # [U] as `coefficient_names` has them
    training_per_metre: float
    rules: Mapping[str, str]
    system: str
    enhancer: Enhancer | None = None


def coefficient_names(rig: Rig, expressions: Sequence[str]) -> list[str]:
    """The coefficients of the mesh's bases: "pose/JOINT/ROW/COLUMN" of R - I, then "expression/NAME"."""
    joints = [rig.joint_names[j] for j in rig.corrective_joints]
    pose = [f"pose/{joint}/{row}/{column}" for joint in joints for row in range(3) for column in range(3)]
    return [*pose, *(f"expression/{name}" for name in expressions)]


def save(checkpoint: Checkpoint, folder: Path, iteration: int) -> None:
    """Write the files; those of an iteration appear together or not at all. OSError if they cannot be written."""
    clouds = folder / "point_cloud"
    clouds.mkdir(parents=True, exist_ok=True)
    document = {
        "system": checkpoint.system,
        rules_file.UNITS: checkpoint.training_per_metre,
        "rules": dict(checkpoint.rules),
    }
    partial = folder / ".rules.json.partial"
    partial.write_text(json.dumps(document, indent=2) + "\n")
    os.replace(partial, folder / "rules.json")
    final, partial = clouds / f"iteration_{iteration}", clouds / f".iteration_{iteration}.partial"
    shutil.rmtree(partial, ignore_errors=True)
    partial.mkdir()
    (partial / "point_cloud.ply").write_bytes(ply.encode(checkpoint.gaussians))
    np.savez_compressed(
        partial / "psavatar.npz",
        canonical_vertices=checkpoint.vertices,
        triangles=checkpoint.triangles.astype(np.int32),
        triangle=checkpoint.triangle.astype(np.int32),
        barycentric=checkpoint.barycentric,
        displacement=checkpoint.displacement,
        local_quat_wxyz=checkpoint.quat_wxyz,
        basis=checkpoint.bases,
        basis_names=np.array(checkpoint.basis_names, dtype=str),
        training_per_metre=np.array([checkpoint.training_per_metre], np.float32),
    )
    if checkpoint.enhancer is not None:
        enhancer_file.save_enhancer(partial, checkpoint.enhancer)
    shutil.rmtree(final, ignore_errors=True)
    partial.rename(final)
