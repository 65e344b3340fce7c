"""Files as the unofficial ASM code has them, built by hand: a Blender rig, an .obj with a seam, a pickle."""

from __future__ import annotations

import json
import pickle
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from tests.asm_faces import grid

Array = npt.NDArray[Any]

BONES = ("nose", "nose.001", "lip.T.L", "ear.L")
SCALE = 77.15  # of the rig in the scene
UPRIGHT = np.array(
    [[1, 0, 0, 0], [0, 0, -1, 0], [0, 1, 0, 0.25], [0, 0, 0, 1.0]]
)  # the mesh in the scene, Z up


def bones(rng: np.random.Generator) -> dict[str, dict[str, Any]]:
    """name -> head, tail and matrix in the rig's own space; `face` first, as Blender writes it."""
    found: dict[str, dict[str, Any]] = {}
    for name in ("face", *BONES):
        matrix = np.eye(4)
        matrix[:3, :3] = np.linalg.qr(rng.normal(size=(3, 3)))[0]
        matrix[:3, :3] *= np.sign(np.linalg.det(matrix[:3, :3]))
        matrix[:3, 3] = rng.uniform(-0.05, 0.05, 3)
        tail = matrix[:3, 3] + 0.08 * matrix[:3, 1]
        found[name] = {
            "head": matrix[:3, 3].tolist(),
            "tail": tail.tolist(),
            "length": 0.08,
            "scale": [1.0, 1.0, 1.0],
            "rotation_euler": [0.0, 0.0, 0.0],
            "location": [0.0, 0.0, 0.0],
            "parent": "spine.006" if name == "face" else "face",
            "children": [*BONES] if name == "face" else [],
            "matrix": matrix.tolist(),
            "matrix_basis": np.eye(4).tolist(),
        }
    return found


def rig_info(rng: np.random.Generator) -> dict[str, Any]:
    """What rig_info.json holds."""
    rig = np.diag([SCALE, SCALE, SCALE, 1.0])
    rig[:3, 3] = (0.0, 2.0, -3.0)
    place = {"scale": [1.0] * 3, "rotation_euler": [0.0] * 3, "location": [0.0] * 3}
    return {
        "mu_face": {**place, "matrix_world": UPRIGHT.tolist()},
        "metarig": {**place, "matrix_world": rig.tolist(), "bones": bones(rng)},
    }


def parameters(rng: np.random.Generator, components: int) -> dict[str, Array]:
    """What inited_gmm_params_KN.pkl holds: pi and the diagonal before softplus."""
    j = len(BONES)
    return {
        "pi": rng.normal(0, 2, (j, components)).astype("f4"),
        "mu": rng.normal(0, 0.05, (j, components, 2)).astype("f4"),
        "scale_tril": rng.normal([-2, -2, 0], [0.5, 0.5, 0.05], (j, components, 3)).astype("f4"),
    }


def obj_text() -> str:
    """The grid in centimetres; its first two triangles lie beyond a seam, in a chart of their own."""
    vertices, triangles, uv = grid()
    lines = [f"v {x} {y} {z}" for x, y, z in (100.0 * vertices).tolist()]
    lines += [f"vt {u} {v}" for u, v in uv.tolist()]
    lines += [f"vt {u + 3} {v}" for u, v in uv.tolist()]  # the other chart
    for f, corners in enumerate(triangles.tolist()):
        shift = len(uv) if f < 2 else 0
        lines.append("f " + " ".join(f"{c + 1}/{c + 1 + shift}" for c in corners))
    return "\n".join(lines) + "\n"


def write_folder(folder: Path, seed: int = 0, components: tuple[int, ...] = (2, 3)) -> Path:
    """The three files, one pickle for each number of components."""
    rng = np.random.default_rng(seed)
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "rig_info.json").write_text(json.dumps(rig_info(rng)))
    (folder / "mu_face.obj").write_text(obj_text())
    for k in components:
        (folder / f"inited_gmm_params_K{k}.pkl").write_bytes(pickle.dumps(parameters(rng, k)))
    return folder
