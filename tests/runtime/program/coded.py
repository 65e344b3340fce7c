"""Programs of small avatars whose arrays are coded with random integers of every width."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from avatar_runtime.avatar import Avatar, Relight, Rules
from avatar_runtime.program.bake import bake, bake_levels
from avatar_runtime.program.codes import Codes
from avatar_runtime.program.fields import BASE, EMBEDDED, LIT, MORPH, SKIN, VERTEX_CORRECTIVE, VERTEX_LATE
from avatar_runtime.program.gaussians import SPARSE_PARTS, array_of
from avatar_runtime.program.model import Program
from tests.avatars import full_avatar, surface_avatar

RIG = {
    "rig.morphs": MORPH,
    "rig.correctives": VERTEX_CORRECTIVE,
    "rig.late_morphs": VERTEX_LATE,
    "rig.skin": SKIN,
}
WIDTHS = (8, 16, 0)


def random_codes(avatar: Avatar, seed: int, widths: tuple[int, ...] = WIDTHS) -> dict[str, Codes]:
    """Codes of every array that may have them; the numbers mean nothing."""
    rng = np.random.default_rng(seed)
    found = {}

    def add(path: str, kind: str, values: Any, columns: int = 0) -> None:
        width = int(rng.choice(widths))
        channels = int(np.prod(values.shape[1:], dtype=np.int64))
        codes = None
        if width:
            most = 5 if kind == "table" else 1 << width
            codes = rng.integers(0, most, (len(values), channels)).astype(f"u{width // 8}")
        shape = {"linear": (channels, 2), "signed": (columns, channels), "weight": (1,), "table": (5,)}[kind]
        found[path] = Codes(kind, codes, rng.uniform(0, 1e-3, shape).astype(np.float32))

    for path, kind in (*BASE.values(), *(LIT.values() if avatar.relight else ())):
        add(path, kind, array_of(avatar, path))
    sparse = dict(SPARSE_PARTS.values())
    if avatar.rig is not None:
        sparse |= RIG
        add("rig.vertices", "linear", avatar.rig.vertices)
    if avatar.embedding is not None:
        add("embedding.canonical_vertices", "linear", avatar.embedding.canonical_vertices)
        for path, kind in EMBEDDED.values():
            add(path, kind, array_of(avatar, path))
    for path, kinds in sparse.items():
        rows = array_of(avatar, path)
        for attribute, (_, kind) in kinds.items():
            add(f"{path}.{attribute}", kind, rows.values[attribute], rows.columns)
    return found


def lit_avatar(avatar: Avatar) -> Avatar:
    """`avatar` with random normals and a light of its capture."""
    rng = np.random.default_rng(8)
    normal = rng.normal(size=(avatar.gaussians.count, 3)).astype(np.float32)
    ambient = rng.normal(size=(9, 3)).astype(np.float32)
    return replace(avatar, relight=Relight(normal, ambient, "head", (0.0, 0.0, 0.0), 0.3))


def programs() -> dict[str, tuple[Program, int]]:
    """Name -> (program, groups): floats and codes, in one chunk and in several, every kernel and every branch."""
    full, surface = full_avatar(3), surface_avatar(3)
    frames = surface_avatar(3, Rules("triangle_frame", position="triangle_frame", scale="triangle_linear"))
    joints, bare = surface_avatar(3, Rules("bary_vertex_lbs")), surface_avatar(3, rigged=False)
    split = replace(full, sh_degree=3)
    lit, lit_surface = lit_avatar(full), lit_avatar(surface)
    levels = [(full, random_codes(full, 5)), (full, random_codes(full, 5, (8,)))]
    chosen = {
        "full": (full, bake(full)),
        "full coded": (full, bake(full, random_codes(full, 1))),
        "chunks": (split, bake(split, random_codes(split, 2, (8, 16)), limit=9000)),
        "surface": (surface, bake(surface, random_codes(surface, 3))),
        "triangle frames": (frames, bake(frames, random_codes(frames, 6, (8, 16)))),
        "joints of a surface": (joints, bake(joints, random_codes(joints, 4, (8, 0)))),
        "no rig": (bare, bake(bare)),
        "lit": (lit, bake(lit, random_codes(lit, 7), limit=9000)),
        "lit surface": (lit_surface, bake(lit_surface)),
        "two levels": (full, bake_levels(levels)),
    }
    return {name: (program, len(avatar.groups)) for name, (avatar, program) in chosen.items()}
