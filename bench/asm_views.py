"""ASM's Table 6 at a small size: `python -m bench.asm_views OUT [--identities N]`.

Faces fitted to 3, 5, 10 and 20 uncalibrated images of heads that the template is not (samples.capture.views), with
K = 2 and 5. The error is the 3D-RMSE of the facial region, the truth's vertices within 95 mm of the tip of its nose
that can be seen from outside: each one's distance to the fitted surface, in the truth's millimetres, after a similarity
that brings the truth to the fit. It takes the scale away, which images without a known length do not show. The sum
of squares that it makes small is that in the fit's unit; ROUNDS of nearest points are within 0.1 % of converged.

Easier than photographs: landmarks are the same points of the mesh in every image and on the template, those of the
contour too, where a detector's slide along it (noise of a pixel is added); K is exact; nothing shines.
"""

from __future__ import annotations

import argparse
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from samples.asm.data import load_asm_head
from samples.capture.views import write_views

from avatar_export.asm.model import Binding, Template
from avatar_trainer.asm.align import placed_by_pairs
from avatar_trainer.asm.kernels.closest import TriangleTree, nearest, triangle_tree
from avatar_trainer.asm.views.files import Views, read
from avatar_trainer.asm.views.fit import ViewSettings, fit
from avatar_trainer.loop.machine import reproducible

Array = npt.NDArray[Any]

COUNTS, COMPONENTS, SIZE = (3, 5, 10, 20), (2, 5), 384
ROUNDS = 30  # of placing by nearest points
ABLATIONS = {
    "without photometric consistency": {"photometric": 0.0},
    "without edges": {"edge": 0.0},
    "landmarks alone": {"photometric": 0.0, "edge": 0.0},
}


@dataclass(frozen=True)
class Truth:
    """What the images show."""

    vertices: Array  # [V, 3] metres
    triangles: Array
    facial: Array  # bool [V]
    landmarks: Array  # [68] vertices

    @staticmethod
    def of(folder: Path) -> Truth:
        with np.load(folder / "truth.npz", allow_pickle=False) as file:
            return Truth(file["vertices"], file["triangles"], file["facial"], file["landmarks"])


def distances(truth: Truth, vertices: Array, tree: TriangleTree, landmarks: Array) -> Array:
    """Distances of the truth's facial vertices to the mesh, in true metres, after the best similarity."""
    points = truth.vertices[truth.facial]
    placement = placed_by_pairs(truth.vertices[truth.landmarks], vertices[landmarks], similarity=True)
    for _ in range(ROUNDS):
        found = nearest(placement.apply(points), vertices, tree)
        foot = np.einsum("nk,nkx->nx", found.barycentric, vertices[tree.triangles[found.triangle]])
        placement = placed_by_pairs(points, foot, similarity=True)
    squared = nearest(placement.apply(points), vertices, tree).squared_distance
    result: Array = np.sqrt(squared) / placement.scale
    return result


def rmse_mm(truth: Truth, template: Template, vertices: Array) -> float:
    """The 3D-RMSE of a fit with the template's topology, millimetres."""
    tree = triangle_tree(vertices, template.triangles.astype(np.int64))
    distance = distances(truth, vertices, tree, marks(template))
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
) -> tuple[float, float]:
    """(RMSE in mm, CPU seconds) from the first `count` views."""
    start = time.process_time()
    found = fit(template, binding, subject.views.chosen(np.arange(count)), settings)
    seconds = time.process_time() - start
    return rmse_mm(subject.truth, template, found.vertices), seconds


def main() -> None:
    """The command."""
    parser = argparse.ArgumentParser(prog="python -m bench.asm_views", description=__doc__)
    parser.add_argument("out", type=Path, help="folder for the captures")
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
        for label, changed in ABLATIONS.items():
            settings = ViewSettings(iterations=given.iterations, **changed)
            errors = [measured(s, head.template, head.bindings[2], 10, settings)[0] for s in subjects]
            print(f" 10 views  K=2, {label}  {_row(errors)}", flush=True)


def _row(errors: list[float]) -> str:
    return f"{np.mean(errors):.3f} ({', '.join(f'{e:.3f}' for e in errors)})"


if __name__ == "__main__":
    main()
