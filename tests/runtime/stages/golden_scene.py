"""A golden rasteriser case as this project's stages take it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from avatar_runtime.avatar import RasterSettings
from avatar_runtime.camera import Camera
from avatar_runtime.stages.activate import Splats
from avatar_runtime.stages.project import Projected, project
from tests.golden import Array


def camera_of(case: dict[str, Array]) -> Camera:
    return Camera(
        case["viewmatrix"],
        case["projmatrix"],
        case["campos"],
        float(case["tanfovx"]),
        float(case["tanfovy"]),
        int(case["width"]),
        int(case["height"]),
    )


def projected_of(case: dict[str, Array]) -> Projected:
    """Stage `project` on the case's Gaussians; colours that the case gives replace those of the SH."""
    sh = case.get("shs", np.zeros((len(case["means3D"]), 1, 3), np.float32))
    scale = case["scales"] * case["scale_modifier"]
    splats = Splats(case["means3D"], scale, case["rotations"], case["opacities"], sh)
    projected = project(splats, camera_of(case), RasterSettings(), int(case["sh_degree"]))
    if "colors_precomp" in case:
        projected = replace(projected, rgb=case["colors_precomp"] * (projected.radius > 0)[:, None])
    return projected
