"""A SplattingAvatar run as files: config.yaml, point_cloud.ply, embedding.json, embedding.obj."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

from avatar_trainer.head import Mesh
from samples.systems.ply import ply_bytes, splat_columns
from samples.systems.splatting_avatar import Embedded

ITERATION = 30000
CONFIG = """\
seed: 9061
dataset:
  resolution: 1
  data_device: cpu
  frameset_type: {frames}
model:
  sh_degree: {degree}
  num_init_samples: {count}
  xyz_as_uvd: true
  with_mesh_scaling: {scaling}
pipe:
  convert_SHs_python: {convert}
  compute_cov3D_python: false
  debug: false
yaml_dir: configs
"""


def save_run(trained: Embedded, run: Path, *, mesh_scaling: bool, frames: str) -> None:
    """The folder of one training run; `frames`: the kind of data set it was trained on."""
    folder = run / "point_cloud" / f"iteration_{ITERATION}"
    folder.mkdir(parents=True, exist_ok=True)
    degree = round(trained.sh.shape[1] ** 0.5) - 1
    config = CONFIG.format(
        frames=frames,
        degree=degree,
        count=len(trained.face),
        scaling=str(mesh_scaling).lower(),
        convert=str(degree > 0).lower(),
    )
    (run / "config.yaml").write_text(config)
    save_ply(trained, folder / "point_cloud.ply")
    save_json(trained, folder / "embedding.json")
    (folder / "embedding.obj").write_text(obj_text(Mesh(trained.vertices, trained.triangles)))


def save_ply(trained: Embedded, path: Path) -> None:
    """The canonical Gaussians in graphdeco's layout; of the rotations only their unit form with w >= 0."""
    quat = trained.rotation / np.linalg.norm(trained.rotation, axis=1, keepdims=True)
    quat = np.where(quat[:, :1] < 0, -quat, quat)
    rest = np.moveaxis(trained.sh[:, 1:], 2, 1).reshape(len(quat), -1)  # red, then green, then blue
    columns = splat_columns(
        trained.xyz, trained.sh[:, 0], trained.opacity_logit, trained.log_scale, quat, rest
    )
    path.write_bytes(ply_bytes(columns))


def save_json(trained: Embedded, path: Path) -> None:
    """Where the Gaussians sit on the mesh; `_xyz` is (0, 0, displacement), the first two are never trained."""
    still = np.zeros((len(trained.face), 2), np.float32)
    content = {
        "cano_mesh": "embedding.obj",
        "sample_fidxs": trained.face.tolist(),
        "sample_bary": trained.bary.tolist(),
        "_xyz": np.c_[still, trained.displacement].tolist(),
        "_rotation": trained.rotation.tolist(),
    }
    path.write_text(json.dumps(content))


def obj_text(mesh: Mesh) -> str:
    """Wavefront text with six decimals, a normal for each vertex, one-based corners."""
    v, f = len(mesh.vertices), len(mesh.triangles)
    lines = [f"# {v} vertices", f"# {v} normals", "# 0 texture coordinates", f"# {f} triangles"]
    lines += [f"v {x:.6f} {y:.6f} {z:.6f}" for x, y, z in mesh.vertices.tolist()]
    lines += [f"vn {x:.6f} {y:.6f} {z:.6f}" for x, y, z in mesh.vertex_normals.tolist()]
    lines += [f"f {a}//{a} {b}//{b} {c}//{c}" for a, b, c in (mesh.triangles + 1).tolist()]
    return "\n".join(lines) + "\n"
