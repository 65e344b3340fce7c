"""ASM's Table 6 at a small size: `python -m tests.bench.asm_views OUT [--identities N]`.

Faces fitted to 3, 5, 10 and 20 uncalibrated pictures of heads that the template is not (samples.capture_views), with
K = 2 and 5. The error is the 3D-RMSE of the facial region, the truth's vertices within 95 mm of the tip of its nose:
each one's distance to the fitted surface, after the similarity that makes the sum of their squares least, in the
truth's millimetres. It takes the scale away, which pictures without a known length cannot tell.
"""

from __future__ import annotations

import argparse
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from PIL import Image

from avatar_export.asm.model import Binding, Template
from avatar_runtime.camera import Camera
from avatar_trainer.captures.mesh_raster import Surface, draw
from avatar_trainer.kernels.closest import TriangleTree, nearest, triangle_tree
from avatar_trainer.machine import reproducible
from avatar_trainer.systems.asm_align import Placement, placed_by_pairs
from avatar_trainer.systems.asm_views import ViewSettings, fit
from avatar_trainer.systems.asm_views_files import Views, read
from samples.asm_data import load_asm_head
from samples.capture_views import write_views

Array = npt.NDArray[Any]

COUNTS, COMPONENTS, SIZE = (3, 5, 10, 20), (2, 5), 384
ROUNDS = 30  # of placing by nearest points
WORST_MM = 4.0  # the red end of the picture's scale
ABLATIONS = {
    "without photometric consistency": {"photometric": 0.0},
    "without edges": {"edge": 0.0},
    "landmarks alone": {"photometric": 0.0, "edge": 0.0},
}


@dataclass(frozen=True)
class Truth:
    """What the pictures show."""

    vertices: Array  # [V, 3] metres
    triangles: Array
    facial: Array  # bool [V]
    landmarks: Array  # [68] vertices

    @staticmethod
    def of(folder: Path) -> Truth:
        with np.load(folder / "truth.npz", allow_pickle=False) as file:
            return Truth(file["vertices"], file["triangles"], file["facial"], file["landmarks"])


def placed(truth: Truth, vertices: Array, tree: TriangleTree, landmarks: Array) -> tuple[Placement, Array]:
    """(the similarity that brings the truth's facial region to the mesh, its vertices' distances in true metres)."""
    points = truth.vertices[truth.facial]
    placement = placed_by_pairs(truth.vertices[truth.landmarks], vertices[landmarks], similarity=True)
    for _ in range(ROUNDS):
        found = nearest(placement.apply(points), vertices, tree)
        foot = np.einsum("nk,nkx->nx", found.barycentric, vertices[tree.triangles[found.triangle]])
        placement = placed_by_pairs(points, foot, similarity=True)
    squared = nearest(placement.apply(points), vertices, tree).squared_distance
    return placement, np.sqrt(squared) / placement.scale


def rmse_mm(truth: Truth, template: Template, vertices: Array) -> float:
    """The 3D-RMSE of a fit with the template's topology, millimetres."""
    tree = triangle_tree(vertices, template.triangles.astype(np.int64))
    _, distance = placed(truth, vertices, tree, marks(template))
    return float(1e3 * np.sqrt(np.mean(distance**2)))


def marks(template: Template) -> Array:
    """[68] the template's vertices of the landmarks, in the truth's order."""
    return np.array([template.landmarks[f"ibug_{i}"] for i in range(68)])


@dataclass(frozen=True)
class Subject:
    """One person."""

    views: Views
    truth: Truth


def measured(
    subject: Subject, template: Template, binding: Binding, count: int, settings: ViewSettings
) -> tuple[float, float, Array]:
    """(RMSE in mm, CPU seconds, fitted vertices) from the first `count` views."""
    start = time.process_time()
    found = fit(template, binding, subject.views.chosen(np.arange(count)), settings)
    seconds = time.process_time() - start
    return rmse_mm(subject.truth, template, found.vertices), seconds, found.vertices


def picture(out: Path, truth: Truth, template: Template, vertices: Array) -> None:
    """truth | fitted | error, from in front: blue none, red WORST_MM and more."""
    triangles = template.triangles.astype(np.int64)
    tree = triangle_tree(vertices, triangles)
    placement, distance = placed(truth, vertices, tree, marks(template))
    back = placement.inverse().apply(vertices)
    error = np.zeros(len(truth.vertices))
    error[truth.facial] = distance
    level = np.clip(1e3 * error / WORST_MM, 0, 1)[:, None]
    heat = np.concatenate([level, 0.35 * np.ones_like(level), 1 - level], axis=1)
    grey = np.full((1, 3), 0.75)
    panels = [
        _drawn(truth.vertices, truth.triangles, np.repeat(grey, len(truth.vertices), 0)),
        _drawn(back, triangles, np.repeat(grey, len(back), 0)),
        _drawn(truth.vertices, truth.triangles, np.where(truth.facial[:, None], heat, grey)),
    ]
    Image.fromarray(np.concatenate(panels, axis=1)).save(out)


def _drawn(vertices: Array, triangles: Array, colour: Array) -> Array:
    """[H, W, 3] 8 bits: the mesh with a colour a vertex, lit from the side."""
    corner = vertices[triangles]
    area = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    normal = np.zeros_like(vertices)
    for k in range(3):
        np.add.at(normal, triangles[:, k], area)
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-30)
    light = 0.25 + 0.75 * np.clip(normal @ np.array([0.5, 0.4, 0.77]), 0, 1)
    camera = Camera.orbit(np.array([0.0, 0.0, 0.03]), 0.8, 0.5, 0.0, 0.36, SIZE, SIZE)
    layers = []
    for channel in range(3):  # a surface has one gain a vertex
        surface = Surface(
            vertices,
            triangles,
            np.zeros((len(triangles), 3, 2), np.float32),
            np.ones((1, 1, 3), np.float32),
            (light * colour[:, channel]).astype(np.float32),
            np.zeros(len(vertices), np.float32),
            np.ones(len(vertices), np.float32),
        )
        found = draw(surface, camera, 2)
        layers.append(found.colour[..., 0] * found.alpha)
    result: Array = np.round(255 * np.clip(np.stack(layers, axis=-1), 0, 1)).astype(np.uint8)
    return result


def main() -> None:
    """The command."""
    parser = argparse.ArgumentParser(prog="python -m tests.bench.asm_views", description=__doc__)
    parser.add_argument("out", type=Path, help="folder for the captures and pictures")
    parser.add_argument("--identities", type=int, default=2)
    parser.add_argument("--iterations", type=int, default=ViewSettings().iterations)
    given = parser.parse_args()
    head, usual = load_asm_head("ict"), ViewSettings(iterations=given.iterations)
    subjects = []
    for identity in range(given.identities):
        folder = given.out / f"identity_{identity}"
        if not (folder / "views.json").is_file():
            write_views(folder, max(COUNTS), identity, SIZE, noise=1.0)
        subjects.append(Subject(read(folder), Truth.of(folder)))
    first = [rmse_mm(s.truth, head.template, head.template.vertices.astype(np.float64)) for s in subjects]
    print(f"3D-RMSE in mm, mean of {len(subjects)} identities (each); the template itself: {_row(first)}")
    with reproducible(0, threads=0):
        for count in COUNTS:
            for k in COMPONENTS:
                rows = [measured(s, head.template, head.bindings[k], count, usual) for s in subjects]
                print(
                    f"{count:3d} views  K={k}  {_row([r[0] for r in rows])}  {rows[0][1]:.0f} s CPU",
                    flush=True,
                )
                if count == max(COUNTS):
                    for i, (subject, row) in enumerate(zip(subjects, rows, strict=True)):
                        picture(given.out / f"identity_{i}_k{k}.png", subject.truth, head.template, row[2])
        for label, changed in ABLATIONS.items():
            settings = ViewSettings(iterations=given.iterations, **changed)
            errors = [measured(s, head.template, head.bindings[2], 10, settings)[0] for s in subjects]
            print(f" 10 views  K=2, {label}  {_row(errors)}", flush=True)


def _row(errors: list[float]) -> str:
    return f"{np.mean(errors):.3f} ({', '.join(f'{e:.3f}' for e in errors)})"


if __name__ == "__main__":
    main()
