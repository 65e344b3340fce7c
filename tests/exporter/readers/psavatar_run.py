"""Small runs in PSAvatar's layout, written with plyfile and NumPy, and the body model that they were trained on."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

from avatar_export.options import ReadOptions
from avatar_export.readers.table import read
from avatar_runtime.avatar import Avatar
from tests.exporter.bodies import body_files
from tests.exporter.readers import splatting_files

COUNT = splatting_files.COUNT
BODY = body_files.body(body_files.FLAME_PARENTS)
NAMES = ("pose/jaw/0/2", "expression/exp_001", "pose/neck/1/1", "expression/exp_000")
Arrays = dict[str, Any]


def arrays() -> Arrays:
    """Keys of psavatar.npz; metres."""
    random = np.random.default_rng(8)
    triangles = BODY["triangles"]
    return {
        "canonical_vertices": BODY["v_template"],
        "triangles": triangles.astype("i4"),
        "triangle": random.integers(0, len(triangles), COUNT).astype("i4"),
        "barycentric": random.dirichlet([1, 1, 1], COUNT).astype("f4"),
        "displacement": random.uniform(0, 0.05, COUNT).astype("f4"),
        "local_quat_wxyz": random.normal(0, 1.5, (COUNT, 4)).astype("f4"),
        "basis": random.normal(0, 0.003, (len(NAMES), len(BODY["v_template"]), 3)).astype("f4"),
        "basis_names": np.array(NAMES),
        "training_per_metre": np.array([4.0], "f4"),
    }


def write_run(run: Path, a: Arrays, rules: dict[str, str] | None = None, name: str = "psavatar.npz") -> Path:
    """A checkpoint; returns the folder of the iteration. The body model lies in RUN/body.npz."""
    folder = run / "point_cloud" / "iteration_9"
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "point_cloud.ply").write_bytes(splatting_files.ply(splatting_files.arrays()))
    np.savez(folder / name, **a)
    if rules is not None:
        (run / "rules.json").write_text(json.dumps({"system": "psavatar", "rules": rules}))
    body_files.write_body(run / "body.npz", BODY)
    return folder


def read_run(run: Path, **options: Any) -> Avatar:
    """The avatar of a run, by default on its body model."""
    given = options or {"body_model": run / "body.npz", "shape": Path("zero")}
    return read(run, ReadOptions(**given), "psavatar")
