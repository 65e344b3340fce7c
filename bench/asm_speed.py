"""How long a batch of 32 ASM faces takes on the CPU, and how large a face is (the paper's Table 4 and Fig. 5).

    python -m bench.asm_speed [--repeats 9]

All parameters differ from face to face, weights too. The paper: 2.658 s for 32 faces of about 35,000 vertices on a
Xeon Gold 6133. Ratios are of whole batches, not per vertex: the meshes here are smaller than the paper's. CPU seconds
are those of all threads together. Vertices are those of the sample head, or more or fewer of the same (`sized`).
"""

from __future__ import annotations

import argparse
import statistics
import tempfile
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numba
import numpy as np
import torch
from samples.asm.data import load_asm_head

from avatar_export.asm.files import save, save_person
from avatar_export.asm.model import Template
from avatar_trainer.asm.faces import posed_cpu, tiles
from avatar_trainer.asm.model import Face, TemplateTensors
from avatar_trainer.asm.template.files import at_rest

FACES, PAPER_SECONDS = 32, 2.658
SIZES = (4_700, 26_000)  # vertices
SPREAD = {"zeta": 0.003, "pi_logit": 0.2, "mu": 0.003, "scale_tril": 0.05, "rotation_vector": 0.05,
          "translation": 0.002, "log_scale": 0.05}  # fmt: skip


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--repeats", type=int, default=9)
    for name, value, unit in asm_rows(parser.parse_args().repeats):
        over = f"   paper over that: {PAPER_SECONDS / value:.1f}" if unit == "s" else ""
        print(f"{name:40s} {value:10.4g} {unit}{over}", flush=True)


def asm_rows(repeats: int = 9) -> Iterator[tuple[str, float, str]]:
    """Seconds of a batch of FACES by vertices, components K and threads; then kilobytes of a person and of a face."""
    head = load_asm_head("ict")
    for size in SIZES:
        template = TemplateTensors.of(sized(head.template, size))
        for components in (2, 5):
            faces = different_faces(Face.of(head.bindings[components]), FACES)
            for threads in (1, 2):
                wall, cpu = seconds(template, faces, threads, repeats)
                name = f"asm_{size}_vertices_k{components}_{threads}_threads"
                yield f"{name}_wall", wall, "s"
                yield f"{name}_cpu", cpu, "s"
    for components in (2, 5):
        face = at_rest("face", head.template, head.bindings[components])
        with tempfile.TemporaryDirectory() as folder:
            whole, person = Path(folder) / "face.npz", Path(folder) / "person.npz"
            save(face, whole)
            save_person(face, person)
            yield f"asm_person_k{components}", person.stat().st_size / 1e3, "kB"
            yield f"asm_face_k{components}", whole.stat().st_size / 1e3, "kB"
    yield "asm_person_numbers", len(head.template.bone_names) * (11 + 6 * 2), "1"


def seconds(template: TemplateTensors, faces: Face, threads: int, repeats: int) -> tuple[float, float]:
    """(wall, CPU) medians of a batch; the template's tiles are made before."""
    numba.set_num_threads(min(threads, numba.config.NUMBA_NUM_THREADS))
    prepared = tiles(template)
    posed_cpu(template, faces, prepared)
    wall, cpu = [], []
    for _ in range(repeats):
        start, busy = time.perf_counter(), time.process_time()
        posed_cpu(template, faces, prepared)
        wall.append(time.perf_counter() - start)
        cpu.append(time.process_time() - busy)
    return statistics.median(wall), statistics.median(cpu)


def different_faces(face: Face, count: int, seed: int = 0) -> Face:
    """`count` faces about one, different in every parameter."""
    generator = torch.Generator().manual_seed(seed)
    return Face(
        **{
            name: tensor + SPREAD[name] * torch.randn((count, *tensor.shape), generator=generator)
            for name, tensor in face.parameters()
        }
    )


def sized(template: Template, vertices: int) -> Template:
    """The template with as many vertices: those farthest from all anchors left out, or middles of triangles added.

    Bones and their anchors stay. What is left out, with its triangles, is scalp and neck; what is left is a mesh.
    Added middles belong to no triangle: every vertex is worked on alone, so that this is a mesh's work all the same.
    """
    uv, place = template.uv, template.vertices
    if vertices > len(uv):
        corners = template.triangles[: vertices - len(uv)]
        uv = np.concatenate([uv, uv[corners].mean(axis=1)])
        place = np.concatenate([place, place[corners].mean(axis=1)])
        return replace(template, uv=uv, vertices=place)
    anchors = np.unique(template.anchor_vertex)
    away = np.linalg.norm(place[:, None] - place[anchors], axis=-1).min(axis=1)
    away[anchors] = -1
    rows = np.sort(np.argsort(away, kind="stable")[:vertices])
    new = np.full(len(uv), -1)
    new[rows] = np.arange(len(rows))
    corners = new[template.triangles]
    kept = corners[(corners >= 0).all(axis=1)].astype(np.uint32)
    anchor = new[template.anchor_vertex].astype(np.uint32)
    return replace(template, uv=uv[rows], vertices=place[rows], triangles=kept, anchor_vertex=anchor)


if __name__ == "__main__":
    main()
