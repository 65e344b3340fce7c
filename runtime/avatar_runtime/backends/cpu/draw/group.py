"""Sixteen splats side by side: the offsets at which `project` keeps each quantity of its 16 lanes in one flat array."""

from __future__ import annotations

from avatar_runtime.backends.cpu.draw.screen import COLUMNS

LANES = 16
MEAN, SCALE, QUAT = 0, 3 * LANES, 6 * LANES  # 3, 3 and 4 rows of lanes
DIRECTION, SQUARED_DISTANCE = 10 * LANES, 13 * LANES  # 3 and 1, from the eye
COVARIANCE = 14 * LANES  # 6: xx xy xz yy yz zz, world space
DEPTH, RADIUS, DRAWN = 20 * LANES, 21 * LANES, 22 * LANES  # 1 each; DRAWN is 1 or 0
TILES = 23 * LANES  # 4: x0 y0 x1 y1
SPLAT = 27 * LANES  # the columns of a row of a screen
BASIS = SPLAT + COLUMNS * LANES  # 16 SH basis functions
GROUP_FLOATS = BASIS + 16 * LANES
