"""project, sort and raster against the arrays that the reference rasteriser computed."""

from __future__ import annotations

import numpy as np
import pytest

from avatar_runtime.stages.raster import raster, tile_lists
from avatar_runtime.stages.sort import sort
from tests.golden import Array, RasteriserCase, digest, rasteriser_case, rasteriser_names
from tests.measured import Measure
from tests.runtime.stages.golden_scene import camera_of, projected_of

IMAGE_TOLERANCE = 2e-7  # one expf against another
BIG_CASES = ("dense", "playbot_a")
EQUAL = (
    *("radii", "means2D", "depths", "cov3D", "conic_opacity", "rgb"),
    *("tiles_touched", "point_list", "tile_ranges", "n_contrib"),
)


def test_every_case_is_committed() -> None:
    assert len(rasteriser_names()) == 17
    assert set(BIG_CASES) == {name for name in rasteriser_names() if rasteriser_case(name).digests}


@pytest.mark.parametrize("name", rasteriser_names())
def test_meets_the_reference(name: str, measured: Measure) -> None:
    check(rasteriser_case(name), measured)


def check(case: RasteriserCase, measured: Measure) -> None:
    got = evaluate(case.arrays)
    compared = [key for key in EQUAL if key in case.arrays or key in case.digests]
    # A case with colours of its own has no SH colour.
    assert set(EQUAL) - set(compared) == (set() if "shs" in case.arrays else {"rgb"})
    for key in compared:
        if key in case.digests:
            assert digest(got[key]) == case.digests[key], key
        else:
            np.testing.assert_array_equal(got[key], case.arrays[key], err_msg=key, strict=True)
    for key in ("out_color", "final_T"):
        measured(
            "golden rasteriser, image and transmittance, difference",
            worst(got[key], case.arrays[key]),
            IMAGE_TOLERANCE,
        )
        np.testing.assert_allclose(got[key], case.arrays[key], rtol=0, atol=IMAGE_TOLERANCE, err_msg=key)


def worst(got: Array, want: Array) -> float:
    return float(np.abs(got.astype(np.float64) - want).max())


def evaluate(case: dict[str, Array]) -> dict[str, Array]:
    """The reference's outputs, by its names and types, from this project's stages."""
    camera, projected = camera_of(case), projected_of(case)
    order = sort(projected)
    ids, ranges = tile_lists(projected.tiles, order, camera, 16)
    image = raster(projected, order, camera, case["bg"])
    x0, y0, x1, y1 = projected.tiles.T
    return {
        "radii": projected.radius,
        "means2D": projected.centre,
        "depths": projected.depth,
        "cov3D": projected.cov3d,
        "conic_opacity": np.concatenate([projected.conic, projected.opacity[:, None]], axis=1),
        "rgb": projected.rgb,
        "tiles_touched": ((x1 - x0) * (y1 - y0)).astype(np.uint32),
        "point_list": ids.astype(np.uint32),
        # The reference writes no range for an empty tile.
        "tile_ranges": np.where(ranges[:, :1] == ranges[:, 1:], 0, ranges).astype(np.uint32),
        "out_color": image.colour.transpose(2, 0, 1),
        "final_T": image.transmittance,
        "n_contrib": image.last.astype(np.uint32),
    }
