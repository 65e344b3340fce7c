"""Small runs in the layouts of SplattingAvatar and GaussianAvatars, written with json, plyfile and NumPy."""

from __future__ import annotations

import io
import json
from pathlib import Path
from typing import Any

import numpy as np
from plyfile import PlyData, PlyElement

from avatar_export.options import ReadOptions
from avatar_export.readers.splatting_avatar import reader as splatting_avatar
from avatar_export.readers.table import read
from avatar_runtime.avatar import Avatar

COUNT = 24
# A lopsided octahedron, as the six decimals of an .obj say it; 0.2 high.
VERTICES = np.array(
    [
        [0.08, 0.0, 0.01], [-0.07, 0.01, 0.0], [0.004, 0.11, -0.01],
        [0.0, -0.1, 0.003], [0.01, 0.0, 0.09], [-0.005, 0.02, -0.081234],
    ]
)  # fmt: skip
FACES = np.array([[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]])
CONFIG = """\
seed: 9061
dataset: {resolution: 1, data_device: cpu, frameset_type: imavatar}
model: {sh_degree: 1, num_init_samples: 24, xyz_as_uvd: true, with_mesh_scaling: true}
pipe: {convert_SHs_python: true, compute_cov3D_python: false, debug: false}
yaml_dir: configs
"""
Arrays = dict[str, Any]


def arrays(degree: int = 1) -> Arrays:
    """What training left, in training units; float32 except for the indices."""
    random = np.random.default_rng(3)
    weights = random.dirichlet([1, 1, 1], COUNT).astype("f4")
    weights[:3] = [[1, 0, 0], [0.5, 0.5, 0], [-0.0009765625, 0.5, 0.5009765625]]
    xyz = np.zeros((COUNT, 3), "f4")
    xyz[:, 2] = random.normal(0, 0.01, COUNT)
    return {
        "sample_fidxs": random.integers(0, len(FACES), COUNT),
        "sample_bary": weights,
        "_xyz": xyz,
        "_rotation": random.normal(0, 1.5, (COUNT, 4)).astype("f4"),
        "log_scale": random.normal(-5, 1, (COUNT, 3)).astype("f4"),
        "opacity_logit": random.normal(0, 2, COUNT).astype("f4"),
        "sh": random.normal(0, 0.4, (COUNT, (degree + 1) ** 2, 3)).astype("f4"),
        "ply_xyz": random.normal(0, 0.1, (COUNT, 3)).astype("f4"),
        "ply_rot": random.normal(0, 1, (COUNT, 4)).astype("f4"),
    }


def ply(a: Arrays, extra: dict[str, Any] | None = None) -> bytes:
    """Properties in the trainers' order; `extra` ones at the end."""
    rest = a["sh"][:, 1:].transpose(0, 2, 1).reshape(COUNT, -1)  # channel-major
    columns = dict(zip("xyz", a["ply_xyz"].T, strict=True)) | {
        f"n{axis}": np.zeros(COUNT, "f4") for axis in "xyz"
    }
    columns |= {f"f_dc_{i}": a["sh"][:, 0, i] for i in range(3)}
    columns |= {f"f_rest_{i}": column for i, column in enumerate(rest.T)} | {"opacity": a["opacity_logit"]}
    columns |= {f"scale_{i}": column for i, column in enumerate(a["log_scale"].T)}
    columns |= {f"rot_{i}": column for i, column in enumerate(a["ply_rot"].T)} | (extra or {})
    rows = np.empty(COUNT, [(name, np.asarray(values).dtype.str) for name, values in columns.items()])
    for name, values in columns.items():
        rows[name] = values
    stream = io.BytesIO()
    PlyData([PlyElement.describe(rows, "vertex")]).write(stream)
    return stream.getvalue()


def obj_text(vertices: np.ndarray = VERTICES, faces: np.ndarray = FACES) -> str:
    """As SplattingAvatar writes it: six decimals, normals, `a//a`."""
    lines = [f"# {len(vertices)} vertices"]
    lines += ["{} {:f} {:f} {:f}".format(kind, *v) for kind in ("v", "vn") for v in vertices]
    lines += ["f " + " ".join(f"{c + 1}//{c + 1}" for c in face) for face in faces]
    return "\n".join(lines) + "\n"


def document(a: Arrays) -> dict[str, Any]:
    lists = {key: a[key].tolist() for key in ("sample_fidxs", "sample_bary", "_xyz", "_rotation")}
    return {"cano_mesh": "embedding.obj", **lists}


def legacy(a: Arrays) -> dict[str, Any]:
    """The older form, canonical.sample.json."""
    renamed = {"cano_mesh": "mesh_fn", "sample_bary": "_sample_bary"}
    return {renamed.get(key, key): value for key, value in document(a).items()}


def write_splatting_run(
    run: Path,
    a: Arrays,
    *,
    iteration: int = 30000,
    config: str | None = CONFIG,
    embedding: dict[str, Any] | None = None,
    form: str = "embedding.json",
    obj: str | None = None,
) -> Path:
    """A checkpoint of SplattingAvatar; returns the folder of the iteration."""
    folder = run / "point_cloud" / f"iteration_{iteration}"
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "point_cloud.ply").write_bytes(ply(a))
    (folder / form).write_text(json.dumps(document(a) if embedding is None else embedding))
    (folder / "embedding.obj").write_text(obj_text() if obj is None else obj)
    if config is not None:
        (run / "config.yaml").write_text(config)
    return folder


def write_gaussian_run(run: Path, a: Arrays, *, binding: Any = None, vertices: int | None = 6) -> Path:
    """A checkpoint of GaussianAvatars; returns the folder of the iteration."""
    folder = run / "point_cloud" / "iteration_600000"
    folder.mkdir(parents=True, exist_ok=True)
    ids = a["sample_fidxs"].astype("f4") if binding is None else binding
    (folder / "point_cloud.ply").write_bytes(ply(a, {} if binding is False else {"binding_0": ids}))
    if vertices is not None:
        offsets = {"static_offset": np.zeros((1, vertices, 3), "f4"), "expr": np.zeros((2, 5), "f4")}
        np.savez(folder / "flame_param.npz", **offsets)
    return folder


def read_run(path: Path, **options: Any) -> Avatar:
    """The avatar of a run, by default without a rig."""
    return read(path, ReadOptions(**{"no_rig": True, **options}), splatting_avatar.SYSTEM)
