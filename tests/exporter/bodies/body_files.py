"""Small body models of FLAME's and SMPL's layout, and the pose files that go with them."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[Any]

FLAME_PARENTS = (-1, 0, 1, 1, 1)
SMPL_PARENTS = (-1, 0, 0, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 9, 9, 12, 13, 14, 16, 17, 18, 19, 20, 21)
ROWS, COLUMNS = 7, 9
IDENTITY, EXPRESSIONS = 4, 3
FRAMES = 5


def sheet() -> Array:
    """Triangles [F, 3] of a strip of ROWS x COLUMNS points without any symmetry: one corner is cut off."""
    at = np.arange(ROWS * COLUMNS).reshape(ROWS, COLUMNS)
    a, b, c, d = at[:-1, :-1].ravel(), at[1:, :-1].ravel(), at[1:, 1:].ravel(), at[:-1, 1:].ravel()
    return np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)])[1:-3]


def body(parents: tuple[int, ...], seed: int = 5) -> dict[str, Array]:
    """Random arrays of a body model, metres; names as in oracles.lbs."""
    rng = np.random.default_rng(seed)
    v, j = ROWS * COLUMNS, len(parents)
    return {
        "v_template": rng.normal(0, 0.3, (v, 3)).astype("f4"),
        "triangles": sheet(),
        "identity": rng.normal(0, 0.02, (v, 3, IDENTITY)).astype("f4"),
        "expression": rng.normal(0, 0.02, (v, 3, EXPRESSIONS)).astype("f4"),
        "posedirs": rng.normal(0, 0.005, (v, 3, 9 * (j - 1))).astype("f4"),
        "regressor": rng.dirichlet(np.ones(v), j).astype("f4"),
        "weights": rng.dirichlet(np.ones(j), v).astype("f4"),
        "parents": np.array(parents),
    }


STORED = {
    "triangles": "f", "regressor": "J_regressor",
    "identity": "shapedirs_identity", "expression": "shapedirs_expression",
}  # fmt: skip


def write_body(path: Path, model: dict[str, Array]) -> Path:
    np.savez(path, **{STORED.get(name, name): array for name, array in model.items()})
    return path


def poses(joints: int, seed: int = 9) -> dict[str, Array]:
    """Shape, expressions, rotations and translations of FRAMES frames."""
    rng = np.random.default_rng(seed)
    return {
        "shape": rng.normal(0, 1, IDENTITY),
        "expression": rng.normal(0, 1, (FRAMES, EXPRESSIONS)),
        "rotation": rng.normal(0, 0.4, (FRAMES, joints, 3)),
        "translation": rng.normal(0, 0.5, (FRAMES, 3)),
    }


def flame_json(path: Path, p: dict[str, Array]) -> Path:
    frames = [
        {
            "file_path": f"./image/{t}",
            "expression": expression.tolist(),
            "pose": p["rotation"][t].reshape(-1).tolist(),
        }
        for t, expression in enumerate(p["expression"])
    ]
    path.write_text(json.dumps({"shape_params": p["shape"].tolist(), "frames": frames}))
    return path


def smpl_npz(path: Path, p: dict[str, Array], split: bool) -> Path:
    thetas = p["rotation"].reshape(-1, 72).astype("f4")
    pose = {"global_orient": thetas[:, :3], "body_pose": thetas[:, 3:]} if split else {"thetas": thetas}
    np.savez(path, betas=p["shape"][None].astype("f4"), transl=p["translation"].astype("f4"), **pose)
    return path


def flame_param(path: Path, p: dict[str, Array], static_offset: Array) -> Path:
    r = p["rotation"]
    arrays = {
        "shape": p["shape"],
        "expr": p["expression"],
        "translation": p["translation"],
        "rotation": r[:, 0],
    }
    arrays |= {"neck_pose": r[:, 1], "jaw_pose": r[:, 2], "eyes_pose": r[:, 3:].reshape(-1, 6)}
    arrays |= {
        "static_offset": static_offset[None],
        "dynamic_offset": np.zeros((len(r), *static_offset.shape)),
    }
    np.savez(path, **{name: array.astype("f4") for name, array in arrays.items()})
    return path
