"""Makes the head model and the heads of films from ICT-FaceKit: `python -m tools.ict_head ICT_FOLDER`.

ICT_FOLDER is a checkout of github.com/USC-ICT/ICT-FaceKit. It writes trainer/avatar_trainer/head/data/head_model.npz
and samples/data/film_heads.npz, prints the sha256 of both, and changes nothing else. The expressions are those that
head_model.npz holds already: ICT's, but smoothed along the rims of the lids. It prints how many vertices that are.
"""

from __future__ import annotations

import hashlib
import sys
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from avatar_trainer.head import head_arrays

Array = npt.NDArray[Any]

ROOT = Path(__file__).parents[1]
MODEL = ROOT / "trainer/avatar_trainer/head/data/head_model.npz"
FILMS = ROOT / "samples/data/film_heads.npz"
# Vertices of ICT-FaceKit by its README, without the irises (behind the scleras), fluids, occlusions and lashes.
ROWS = np.r_[0:22221, 23021:23791]
# A triangle is of the part in whose range its last vertex lies: face, head, mouth socket, both eye sockets, gums, upper
# teeth, lower teeth, left eye. Of the gums it is a lower one if two of its corners move with the jaw.
ENDS = (9409, 11248, 13294, 14062, 17039, 19247, 21451, 23021)
UPPER_GUMS, MOVES = 4, 0.5  # cm
WHOLE, HALVES = ("jawLeft", "jawRight", "mouthLeft", "mouthRight"), ("browInnerUp", "cheekPuff")
MODES, ALL_MODES = 60, 100
SUBJECTS, SEED = 8, 34
ROUNDED = 2.5e-3  # cm: offsets below 0.001 are left out, others are f16


def main(folder: Path) -> None:
    """Write both files."""
    meshes = folder / "FaceXModel"
    generic, polygons = read_obj(meshes / "generic_neutral_mesh.obj")
    neutral = generic[ROWS]
    modes = np.stack([read_obj(meshes / f"identity{k:03}.obj")[0][ROWS] - neutral for k in range(ALL_MODES)])
    stored = head_arrays()
    triangles, part = topology(polygons, read_obj(meshes / "jawOpen.obj")[0] - generic)
    print(f"expressions: {smoothed(meshes, generic, stored)} vertices differ from ICT-FaceKit's")
    kept: dict[str, Any] = {
        name: stored[name] for name in stored if name.startswith(("part_", "expression_"))
    }
    np.savez_compressed(
        MODEL,
        neutral=neutral.astype(np.float32),
        triangles=triangles.astype(np.uint16),
        part=part.astype(np.uint8),
        **kept,
        identity=modes[:MODES].astype(np.float32).astype(np.float16),
    )
    coefficients = np.random.default_rng(SEED).normal(size=(SUBJECTS, ALL_MODES)).astype(np.float32)
    heads = neutral + np.tensordot(coefficients.astype(np.float64), modes, 1)
    np.savez_compressed(
        FILMS, vertices=heads.astype(np.float16), coefficients=coefficients, unit=np.array("centimetre")
    )
    for path in (MODEL, FILMS):
        print(hashlib.sha256(path.read_bytes()).hexdigest(), path.relative_to(ROOT), path.stat().st_size)


def read_obj(path: Path) -> tuple[Array, list[list[int]]]:
    """(vertices f64 [V, 3], the vertices of each polygon)."""
    lines = [line.split() for line in path.read_text("ascii").splitlines()]
    vertices = np.array([line[1:4] for line in lines if line[:1] == ["v"]], np.float64)
    return vertices, [[int(c.split("/")[0]) - 1 for c in line[1:]] for line in lines if line[:1] == ["f"]]


def topology(polygons: list[list[int]], jaw_open: Array) -> tuple[Array, Array]:
    """(triangles [F, 3] of ROWS, their parts [F]); polygons become fans. jaw_open: offsets [V, 3] of all vertices."""
    fans = np.array([(p[0], *p[k : k + 2]) for p in polygons for k in range(1, len(p) - 1)])
    fans = fans[np.isin(fans, ROWS).all(axis=1)]
    part = np.searchsorted(ENDS, fans.max(axis=1), side="right")
    lower = np.median(np.linalg.norm(jaw_open[fans], axis=2), axis=1) > MOVES
    part += (part > UPPER_GUMS) | ((part == UPPER_GUMS) & lower)
    return np.searchsorted(ROWS, fans), part


def ict_names(name: str) -> list[str]:
    """ICT-FaceKit's meshes whose offsets are added to the ARKit shape `name`."""
    for side in ("Left", "Right"):
        if name.endswith(side) and name not in WHOLE:
            return [f"{name.removesuffix(side)}_{side[0]}"]
    return [f"{name}_L", f"{name}_R"] if name in HALVES else [name]


def smoothed(meshes: Path, generic: Array, stored: dict[str, Array]) -> int:
    """How many vertices have an offset in the stored expressions that is not ICT's."""
    other = np.zeros(len(ROWS), bool)
    ptr = stored["expression_ptr"]
    for k, name in enumerate(stored["expression_names"].tolist()):
        offsets = np.sum([read_obj(meshes / f"{ict}.obj")[0] - generic for ict in ict_names(name)], axis=0)[
            ROWS
        ]
        rows = slice(ptr[k], ptr[k + 1])
        offsets[stored["expression_index"][rows]] -= stored["expression_offset"][rows]
        other |= np.linalg.norm(offsets, axis=1) > ROUNDED
    return int(other.sum())


if __name__ == "__main__":
    main(Path(sys.argv[1]))
