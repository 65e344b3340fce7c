"""Random scenes for the `cpu` backend's draw stages, and their comparison with the NumPy stages."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest

from avatar_runtime.avatar import RasterSettings
from avatar_runtime.camera import Camera
from avatar_runtime.posed import Clock
from avatar_runtime.stages.activate import Splats
from avatar_runtime.stages.project import Projected, project
from avatar_runtime.stages.raster import Image, raster
from avatar_runtime.stages.sort import sort
from tests.golden import Array
from tests.measured import Measure

pytest.importorskip("numba")
from avatar_runtime.backends.cpu.draw.frame import draw
from avatar_runtime.backends.cpu.draw.project import project as cpu_project
from avatar_runtime.backends.cpu.draw.screen import CENTRE_X, CONIC_XX, OPACITY, RED, Screen

TOLERANCE = 1e-4  # what is further away is a threshold's other side: alpha at 1/255 or T at 1e-4
FLIP = 4e-3
FLIPPED_SHARE = 1e-4  # of the pixels, and one more
COLOUR_TOLERANCE = 1e-6  # SH sums are fused here
SKY = np.array([0.2, 0.5, 0.9], np.float32)


@dataclass(frozen=True)
class Scene:
    splats: Splats
    camera: Camera
    degree: int

    def reference(self) -> Projected:
        with np.errstate(invalid="ignore"):
            return project(self.splats, self.camera, RasterSettings(), self.degree)

    def image(self, profile: str, background: Array = SKY) -> Image:
        projected = self.reference()
        return raster(projected, sort(projected), self.camera, background, profile)

    def screen(self, profile: str = "trainer", workers: int = 1) -> Screen:
        return cpu_project(self.splats, self.camera, RasterSettings(), self.degree, profile, workers)

    def drawn(self, profile: str, background: Array = SKY, threads: int = 1) -> Image:
        settings = RasterSettings()
        return draw(self.splats, self.camera, settings, self.degree, background, profile, threads, Clock())


def scene(
    seed: int, count: int = 300, largest: float = 0.2, size: tuple[int, int] = (44, 37), degree: int = 0
) -> Scene:
    """Random splats about the image, some beyond its border, some behind the camera."""
    rng = np.random.default_rng(seed)
    quat = rng.normal(size=(count, 4))
    quat /= np.linalg.norm(quat, axis=1, keepdims=True)
    splats = Splats(
        rng.uniform(-1.3, 1.3, (count, 3)).astype(np.float32),
        (largest * rng.uniform(0.02, 1, (count, 3)) ** 2).astype(np.float32),
        quat.astype(np.float32),
        rng.uniform(0.001, 1, count).astype(np.float32),
        rng.normal(size=(count, (degree + 1) ** 2, 3)).astype(np.float32),
        np.linalg.qr(rng.normal(size=(count, 3, 3)))[0].astype(np.float32) if degree else None,
    )
    camera = Camera.orbit(np.zeros(3), 2.0, 0.4, 0.1, 1.0, *size)
    return Scene(splats, camera, degree)


def check_image(got: Image, want: Image, measured: Measure) -> None:
    """Equal to TOLERANCE except for few and small flips."""
    error = np.abs(got.colour.astype(np.float64) - want.colour).max(axis=-1)
    left = np.abs(got.transmittance.astype(np.float64) - want.transmittance)
    flipped = np.maximum(error, left) > TOLERANCE
    measured("cpu image against reference, pixels on a threshold's other side, count", float(flipped.sum()))
    measured("cpu image against reference, those pixels' difference", float(error[flipped].max(initial=0)))
    measured("cpu image against reference, difference", float(error[~flipped].max(initial=0)))
    assert max(error.max(), left.max()) <= FLIP
    assert flipped.sum() <= 1 + FLIPPED_SHARE * error.size


def check_screen(got: Screen, want: Projected, measured: Measure) -> None:
    """The same bits except for the colour."""
    pairs = {
        "centre": (got.splats[:, CENTRE_X : CENTRE_X + 2], want.centre),
        "conic": (got.splats[:, CONIC_XX : CONIC_XX + 3], want.conic),
        "opacity": (got.splats[:, OPACITY], want.opacity),
        "depth": (got.depth, want.depth),
        "radius": (got.radius, want.radius),
        "tiles": (got.tiles, want.tiles),
    }
    for name, (a, b) in pairs.items():
        np.testing.assert_array_equal(a, b, err_msg=name)
    rgb = got.splats[:, RED : RED + 3]
    measured("cpu SH colour against reference, difference", float(np.abs(rgb - want.rgb).max(initial=0)))
    np.testing.assert_allclose(rgb, want.rgb, rtol=0, atol=COLOUR_TOLERANCE)
