"""A small RGBAvatar run on a small body of FLAME's layout, written field by field."""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from tests.exporter.bodies import body_files

Array = npt.NDArray[Any]

BASES = 3
INPUTS, HIDDEN = 129, 128


@dataclass
class Run:
    """The arrays of a run; change them before `write`."""

    body: dict[str, Array]
    lids: Array  # [2, V, 3]
    uvs: Array  # [F * 3, 2]
    columns: dict[str, Array]
    face: Array
    config: str = ""
    left_out: set[str] = field(default_factory=set)  # arrays that the body's file lacks

    def write(self, folder: Path) -> tuple[Path, Path]:
        """(the run folder, the body's .npz)"""
        folder.mkdir()
        (folder / "model.ply").write_bytes(ply(self.columns, self.face))
        if self.config:
            (folder / "config.yaml").write_text(self.config)
        body = body_files.write_body(folder / "body.npz", self.body)
        arrays = dict(np.load(body))
        arrays |= {"uvs": self.uvs, "uv_faces": np.arange(len(self.uvs)).reshape(-1, 3)}
        arrays |= {"l_eyelid": self.lids[:1], "r_eyelid": self.lids[1]}
        np.savez(body, **{name: array for name, array in arrays.items() if name not in self.left_out})
        return folder, body


def run(*, deep: bool = False, rigid: bool = False, rows: int = 420, seed: int = 3) -> Run:
    """`rigid`: every vertex follows one joint, and nothing but the bases moves a mesh at rest."""
    rng = np.random.default_rng(seed)
    body = body_files.body(body_files.FLAME_PARENTS)
    v, f = len(body["v_template"]), len(body["triangles"])
    lids = rng.normal(0, 0.01, (2, v, 3))
    if rigid:
        body["weights"] = np.eye(5, dtype="f4")[np.repeat([1, 2], [v // 2, v - v // 2])]
        for name in ("posedirs", "expression", "identity"):
            body[name] = np.zeros_like(body[name])
        lids *= 0
    if deep:
        rows = 33_600
    face = rng.integers(0, f, rows)
    if rigid:
        first = body["triangles"][:, :1] < v // 2
        whole = np.flatnonzero((first == (body["triangles"] < v // 2)).all(axis=1))
        face = whole[face % len(whole)]
    uvs = rng.uniform(0, 1, (3 * f, 2))
    parameters = module(rng, deep)
    columns = {name: rng.normal(0, 0.01, rows) for name in ("x", "y", "z")}
    columns |= {name: np.zeros(rows) for name in ("nx", "ny", "nz")}
    columns["opacity"] = rng.normal(0, 2, rows)
    columns |= {f"scale_{k}": rng.normal(-5, 1, rows) for k in range(3)}
    columns |= {f"rot_{k}": rng.normal(0, 1, rows) for k in range(4)}
    columns |= {f"f_dc_{k}": rng.normal(0, 1, rows) for k in range(3)}
    columns |= {f"f_rest_{k}": np.zeros(rows) for k in range(45)}
    columns |= {f"xyz_b_{k}": rng.normal(0, 0.005, rows) for k in range(3 * BASES)}
    columns |= {f"rot_b_{k}": rng.normal(0, 0.1, rows) for k in range(4 * BASES)}
    columns |= {f"f_dc_b_{k}": rng.normal(0, 0.2, rows) for k in range(3 * BASES)}
    columns["weight_module"] = np.pad(parameters, (0, rows - len(parameters)))
    columns |= {f"face_bary_{k}": column for k, column in enumerate(rng.dirichlet(np.ones(3), rows).T)}
    return Run(body, lids, uvs, {name: c.astype("f4") for name, c in columns.items()}, face)


def charts(body: dict[str, Array]) -> Array:
    """[F * 3, 2] each triangle's own chart, sheared by a fifth."""
    corner = body["v_template"].astype(np.float64)[body["triangles"]]
    e1, e2 = corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]
    x = e1 / np.linalg.norm(e1, axis=1, keepdims=True)
    y = e2 - np.sum(e2 * x, axis=1, keepdims=True) * x
    y /= np.linalg.norm(y, axis=1, keepdims=True)
    along = np.stack([np.einsum("fcx,fx->fc", corner, axis) for axis in (x, y)], axis=-1)
    along[..., 0] += 0.2 * along[..., 1]
    return along.reshape(-1, 2)


def module(rng: np.random.Generator, deep: bool) -> Array:
    widths = (INPUTS, HIDDEN, HIDDEN, BASES) if deep else (INPUTS, BASES)
    count = sum((a + 1) * b for a, b in pairwise(widths))
    return rng.normal(0, 0.1, count)


def ply(columns: dict[str, Array], face: Array) -> bytes:
    kinds = [(name, "<f4") for name in columns if name] + [("face_id", "<i4")]
    rows = np.zeros(len(face), kinds)
    for name, values in columns.items():
        rows[name] = values
    rows["face_id"] = face
    header = ["ply", "format binary_little_endian 1.0", f"element vertex {len(rows)}"]
    header += [f"property {'int' if kind == '<i4' else 'float'} {name}" for name, kind in kinds]
    return "\n".join([*header, "end_header", ""]).encode() + rows.tobytes()


def row(made: Run, n: int) -> dict[str, Array]:
    """One Gaussian, for the oracle."""

    def of(prefix: str, count: int) -> Array:
        return np.array([made.columns[f"{prefix}{k}"][n] for k in range(count)], np.float64)

    return {
        "mean": np.array([made.columns[name][n] for name in "xyz"], np.float64),
        "quat": of("rot_", 4),
        "dc": of("f_dc_", 3),
        "mean_basis": of("xyz_b_", 3 * BASES).reshape(BASES, 3),
        "quat_basis": of("rot_b_", 4 * BASES).reshape(BASES, 4),
        "dc_basis": of("f_dc_b_", 3 * BASES).reshape(BASES, 3),
        "bary": of("face_bary_", 3),
    }
