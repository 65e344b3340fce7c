"""Drawing on the CPU: stages project, sort and raster in tiles of pixels."""

from __future__ import annotations

from avatar_runtime.backends.cpu.draw.colour import C0, C1, C2, C3
from avatar_runtime.backends.cpu.draw.frame import STOP
from avatar_runtime.backends.cpu.draw.geometry import FRUSTUM_CLAMP, HOMOGENEOUS_EPSILON
from avatar_runtime.backends.cpu.draw.project import project
from avatar_runtime.backends.cpu.draw.raster import (
    ALPHA_MAX,
    ALPHA_MIN,
    LANES,
    aligned,
    composite_tiles,
    look_up,
)
from avatar_runtime.backends.cpu.draw.screen import (
    BLUE,
    CENTRE_X,
    CENTRE_Y,
    COLUMNS,
    CONIC_XX,
    CONIC_XY,
    CONIC_YY,
    GREEN,
    OPACITY,
    RED,
    TILE,
    Screen,
)
from avatar_runtime.backends.cpu.draw.sort import sort
from avatar_runtime.backends.cpu.draw.tiles import tile_lists

# fmt: off
__all__ = [
    "ALPHA_MAX", "ALPHA_MIN", "BLUE", "C0", "C1", "C2", "C3", "CENTRE_X", "CENTRE_Y", "COLUMNS", "CONIC_XX",
    "CONIC_XY", "CONIC_YY", "FRUSTUM_CLAMP", "GREEN", "HOMOGENEOUS_EPSILON", "LANES", "OPACITY", "RED",
    "STOP", "TILE", "Screen", "aligned", "composite_tiles", "look_up", "project", "sort", "tile_lists",
]
# fmt: on
