"""Three heads as ASM templates, from data/asm_*.npz, and true scans made of identity shapes.

`python -m samples.asm.data ict -o template.npz` writes one for `avatar-train asm`.
"""

from __future__ import annotations

import argparse
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from avatar_export.asm.files import save
from avatar_export.asm.model import Binding, Template
from avatar_trainer.asm.template.files import at_rest
from avatar_trainer.asm.template.place import skeleton

Array = npt.NDArray[Any]
DATA = Path(__file__).parents[1] / "data"
COMPONENTS = (2, 3, 4, 5)
TOPOLOGIES = ("ict", "rocketbox", "lee_perry_smith")


@dataclass(frozen=True)
class AsmHead:
    """A topology to fit with."""

    name: str
    template: Template
    weights: npt.NDArray[np.float32]  # [V, J] first weights
    bindings: dict[int, Binding]  # first mixtures by their number of components
    identity: npt.NDArray[np.float32]  # [M, V, 3] metres for one standard deviation; M is 0 but for `ict`

    def scan(self, coefficients: Array) -> npt.NDArray[np.float32]:
        """Vertices [V, 3] metres of another person: `coefficients` [M] in standard deviations."""
        moved = np.tensordot(coefficients, self.identity[: len(coefficients)], axes=1)
        return (self.template.vertices + moved).astype(np.float32)


def load_asm_head(name: str) -> AsmHead:
    """`ict` (14,062 vertices), `rocketbox` (a low-poly game head) or `lee_perry_smith` (an unmodified scan)."""
    with np.load(DATA / f"asm_{name}.npz", allow_pickle=False) as file:
        data = {key: file[key] for key in file.files}
    bones = skeleton()
    template = Template(
        vertices=data["vertices"],
        triangles=data["triangles"].astype(np.uint32),
        uv=data["uv"],
        bone_names=bones.names,
        parents=bones.parents,
        rest_position=data["rest_position"],
        rest_linear=np.tile(np.eye(3, dtype=np.float32), (len(bones.names), 1, 1)),
        anchor_vertex=data["anchor_vertex"].astype(np.uint32),
        colour=data["colour"].astype(np.float32) / 255,
        landmarks={f"ibug_{k}": int(v) for k, v in enumerate(data["landmarks"])},
    )
    weights = np.zeros((len(template.vertices), len(bones.names)), np.float32)
    np.put_along_axis(
        weights, data["weight_bone"].astype(np.int64), data["weight"].astype(np.float32), axis=1
    )
    weights /= weights.sum(axis=1, keepdims=True)
    zeta = template.uv[template.anchor_vertex].astype(np.float64)
    bindings = {
        k: Binding(zeta, *(data[f"{part}_{k}"].astype(np.float64) for part in ("pi", "mu", "covariance")))
        for k in COMPONENTS
    }
    identity = (
        data["identity"].astype(np.float32) / 100
        if "identity" in data
        else np.zeros((0, *template.vertices.shape), np.float32)
    )
    return AsmHead(name, template, weights, bindings, identity)


def main() -> None:
    """The command."""
    parser = argparse.ArgumentParser(prog="python -m samples.asm.data", description=__doc__)
    parser.add_argument("name", choices=TOPOLOGIES)
    parser.add_argument("-o", "--out", type=Path, required=True)
    parser.add_argument("--components", type=int, choices=COMPONENTS, default=COMPONENTS[0])
    given = parser.parse_args()
    head = load_asm_head(given.name)
    save(at_rest(head.name, head.template, head.bindings[given.components]), given.out)


if __name__ == "__main__":
    main()
