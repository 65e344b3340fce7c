"""Small trained avatars of all six systems: `python -m tests.exporter.batch.avatars FOLDER` makes them."""

from __future__ import annotations

import json
import sys
from pathlib import Path

from bench.batch.lists import ROWS
from samples.make import make_body, make_gaussian_blendshapes, make_lam

from avatar_export.asm.files import save
from tests.asm_faces import small_face
from tests.exporter.readers import psavatar_run, splatting_files

GAUSSIANS = 300
CELL = 0.02  # metres between the vertices of a coarse head


def make_all(folder: Path) -> Path:
    """An avatar of each system, made in `folder`, which is returned."""
    blendshapes = make_gaussian_blendshapes(folder, GAUSSIANS, full=True, cell=CELL)
    body = make_body(folder, GAUSSIANS)
    splatting_files.write_gaussian_run(folder / "gaussian_avatars", splatting_files.arrays(degree=3))
    mesh = folder / "mesh.obj"
    mesh.write_text(splatting_files.obj_text(splatting_files.VERTICES * 2))
    psavatar_run.write_run(folder / "psavatar", psavatar_run.arrays())
    save(small_face(), folder / "face.npz")
    rows = [
        {"source": blendshapes / "model", "dataset": blendshapes},
        {"source": body / "run", "rig": body / "CesiumMan.glb"},
        {"source": folder / "gaussian_avatars", "mesh": mesh},
        {"source": folder / "psavatar", "body_model": folder / "psavatar" / "body.npz", "shape": "zero"},
        {"source": make_lam(folder, full=True)},
        {"source": folder / "face.npz"},
    ]
    (folder / ROWS).write_text(json.dumps(rows, default=str))
    return folder


if __name__ == "__main__":
    make_all(Path(sys.argv[1]))
