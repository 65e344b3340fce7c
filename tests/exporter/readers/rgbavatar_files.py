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
LINEAR, DEEP = (INPUTS, BASES), (INPUTS, HIDDEN, HIDDEN, BASES)


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
    parameters = rng.normal(0, 0.1, sum((a + 1) * b for a, b in pairwise(DEEP if deep else LINEAR)))
    columns: dict[str, Array] = {}
    for prefix, names, mean, spread in (
        ("", "xyz", 0, 0.01), ("n", "xyz", 0, 0), ("opacity", ("",), 0, 2), ("scale_", range(3), -5, 1),
        ("rot_", range(4), 0, 1), ("f_dc_", range(3), 0, 1), ("f_rest_", range(45), 0, 0),
        ("xyz_b_", range(3 * BASES), 0, 0.005), ("rot_b_", range(4 * BASES), 0, 0.1),
        ("f_dc_b_", range(3 * BASES), 0, 0.2),
    ):  # fmt: skip
        columns |= {f"{prefix}{name}": rng.normal(mean, spread, rows) for name in names}
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


def ply(columns: dict[str, Array], face: Array) -> bytes:
    kinds = [(name, "<f4") for name in columns] + [("face_id", "<i4")]
    rows = np.zeros(len(face), kinds)
    for name, values in {**columns, "face_id": face}.items():
        rows[name] = values
    header = ["ply", "format binary_little_endian 1.0", f"element vertex {len(rows)}"]
    header += [f"property {'int' if kind == '<i4' else 'float'} {name}" for name, kind in kinds]
    return "\n".join([*header, "end_header", ""]).encode() + rows.tobytes()


def row(made: Run, n: int) -> dict[str, Array]:
    """One Gaussian, for the oracle."""

    def of(*names: str, shape: tuple[int, ...] = (-1,)) -> Array:
        return np.array([made.columns[name][n] for name in names], np.float64).reshape(shape)

    found = {"mean": of(*"xyz")}
    for key, prefix, shape in (
        ("quat", "rot_", (4,)), ("dc", "f_dc_", (3,)), ("bary", "face_bary_", (3,)),
        ("mean_basis", "xyz_b_", (BASES, 3)), ("quat_basis", "rot_b_", (BASES, 4)),
        ("dc_basis", "f_dc_b_", (BASES, 3)),
    ):  # fmt: skip
        found[key] = of(*(f"{prefix}{k}" for k in range(np.prod(shape))), shape=shape)
    return found
