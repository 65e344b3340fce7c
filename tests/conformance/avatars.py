"""Avatars that reference vectors are made of: every value of every rule in one of them, no field that is zero."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np

from avatar_runtime.avatar import Avatar, Blendshapes, Driving, Gaussians, Group, Relight, Rules, SparseRows
from avatar_runtime.checks.avatar import check_avatar
from avatar_runtime.rotation import homogeneous, matrix_from_rotvec
from avatar_runtime.stages.surface import binding_pose
from tests.avatars import full_avatar, surface_avatar
from tests.conformance.edges import edge_gaussians


def _skinned(rules: Rules, sh_degree: int) -> Avatar:
    """All four bindings; rows of blendshapes and skin from empty to full."""
    return check_avatar(replace(full_avatar(11), rules=rules, sh_degree=sh_degree))


def _surface(rules: Rules, sh_degree: int, *, rigged: bool = True) -> Avatar:
    """On a mesh, where expressions still change scale, opacity and colour."""
    made = surface_avatar(4, rules, rigged=rigged)
    blendshapes = replace(made.blendshapes, appearance=full_avatar(4).blendshapes.appearance)
    return check_avatar(replace(made, blendshapes=blendshapes, sh_degree=sh_degree))


def _unbound() -> Avatar:
    """Joints push and stretch the mesh at rest, as the bones of ASM do: no skin matrix is the identity."""
    made, rng = _surface(FRAMED, 1), np.random.default_rng(21)
    assert made.rig is not None and made.embedding is not None
    joints = made.rig.joint_count
    stretch = np.exp(rng.normal(0, 0.15, (joints, 1, 3)))
    push = homogeneous(
        matrix_from_rotvec(rng.normal(0, 0.2, (joints, 3))) * stretch, rng.normal(0, 5e-3, (joints, 3))
    )
    rig = replace(made.rig, rest_local=(made.rig.rest_local @ push).astype(np.float32))
    return check_avatar(replace(made, rig=rig))


def _fine() -> Avatar:
    """Triangles so small in training units that about half the vertices' normals and quaternions meet their floor."""
    made = _surface(Rules(TURNED, scale="log_area"), 2)
    assert made.embedding is not None
    units = 0.007  # training units a metre
    mean, quat_wxyz = binding_pose(made.embedding, made.rules, units)
    gaussians = replace(made.gaussians, mean=mean, quat_wxyz=quat_wxyz)
    return check_avatar(replace(made, gaussians=gaussians, training_per_bundle=units))


def _still() -> Avatar:
    """Neither rig nor mesh; one SH coefficient. Blendshapes and late morphs still move it."""
    full = full_avatar(5)
    appearance = full.blendshapes.appearance
    colours = replace(appearance, values={**appearance.values, "sh": appearance.values["sh"][:, :1]})
    blendshapes = replace(full.blendshapes, appearance=colours)
    gaussians = replace(full.gaussians, sh=full.gaussians.sh[:, :1])
    return check_avatar(replace(_unrigged(full, gaussians, blendshapes), sh_degree=0))


def _edges() -> Avatar:
    """What the raster decides by thresholds: `edges.py`. At rest it is as designed."""
    full = full_avatar(6)
    gaussians, b = edge_gaussians(), full.blendshapes
    repeated = np.arange(gaussians.count) % full.gaussians.count
    blendshapes = Blendshapes(
        b.geometry.take(repeated), b.appearance.take(repeated), b.correctives, b.late_morphs.take(repeated)
    )
    return check_avatar(replace(_unrigged(full, gaussians, blendshapes), sh_degree=3))


def _unrigged(full: Avatar, gaussians: Gaussians, blendshapes: Blendshapes) -> Avatar:
    """`full` with other Gaussians and without all that a rig is needed for."""
    count = gaussians.count
    return replace(
        full,
        gaussians=gaussians,
        groups=(Group("all", 0, count, "none"),),
        rules=Rules("none"),
        blendshapes=replace(blendshapes, correctives=SparseRows.empty(count, 0, {"mean": (3,)})),
        skin=SparseRows.empty(count, 0, {"weight": ()}),
        rig=None,
        driving=Driving(),
        clips=(),
    )


def _lit(avatar: Avatar, frame: str, seed: int) -> Avatar:
    """Normals and a light of the capture that differ in every number; dark from some sides."""
    rng = np.random.default_rng(seed)
    normal = rng.standard_normal((avatar.gaussians.count, 3))
    ambient = np.vstack([[[2.2, 1.9, 1.6]], rng.normal(0, 0.35, (8, 3))])
    low, high = avatar.gaussians.mean.min(axis=0), avatar.gaussians.mean.max(axis=0)
    centre, radius = (low + high).astype(np.float64) / 2, 0.6 * float(np.linalg.norm(high - low))
    relight = Relight(
        (normal / np.linalg.norm(normal, axis=1, keepdims=True)).astype(np.float32),
        ambient.astype(np.float32),
        frame,
        tuple(centre.tolist()),
        radius,
        avatar.driving.head_joint,
    )
    return check_avatar(replace(avatar, relight=relight))


TURNED = "vertex_quaternion"
PAPER = Rules("vertex_quaternion_mean", position="interpolated_normal", scale="linear_area")
JOINTED = Rules("bary_vertex_lbs", position="interpolated_normal")
FRAMED = Rules("triangle_frame", position="triangle_frame", scale="triangle_linear")

AVATARS: Mapping[str, Callable[[], Avatar]] = {
    "skin_polar": lambda: _skinned(Rules("polar3", anchor="unique"), 3),
    "skin_head_bone": lambda: _skinned(Rules("head_bone", "neck", anchor="repeats"), 2),
    "skin_unturned": lambda: _skinned(Rules("none", sh_direction="world"), 1),
    "still": _still,
    "surface_area": lambda: _surface(Rules(TURNED, scale="log_area"), 3),
    "surface_world": lambda: _surface(
        Rules(TURNED, sh_direction="world", quaternion_sign="largest_positive"), 2
    ),
    "surface_mirrored": lambda: _surface(Rules(TURNED, quaternion_sign="largest_positive_mirrored"), 1),
    "surface_paper": lambda: _surface(PAPER, 1),
    "surface_joints": lambda: _surface(JOINTED, 2),
    "surface_frame": lambda: _surface(FRAMED, 3),
    "surface_unbound": _unbound,
    "surface_unrigged": lambda: _surface(Rules(TURNED, scale="log_area"), 2, rigged=False),
    "surface_fine": _fine,
    "edges": _edges,
    "lit_head": lambda: _lit(_skinned(Rules("polar3"), 1), "head", 31),
    "lit_world": lambda: _lit(_surface(Rules(TURNED), 0), "world", 32),
    "lit_joints": lambda: _lit(_surface(JOINTED, 0), "head", 33),
}
