"""ASM faces fitted to scans: `python -m tests.bench.asm_registration OUT` prints the tables of the paper's 7 and 3.

Table 7: what is tuned. Table 3: the topology. Scans: people of ICT's identity shapes, whose points are no template's
vertices, and the Perry-Smith scan itself. Errors are scan to mesh in the facial region (`asm_align.scan_to_mesh`), in
millimetres. Orders, not figures, are what compares with the paper: these scans are smoother than a scanner's.
Writes OUT/registration.png.
"""

from __future__ import annotations

import argparse
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch
from samples.asm_data import AsmHead, load_asm_head
from samples.asm_scans import coefficients, head_scan, person_scan, seen

from avatar_runtime.avatar import F64
from avatar_trainer.kernels.closest import nearest, triangle_tree
from avatar_trainer.systems.asm_align import Scan, face_region
from avatar_trainer.systems.asm_model import VARIANTS
from avatar_trainer.systems.asm_register import Registration, register, scan_error
from avatar_trainer.systems.asm_register_settings import RegisterSettings
from tests.bench.asm_pictures import errors, face_camera, grey, save_sheet

SCAN = "lee_perry_smith"
TOPOLOGIES = ("ict", "rocketbox", SCAN)
SIZE, MOST = 320, 0.5e-3  # pixels of a picture; metres that are red
COLUMNS = "scan | template | static | full | static's error | full's error (red: 0.5 mm)"


@dataclass(frozen=True)
class Row:
    """One line of a table."""

    label: str
    head: str
    variant: str
    components: int = 2


TABLE_7 = (
    Row("SSM: static skinning", "ict", "static"),
    Row("+ DBB: dynamic bone binding", "ict", "dynamic_binding"),
    Row("DBB whose weights move along, K = 2", "ict", "moving_weights"),
    Row("+ GSW from random weights (RD)", "ict", "random_weights"),
    Row("+ GSW: tunable mixtures, K = 2", "ict", "full"),
    Row("the same, K = 5", "ict", "full", 5),
)
TABLE_3 = tuple(Row(name, name, "full") for name in TOPOLOGIES)


@dataclass(frozen=True)
class Target:
    """A scan, and the mesh that it was taken of."""

    scan: Scan
    vertices: F64
    head: AsmHead


@dataclass(frozen=True)
class Fitted:
    """One fit."""

    registration: Registration
    error_mm: float
    cpu_seconds: float


def targets(count: int, noise_mm: float, holes: bool) -> list[Target]:
    """`count` people of ICT's identity shapes, and the Perry-Smith scan."""
    ict, scan = load_asm_head("ict"), load_asm_head(SCAN)
    front = seen(ict)
    found = []
    for seed in range(count):
        vertices = ict.scan(coefficients(seed, len(ict.identity))).astype(np.float64)
        points = person_scan(ict, front, vertices, seed, noise_mm=noise_mm, holes=holes)
        found.append(Target(points, vertices, ict))
    return [*found, Target(head_scan(scan), scan.template.vertices.astype(np.float64), scan)]


def fitted(row: Row, target: Target, iterations: int) -> Fitted:
    """The face of a row fitted to a scan."""
    head = load_asm_head(row.head)
    weights = torch.from_numpy(head.weights) if VARIANTS[row.variant].fixed_weights else None
    began = time.process_time()
    settings = RegisterSettings(variant=row.variant, iterations=iterations)
    found = register(head.template, head.bindings[row.components], target.scan, settings, weights)
    seconds = time.process_time() - began
    return Fitted(found, scan_error(found, target.scan).mean_mm, seconds)


def line(row: Row, fits: list[Fitted]) -> str:
    """Mean and deviation over the people, the Perry-Smith scan, and what a fit takes."""
    people = [fit.error_mm for fit in fits[:-1]]
    own = "-" if row.head == SCAN else f"{fits[-1].error_mm:.3f}"
    mean = f"{np.mean(people):.4f} ± {np.std(people):.4f}"
    return f"| {row.label} | {mean} | {own} | {np.median([fit.cpu_seconds for fit in fits]):.0f} |"


def picture_row(target: Target, static: Fitted, full: Fitted) -> list[F64]:
    """One row of the contact sheet, all in the scan's frame."""
    middle, radius = face_region(target.scan.keypoints)
    camera = face_camera(middle, SIZE)
    truth = target.head.template.triangles.astype(np.int64)
    tree = triangle_tree(target.vertices, truth)
    template = static.registration.face.template
    triangles = template.triangles.astype(np.int64)
    meshes = [
        fit.registration.placements[0].inverse().apply(fit.registration.vertices[0]) for fit in (static, full)
    ]
    still = static.registration.placements[0].inverse().apply(template.vertices.astype(np.float64))
    apart = [np.sqrt(nearest(mesh, target.vertices, tree).squared_distance) for mesh in meshes]
    for mesh, off in zip(meshes, apart, strict=True):
        off[np.linalg.norm(mesh - middle, axis=1) > radius] = 0
    return [
        grey(target.vertices, truth, camera),
        *(grey(mesh, triangles, camera) for mesh in (still, *meshes)),
        *(errors(mesh, triangles, off, MOST, camera) for mesh, off in zip(meshes, apart, strict=True)),
    ]


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m tests.bench.asm_registration", description=__doc__)
    parser.add_argument("out", type=Path, help="folder to write registration.png to")
    parser.add_argument("--scans", type=int, default=5, help="people")
    parser.add_argument("--iterations", type=int, default=RegisterSettings.iterations)
    parser.add_argument("--noise-mm", type=float, default=0.0, help="of each coordinate of a scan's points")
    parser.add_argument("--holes", action="store_true", help="scans with holes")
    args = parser.parse_args()
    torch.set_num_threads(1)
    scans = targets(args.scans, args.noise_mm, args.holes)
    results: dict[Row, list[Fitted]] = {}
    for title, table in (("Table 7: what is tuned", TABLE_7), ("Table 3: topology", TABLE_3)):
        print(f"| {title} | people, mm | Perry-Smith scan, mm | CPU s a fit |\n|---|---|---|---|", flush=True)
        for row in table:
            # A scan's own topology fits itself without moving.
            known = next((fits for done, fits in results.items() if _same(done, row)), None)
            wanted = scans[:-1] if row.head == SCAN else scans
            fits = known or [fitted(row, target, args.iterations) for target in wanted]
            results[row] = fits if len(fits) == len(scans) else [*fits, fits[-1]]
            print(line(row, results[row]), flush=True)
        print()
    shown = (0, 1, len(scans) - 1)
    by_variant = {row.variant: fits for row, fits in results.items() if row in TABLE_7[:4]}
    rows = [picture_row(scans[i], by_variant["static"][i], by_variant["full"][i]) for i in shown]
    save_sheet(rows, args.out / "registration.png")
    print(f"{args.out / 'registration.png'}: {COLUMNS}")


def _same(a: Row, b: Row) -> bool:
    return (a.head, a.variant, a.components) == (b.head, b.variant, b.components)


if __name__ == "__main__":
    main()
