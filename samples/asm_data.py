"""Three heads as ASM templates, from data/asm_*.npz, and true scans made of identity shapes.

    python -m samples.asm_data SOURCE [NAME ...]     how the files were made; run by hand, not part of any build

SOURCE holds head/ (ict_lps_head.npz, ict_identity20.npz, ict_vertex_indices.json, lee_perry_smith.glb) and body/
(rocketbox_female_01_facial.fbx). Templates are made by `avatar_trainer.systems.asm_template`; their first weights are
stored with their eight largest of a vertex, their first mixtures for every K of COMPONENTS.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from avatar_export.asm.model import Binding, Template
from avatar_trainer.systems.asm_place import skeleton
from avatar_trainer.systems.asm_template import initial_binding, make_template

Array = npt.NDArray[Any]
DATA = Path(__file__).parent / "data"
COMPONENTS = (2, 3, 4, 5)
KEPT = 8  # weights of a vertex
SKIN = ("M_Face", "M_BackHead")


@dataclass(frozen=True)
class AsmHead:
    """A topology ready to be fitted."""

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
    """`ict` (14,062 vertices), `rocketbox` (a low-poly game head) or `lee_perry_smith` (a scan as it is)."""
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


def save_asm_head(name: str, template: Template, weights: Array, identity: Array | None) -> None:
    """Write data/asm_NAME.npz; `identity` f16 [M, V, 3] in centimetres."""
    bone = np.sort(np.argsort(-weights, axis=1, kind="stable")[:, :KEPT], axis=1)
    data = {
        "vertices": template.vertices,
        "triangles": template.triangles.astype(np.uint16),
        "uv": template.uv,
        "landmarks": np.array([template.landmarks[f"ibug_{k}"] for k in range(68)], np.uint16),
        "rest_position": template.rest_position,
        "anchor_vertex": template.anchor_vertex.astype(np.uint16),
        "weight_bone": bone.astype(np.uint8),
        "weight": np.take_along_axis(weights, bone, axis=1).astype(np.float16),
    }
    assert template.colour is not None
    data["colour"] = np.round(template.colour * 255).astype(np.uint8)
    for k in COMPONENTS:
        binding = initial_binding(template, weights, k)
        data |= {f"{part}_{k}": getattr(binding, part) for part in ("pi", "mu", "covariance")}
    if identity is not None:
        data["identity"] = identity
    np.savez_compressed(DATA / f"asm_{name}.npz", **data)


def make_ict(source: Path) -> None:
    """The skin of ICT-FaceKit's generic head, with 20 identity shapes."""
    with np.load(source / "head" / "ict_lps_head.npz", allow_pickle=False) as file:
        names = file["part_names"].tolist()
        skin = np.isin(file["part"], [names.index(n) for n in SKIN])
        triangles, vertices = file["triangles"][skin].astype(np.int64), file["generic_vertices"]
        colour = file["vertex_colors"]
    with np.load(source / "head" / "ict_identity20.npz", allow_pickle=False) as file:
        identity = file["identity"]
    size = int(triangles.max()) + 1  # the skin's vertices come first
    marks = json.loads((source / "head" / "ict_vertex_indices.json").read_text())["idx_to_landmark_verts"]
    template, weights = make_template(
        vertices[:size].astype(np.float64) / 100, triangles, None, np.array(marks), colour[:size] / 255
    )
    save_asm_head("ict", template, weights, identity[:, :size])


MAKERS: dict[str, Callable[[Path], None]] = {"ict": make_ict}


def main() -> None:
    source, *names = sys.argv[1:]
    for name in names or MAKERS:
        MAKERS[name](Path(source))


if __name__ == "__main__":
    main()
