"""Drops spherical harmonics above the active degree, which are never evaluated."""

from __future__ import annotations

from dataclasses import replace

from avatar_runtime.avatar import Avatar


def with_active_sh(avatar: Avatar) -> Avatar:
    """`avatar` with only the coefficients of its active SH degree; it plays as before.

    Gaussian Blendshapes always stores degree 3, 16 coefficients for every Gaussian and delta, whatever was trained.
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
