"""Shared by the readers of mesh-embedded avatars: checks of an embedding against its mesh, and the avatar around it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from avatar_export.fit.embedded import own_mesh_fit
from avatar_export.fit.judge import Sides
from avatar_export.fit.skeleton import inhuman
from avatar_export.fit.surface import Mesh
from avatar_export.formats.obj import TriangleMesh
from avatar_export.notes.note import Note, doubt, fact
from avatar_export.options import LEAST_UNITS, MOST_UNITS, ReadOptions
from avatar_export.rigs.embedded_rig import EmbeddedRig
from avatar_export.sparse import no_deltas
from avatar_runtime.avatar import (
    F32,
    F64,
    U32,
    Avatar,
    Embedding,
    Gaussians,
    Group,
    RasterSettings,
    Rules,
    SparseRows,
)
from avatar_runtime.checks.avatar import check_rule_values
from avatar_runtime.io.errors import AvatarError
from avatar_runtime.stages.surface import binding_pose
from avatar_schema import constants

SUM_TOLERANCE = 1e-4
LEAST_WEIGHT = np.float32(-1e-3)  # SplattingAvatar's walk over triangles can end this far outside
LEAST_SINE = 1e-7  # of the angle at a corner; smaller angles define no plane in float32

Floats = npt.NDArray[np.floating[Any]]


def units_of(units: float) -> float:
    """`units`, training units per metre. Raises AvatarError for an impossible number."""
    if not LEAST_UNITS <= units <= MOST_UNITS:
        raise AvatarError(
            f"is {units}; training units per metre must be {LEAST_UNITS:g} to {MOST_UNITS:g}", field="--units"
        )
    return float(units)


def degree_of(degree: int | None, gaussians: Gaussians, file: Path, where: str) -> int:
    """`degree`, as stated by `where`, else that of the file. Raises AvatarError if the file stores a lower degree."""
    if degree is None:
        return gaussians.sh_degree
    if not 0 <= degree <= gaussians.sh_degree:
        raise AvatarError(
            f"stores SH of degree {gaussians.sh_degree}, but {where} says {degree}; pass --sh-degree",
            file=file,
        )
    return degree


def triangle_rows(values: Floats, mesh: TriangleMesh, file: Path, name: str, hint: str = "") -> U32:
    """Triangle ids [N] from a float array. Raises AvatarError, with `hint` appended, for an id that the mesh lacks."""
    count = len(mesh.triangles)
    wrong = ~((values >= 0) & (values < count) & (values == np.floor(values)))  # includes NaN
    if wrong.any():
        at = int(np.argmax(wrong))
        raise AvatarError(
            f"is {float(values[at]):.9g}, but the mesh has {count} triangles (0..{count - 1}){hint}",
            file=file,
            field=f"{name}[{at}]",
        )
    return values.astype(np.uint32)


def check_barycentric(weights: F32, file: Path, name: str) -> list[Note]:
    """Notes on weights [N, 3] slightly outside their triangle.

    Raises AvatarError for a row that does not add up to 1, and for a weight below LEAST_WEIGHT.
    """
    total = weights.sum(axis=1, dtype=np.float64)
    off = np.abs(total - 1) > SUM_TOLERANCE
    if off.any():
        at = int(np.argmax(off))
        raise AvatarError(
            f"adds up to {total[at]:.6g}, expected 1 within {SUM_TOLERANCE}", file=file, field=f"{name}[{at}]"
        )
    least = weights.min(axis=1)
    if least.min() < LEAST_WEIGHT:
        at = int(np.argmin(least))
        raise AvatarError(
            f"has a weight of {least[at]:.6g}, far outside the triangle; training gives at least -0.001",
            file=file,
            field=f"{name}[{at}]",
        )
    outside = int((least < 0).sum())
    return [fact("outside_triangles", count=outside, far=-least.min())] if outside else []


def check_areas(mesh: TriangleMesh, triangle: U32, file: Path) -> None:
    """Raise AvatarError for a triangle without area that carries a Gaussian: it has no frame."""
    used, first = np.unique(triangle, return_index=True)
    corner = mesh.vertices.astype(np.float64)[mesh.triangles[used]]
    e, f = corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]
    across = np.linalg.norm(np.cross(e, f), axis=1)
    flat = across <= LEAST_SINE * np.linalg.norm(e, axis=1) * np.linalg.norm(f, axis=1)
    if flat.any():
        at = int(np.argmax(flat))
        raise AvatarError(
            f"triangle {used[at]} (vertices {', '.join(map(str, mesh.triangles[used[at]]))}) has no area, but "
            f"carries Gaussian {first[at]}; repair the mesh or remove that Gaussian",
            file=file,
        )


def fit_notes(avatar: Avatar, options: ReadOptions, mesh_file: Path | None, owner: str) -> list[Note]:
    """Doubts about Gaussians far from the mesh that carries them, and about the size of a human mesh.

    A generic rig may have any size. Raises AvatarError for Gaussians very far, unless `accept_misfit`."""
    assert avatar.embedding is not None
    goal = "the mesh" if mesh_file is None else mesh_file.name
    sides = Sides("the Gaussians", goal, owner, mesh_file, accept=options.accept_misfit)
    embedding = avatar.embedding
    on = Mesh.of(embedding.canonical_vertices, embedding.triangles)
    doubts = own_mesh_fit(avatar, on, sides)
    if options.rig is None and options.body_model is None:
        height = inhuman(on.vertices, None)
        if height is not None:
            doubts.append(doubt("not_human_at_units", height=height, units=avatar.training_per_bundle))
    return doubts


def surface_avatar(
    *, name: str, gaussians: Gaussians, embedding: Embedding, rules: Rules, rig: EmbeddedRig, sh_degree: int,
    background: tuple[float, float, float] | str, units: float,
) -> Avatar:  # fmt: skip
    """The avatar of an embedding in metres; mean and rotation of `gaussians` are replaced by those of the binding pose.

    All Gaussians are one group, which only the mesh moves.
    """
    check_rule_values(rules)
    with np.errstate(all="ignore"):  # an overflow becomes infinite, which the check of the avatar refuses
        mean, quat_wxyz = binding_pose(embedding, rules, units)
    n = gaussians.count
    features = 0 if rig.rig is None else 9 * len(rig.rig.corrective_joints)
    return Avatar(
        name=name,
        gaussians=replace(gaussians, mean=mean, quat_wxyz=quat_wxyz),
        groups=(Group("surface", 0, n, "surface"),),
        rules=rules,
        expressions=rig.expressions,
        eyelids=(),
        blendshapes=no_deltas(n, len(rig.expressions), features, gaussians.sh.shape[1]),
        skin=SparseRows.empty(n, 0 if rig.rig is None else rig.rig.joint_count, {"weight": ()}),
        rig=rig.rig,
        sh_degree=sh_degree,
        driving=rig.driving,
        raster=RasterSettings(near=float(constants()["near"]) / units, background=background),
        head_pose_in=rig.head_pose_in,
        training_per_bundle=units,
        embedding=embedding,
        clips=rig.clips,
    )


def in_metres(values: F32, units: float) -> F32:
    """From lengths in training units to metres."""
    scaled: F64 = values / np.float64(units)
    with np.errstate(over="ignore"):
        return scaled.astype(np.float32)


def log_in_metres(log_scale: F32, units: float) -> F32:
    """From logarithms of lengths in training units to logarithms of metres."""
    result: F32 = (log_scale - np.log(units)).astype(np.float32)
    return result
