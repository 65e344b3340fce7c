"""Spherical harmonics beyond the active degree, left out: nothing ever evaluates them."""

from __future__ import annotations

from dataclasses import replace

from avatar_runtime.avatar import Avatar


def with_active_sh(avatar: Avatar) -> Avatar:
    """`avatar` with the coefficients of its active SH degree alone; it plays as before.

    Gaussian Blendshapes stores degree 3 whatever was trained: 16 coefficients for every Gaussian and delta.
    """
    kept = (avatar.sh_degree + 1) ** 2
    if avatar.gaussians.sh.shape[1] <= kept:
        return avatar
    shapes = avatar.blendshapes
    values = {**shapes.appearance.values, "sh": shapes.appearance.values["sh"][:, :kept]}
    return replace(
        avatar,
        gaussians=replace(avatar.gaussians, sh=avatar.gaussians.sh[:, :kept]),
        blendshapes=replace(shapes, appearance=replace(shapes.appearance, values=values)),
    )
