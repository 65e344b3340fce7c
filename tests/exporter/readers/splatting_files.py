"""Small runs in the layouts of SplattingAvatar and GaussianAvatars, written with json, plyfile and NumPy."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any, BinaryIO

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
    coefficients = (degree + 1) ** 2
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
        "sh": random.normal(0, 0.4, (COUNT, coefficients, 3)).astype("f4"),
        "ply_xyz": random.normal(0, 0.1, (COUNT, 3)).astype("f4"),
        "ply_rot": random.normal(0, 1, (COUNT, 4)).astype("f4"),
    }


def write_ply(path: Path, a: Arrays, extra: dict[str, Any] | None = None) -> None:
    """See `write_ply_to`."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("wb") as stream:
        write_ply_to(stream, a, extra)


def write_ply_to(stream: BinaryIO, a: Arrays, extra: dict[str, Any] | None = None) -> None:
    """Properties in the trainers' order; `extra` ones at the end."""
    rest = a["sh"][:, 1:].transpose(0, 2, 1).reshape(COUNT, -1)  # channel-major
    columns = {name: a["ply_xyz"][:, i] for i, name in enumerate("xyz")}
    columns |= {name: np.zeros(COUNT, "f4") for name in ("nx", "ny", "nz")}
    columns |= {f"f_dc_{i}": a["sh"][:, 0, i] for i in range(3)}
    columns |= {f"f_rest_{i}": rest[:, i] for i in range(rest.shape[1])}
    columns |= {"opacity": a["opacity_logit"]}
    columns |= {f"scale_{i}": a["log_scale"][:, i] for i in range(3)}
    columns |= {f"rot_{i}": a["ply_rot"][:, i] for i in range(4)}
    columns |= extra or {}
    rows = np.empty(COUNT, [(name, np.asarray(values).dtype.str) for name, values in columns.items()])
    for name, values in columns.items():
        rows[name] = values
    PlyData([PlyElement.describe(rows, "vertex")]).write(stream)


def obj_text(vertices: np.ndarray = VERTICES, faces: np.ndarray = FACES) -> str:
    """As SplattingAvatar writes it: six decimals, normals, `a//a`."""
    lines = [f"# {len(vertices)} vertices"]
    lines += ["v {:f} {:f} {:f}".format(*v) for v in vertices]
    lines += ["vn {:f} {:f} {:f}".format(*v) for v in vertices]
    lines += ["f " + " ".join(f"{c + 1}//{c + 1}" for c in face) for face in faces]
    return "\n".join(lines) + "\n"


def document(a: Arrays) -> dict[str, Any]:
    return {
        "cano_mesh": "embedding.obj",
        **{key: a[key].tolist() for key in ("sample_fidxs", "sample_bary", "_xyz", "_rotation")},
    }


def legacy(a: Arrays, mesh: str = "embedding.obj") -> dict[str, Any]:
    return {
        "mesh_fn": mesh,
        **{key: a[key].tolist() for key in ("_xyz", "_rotation", "sample_fidxs")},
        "_sample_bary": a["sample_bary"].tolist(),
    }


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
    write_ply(folder / "point_cloud.ply", a)
    (folder / form).write_text(json.dumps(document(a) if embedding is None else embedding))
    (folder / "embedding.obj").write_text(obj_text() if obj is None else obj)
    if config is not None:
        (run / "config.yaml").write_text(config)
    return folder


def write_gaussian_run(run: Path, a: Arrays, *, binding: Any = None, vertices: int | None = 6) -> Path:
    """A checkpoint of GaussianAvatars; returns the folder of the iteration."""
    folder = run / "point_cloud" / "iteration_600000"
    ids = a["sample_fidxs"].astype("f4") if binding is None else binding
    write_ply(folder / "point_cloud.ply", a, {} if binding is False else {"binding_0": ids})
    if vertices is not None:
        np.savez(
            folder / "flame_param.npz",
            static_offset=np.zeros((1, vertices, 3), "f4"),
            expr=np.zeros((2, 5), "f4"),
        )
    return folder


def read_run(path: Path, **options: Any) -> Avatar:
    """The avatar of a run, by default without a rig."""
    return read(path, ReadOptions(**{"no_rig": True, **options}), splatting_avatar.SYSTEM)


def notes_of(avatar: Avatar) -> list[str]:
    """The notes of the reader itself; its part for rigs reports a missing rig."""
    return [note for note in avatar.provenance["notes"] if not note.startswith("no rig")]


def put(key: str, *at: Any) -> Callable[[dict[str, Any]], None]:
    """Puts the last of `at` to where the others lead."""

    def change(document: dict[str, Any]) -> None:
        owner: Any = document
        for step in (key, *at[:-2]):
            owner = owner[step]
        owner[at[-2]] = at[-1]

    return change
