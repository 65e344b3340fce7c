"""How data/asm_*.npz were made; run by hand, not part of any build.

    python -m samples.by_hand.asm_make SOURCE [NAME ...]

SOURCE holds head/ (ict_lps_head.npz, ict_identity20.npz, ict_vertex_indices.json, lee_perry_smith.glb and its
image) and body/ (rocketbox_female_01_facial.fbx). Templates are made by `avatar_trainer.asm.template.make`; of
their first weights the eight largest of a vertex are stored, of their first mixtures those of every K of COMPONENTS.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from avatar_export.asm.model import Template
from avatar_export.formats.fbx.file import open_fbx
from avatar_trainer.asm.template.make import initial_binding, make_template
from avatar_trainer.asm.template.unwrap import weld
from samples.asm.data import COMPONENTS, DATA
from samples.by_hand.texture_scan import load_scan

Array = npt.NDArray[Any]

KEPT = 8  # weights of a vertex
SKIN = ("M_Face", "M_BackHead")
SCAN_BOTTOM = -17.0  # centimetres; the scan's shoulders are cut off there, like those of ICT
# The game head: where it is cut off the body, metres, and iBUG's landmarks, chosen by eye.
COLLAR, COLLAR_SLOPE = 1.487, 0.25  # kept above y + slope z
TAIL = 0.237  # behind the tip of the nose
GAME_SKIN = (0.78, 0.60, 0.50)  # flat
GAME_LANDMARKS = (
    172, 182, 209, 205, 223, 282, 331, 427, 684, 931, 1022, 1067, 1123, 1145, 1160, 1168, 1179,
    216, 253, 323, 403, 579, 783, 951, 1031, 1093, 1134, 715, 644, 646, 710, 511, 600, 708, 762, 842,
    269, 308, 383, 425, 354, 309, 929, 971, 1049, 1077, 1048, 999,
    385, 468, 578, 703, 786, 889, 969, 885, 771, 654, 590, 474, 419, 592, 694, 768, 936, 782, 680, 580,
)  # fmt: skip


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


def make_rocketbox(source: Path) -> None:
    """The head of a game figure, cut off above the collar, without hair; a flat colour."""
    mesh = open_fbx(source / "body" / "rocketbox_female_01_facial.fbx").meshes[0]
    figure = weld(mesh.vertices[:, [0, 2, 1]] * (0.01, 0.01, -0.01), mesh.triangles)
    place, corners = largest_piece(figure.vertices, figure.triangles)
    place, corners = kept_part(place, corners, place[:, 1] > 1.40)
    above = place[:, 1] + COLLAR_SLOPE * place[:, 2] > COLLAR
    vertices, triangles = kept_part(place, corners, above & (place[:, 2] > place[:, 2].max() - TAIL))
    vertices, triangles = without_pinches(vertices, triangles)
    colour = np.tile(np.float32(GAME_SKIN), (len(vertices), 1))
    vertices = vertices - (0, np.mean(vertices[:, 1]), 0)
    template, weights = make_template(vertices, triangles, None, np.array(GAME_LANDMARKS), colour)
    save_asm_head("rocketbox", template, weights, None)


def make_lee_perry_smith(source: Path) -> None:
    """The scan without its shoulders; landmarks are the vertices nearest to those of the registered head."""
    with np.load(source / "head" / "ict_lps_head.npz", allow_pickle=False) as file:
        registered = file["vertices"].astype(np.float64)
    marks = json.loads((source / "head" / "ict_vertex_indices.json").read_text())["idx_to_landmark_verts"]
    scan = load_scan(source / "head", registered)
    height, width = scan.image.shape[:2]
    column = np.clip(scan.uv[:, 0] * width, 0, width - 1).astype(int)
    row = np.clip(scan.uv[:, 1] * height, 0, height - 1).astype(int)
    mesh = weld(scan.vertices, scan.triangles)
    colour = np.zeros((len(mesh.vertices), 3))
    colour[mesh.row] = scan.image[row, column]
    vertices, triangles = kept_part(mesh.vertices, mesh.triangles, mesh.vertices[:, 1] > SCAN_BOTTOM)
    vertices, triangles = without_pinches(vertices, triangles)
    apart = np.linalg.norm(vertices - registered[marks][:, None], axis=2)
    origin = np.linalg.norm(mesh.vertices[None] - vertices[:, None], axis=2).argmin(axis=1)
    template, weights = make_template(vertices / 100, triangles, None, apart.argmin(axis=1), colour[origin])
    save_asm_head("lee_perry_smith", template, weights, None)


def kept_part(vertices: Array, triangles: Array, kept: Array) -> tuple[Array, Array]:
    """(vertices, triangles) of the triangles whose corners are all of the mask `kept` [V], unused vertices left out."""
    triangles = triangles[kept[triangles].all(axis=1)]
    used, flat = np.unique(triangles, return_inverse=True)
    return vertices[used], flat.reshape(-1, 3)


def largest_piece(vertices: Array, triangles: Array) -> tuple[Array, Array]:
    """The connected piece with most triangles."""
    label = np.arange(len(vertices))
    while True:
        spread = label.copy()
        for corner in triangles.T:
            np.minimum.at(spread, corner, label[triangles].min(axis=1))
        spread = spread[spread]
        if np.array_equal(spread, label):
            break
        label = spread
    return kept_part(vertices, triangles, label == np.bincount(label[triangles[:, 0]]).argmax())


def without_pinches(vertices: Array, triangles: Array) -> tuple[Array, Array]:
    """The mesh's largest piece, without triangles at non-manifold edges or at vertices where borders touch."""
    while True:
        count = len(vertices)
        edge = np.concatenate([triangles[:, [i, (i + 1) % 3]] for i in range(3)])
        of_triangle = np.tile(np.arange(len(triangles)), 3)
        key, back = edge[:, 0] * count + edge[:, 1], edge[:, 1] * count + edge[:, 0]
        _, row, times = np.unique(key, return_inverse=True, return_counts=True)
        _, undirected, users = np.unique(np.minimum(key, back), return_inverse=True, return_counts=True)
        bad = np.zeros(len(triangles), bool)
        bad[of_triangle[(times[row] > 1) | (users[undirected] > 2)]] = True
        if not bad.any():
            start, leaving = np.unique(edge[~np.isin(key, back), 0], return_counts=True)
            bad = np.isin(triangles, start[leaving > 1]).any(axis=1)
        if not bad.any():
            return largest_piece(vertices, triangles)
        triangles = triangles[~bad]


MAKERS: dict[str, Callable[[Path], None]] = {
    "ict": make_ict,
    "rocketbox": make_rocketbox,
    "lee_perry_smith": make_lee_perry_smith,
}


def main() -> None:
    source, *names = sys.argv[1:]
    for name in names or MAKERS:
        MAKERS[name](Path(source))


if __name__ == "__main__":
    main()
