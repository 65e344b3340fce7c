"""Small ASM faces for tests: a bowl-shaped mesh with a seamless chart, bones three deep, an uneven neutral."""

from __future__ import annotations

from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import numpy.typing as npt

from avatar_export.asm.files import save
from avatar_export.asm.model import AsmFace, Binding, Take, Template
from avatar_export.readers.table import read
from avatar_runtime.avatar import Avatar

Array = npt.NDArray[Any]

ROWS, COLUMNS = 13, 11
RADIUS = 0.11  # metres
BONES: dict[str, tuple[str | None, tuple[float, float]]] = {  # name -> parent, place in the plane
    "root": (None, (0.5, 0.1)),
    "head": ("root", (0.5, 0.52)),
    "nose": ("head", (0.5, 0.55)),
    "nose_tip": ("nose", (0.5, 0.47)),
    "nose_wing.L": ("nose", (0.58, 0.45)),
    "nose_wing.R": ("nose", (0.42, 0.45)),
    "mouth": ("head", (0.5, 0.3)),
    "lip_corner.L": ("mouth", (0.64, 0.31)),
    "lip_corner.R": ("mouth", (0.36, 0.31)),
    "eye.L": ("head", (0.7, 0.68)),
    "eye.R": ("head", (0.3, 0.68)),
    "eyelid.L": ("eye.L", (0.7, 0.74)),
}


def grid() -> tuple[Array, Array, Array]:
    """(vertices [V, 3], triangles [F, 3], uv [V, 2]) of half an egg, open at the back."""
    u, v = np.meshgrid(np.linspace(0, 1, COLUMNS), np.linspace(0, 1, ROWS))
    across, up = (u - 0.5) * 2.6, (v - 0.5) * 2.4
    vertices = RADIUS * np.stack(
        [np.sin(across) * np.cos(up), 1.25 * np.sin(up), np.cos(across) * np.cos(up)], -1
    )
    at = np.arange(ROWS * COLUMNS).reshape(ROWS, COLUMNS)
    a, b, c, d = at[:-1, :-1], at[:-1, 1:], at[1:, 1:], at[1:, :-1]
    triangles = np.concatenate(
        [np.stack([a, b, c], -1).reshape(-1, 3), np.stack([a, c, d], -1).reshape(-1, 3)]
    )
    uv = np.stack([u, v], -1).reshape(-1, 2)
    return vertices.reshape(-1, 3).astype(np.float32), triangles.astype(np.uint32), uv.astype(np.float32)


def template(
    rng: np.random.Generator,
    *,
    weight_rule: str = "normalised",
    coloured: bool = True,
    turned: bool = True,
    stretched: bool = False,
) -> Template:
    """`turned`: the first placement of bones has a rotation and a scale, `stretched` an uneven one."""
    vertices, triangles, uv = grid()
    names = tuple(BONES)
    place = np.array([at for _, at in BONES.values()])
    anchor = np.array([np.argmin(((uv - p) ** 2).sum(axis=1)) for p in place])
    linear = np.tile(np.eye(3), (len(names), 1, 1))
    if turned:
        linear[1:] = np.linalg.qr(rng.normal(size=(len(names) - 1, 3, 3)))[0]
        linear *= np.where(np.linalg.det(linear) < 0, -1.0, 1.0)[:, None, None]
        linear[1:] *= rng.uniform(0.6, 1.6, (len(names) - 1, 1, 3 if stretched else 1))
    return Template(
        vertices=vertices,
        triangles=triangles,
        uv=uv,
        bone_names=names,
        parents=np.array([-1 if p is None else names.index(p) for p, _ in BONES.values()], np.int32),
        rest_position=(vertices[anchor] - [0, 0, 0.02]).astype(np.float32),
        rest_linear=linear.astype(np.float32),
        anchor_vertex=anchor.astype(np.uint32),
        weight_rule=weight_rule,
        colour=rng.uniform(0, 1, vertices.shape).astype(np.float32) if coloured else None,
        landmarks={"nose_tip": int(anchor[3]), "mouth_left": int(anchor[7])},
    )


def binding(rng: np.random.Generator, given: Template, components: int = 2, spread: float = 0.12) -> Binding:
    """Bones a little off their anchors; covariances with all three entries."""
    bones = len(given.bone_names)
    place = np.array([at for _, at in BONES.values()])
    lower = np.zeros((bones, components, 2, 2))
    lower[..., 0, 0], lower[..., 1, 1] = rng.uniform(0.5, 1.2, (2, bones, components)) * spread
    lower[..., 1, 0] = rng.normal(0, 0.3 * spread, (bones, components))
    covariance = lower @ np.swapaxes(lower, -1, -2)
    return Binding(
        zeta=place + rng.normal(0, 0.01, (bones, 2)),
        pi=rng.dirichlet([2] * components, bones),
        mu=rng.normal(0, 0.03, (bones, components, 2)),
        covariance=np.stack([covariance[..., 0, 0], covariance[..., 0, 1], covariance[..., 1, 1]], -1),
    )


def take(rng: np.random.Generator, name: str, frames: int, bones: int, size: float = 1.0) -> Take:
    """Turns, moves and uneven scales of every bone."""
    shape = (frames, bones, 3)
    return Take(
        name,
        25.0,
        rng.normal(0, 0.12 * size, shape),
        rng.normal(0, 2e-3 * size, shape),
        np.exp(rng.normal(0, 0.12 * size, shape)),
    )


def small_face(
    seed: int = 0, *, components: int = 2, weight_rule: str = "normalised", coloured: bool = True,
    turned: bool = True, stretched: bool = False, spread: float = 0.12, size: float = 1.0,
) -> AsmFace:  # fmt: skip
    """12 bones, depth 4, an uneven neutral and two takes; numbers are float32's, so that a file keeps them."""
    rng = np.random.default_rng(seed)
    made = template(rng, weight_rule=weight_rule, coloured=coloured, turned=turned, stretched=stretched)
    bones = len(made.bone_names)
    takes = (
        take(rng, "neutral", 1, bones, size),
        take(rng, "smile", 1, bones, size),
        take(rng, "talk", 5, bones, size),
    )
    bound = binding(rng, made, components, spread)

    def single(array: Array) -> Array:
        return array.astype(np.float32).astype(np.float64)

    return AsmFace(
        "Small Fäce",
        made,
        Binding(*map(single, (bound.zeta, bound.pi, bound.mu, bound.covariance))),
        tuple(Take(t.name, t.fps, *map(single, (t.rotation_vector, t.translation, t.scale))) for t in takes),
    )


def asm_avatar(seed: int = 5) -> Avatar:
    """A small face as its reader makes it: an avatar that does not rest in its binding pose."""
    with TemporaryDirectory() as folder:
        save(small_face(seed), Path(folder, "face.npz"))
        return read(Path(folder, "face.npz"))
