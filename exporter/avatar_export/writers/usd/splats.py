"""The Gaussians of the binding pose as a ParticleField3DGaussianSplat."""

from __future__ import annotations

from typing import Any

import numpy as np
from pxr import UsdGeom, UsdVol

from avatar_export.writers.usd.extent import SIGMAS
from avatar_export.writers.usd.values import Box, box_of, floats, quatf, vec3f
from avatar_runtime.avatar import F32, Avatar, Gaussians
from avatar_runtime.rotation import matrix_from_quat
from avatar_runtime.stages.activate import sigmoid

ABOUT = (
    "The avatar's Gaussians in the binding pose, in the order of their ids. UsdSkel skins point-based prims only, so "
    "skel:animationSource does not reach these: a clip moves them as a whole at most, and the avatar's own runtime "
    "poses them. Radiance is display-referred sRGB (Rec. 709), blended before any conversion."
)


def author_splats(stage: Any, path: str, avatar: Avatar) -> Any:
    """The prim: unit quaternions, linear scales and opacities, SH of the avatar's active degree."""
    g, degree = avatar.gaussians, avatar.sh_degree
    splats = UsdVol.ParticleField3DGaussianSplat.Define(stage, path)
    splats.GetPrim().SetDocumentation(ABOUT)
    splats.CreatePurposeAttr(UsdGeom.Tokens.render)
    splats.CreatePositionsAttr(vec3f(g.mean))
    splats.CreateOrientationsAttr(quatf(np.roll(_unit(g.quat_wxyz), -1, axis=1)))
    splats.CreateScalesAttr(vec3f(_scales(g)))
    splats.CreateOpacitiesAttr(floats(sigmoid(g.opacity_logit)))
    splats.CreateRadianceSphericalHarmonicsDegreeAttr(degree)
    splats.CreateRadianceSphericalHarmonicsCoefficientsAttr(vec3f(g.sh[:, : (degree + 1) ** 2]))
    splats.CreateProjectionModeHintAttr(UsdVol.Tokens.perspective)
    splats.CreateSortingModeHintAttr(UsdVol.Tokens.zDepth)
    splats.CreateExtentAttr(vec3f(splat_box(g)))
    return splats.GetPrim()


def splat_box(g: Gaussians) -> Box:
    """The box that contains every Gaussian up to three standard deviations."""
    axes = matrix_from_quat(_unit(g.quat_wxyz).astype(np.float64)) * _scales(g).astype(np.float64)[:, None, :]
    reach = SIGMAS * np.sqrt(np.sum(axes**2, axis=2))
    return box_of(np.concatenate([g.mean - reach, g.mean + reach]))


def _scales(g: Gaussians) -> F32:
    """Standard deviations, clamped to the range of float32, since an infinite one breaks every box."""
    with np.errstate(over="ignore"):
        scales: F32 = np.minimum(np.exp(g.log_scale), np.finfo(np.float32).max)
    return scales


def _unit(quat_wxyz: F32) -> F32:
    """[N, 4] of length 1; one of length 0 becomes the identity."""
    wide = quat_wxyz.astype(np.float64)
    length = np.linalg.norm(wide, axis=1, keepdims=True)
    unit = np.where(length > 0, wide / np.where(length > 0, length, 1), (1.0, 0.0, 0.0, 0.0))
    return unit.astype(np.float32)
