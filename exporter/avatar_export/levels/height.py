"""How large on the screen a level may be shown."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from avatar_export.levels.views import View, judging_views
from avatar_runtime.avatar import Avatar
from avatar_runtime.player import Player

ALIKE_DB = 36.0  # a root mean square error of 1.6 % of white
SIZES = (64, 128, 256, 512, 1024)  # pixels along the edge of the measured images
VIEWS_APART = 4  # of the judging views one in so many is measured, so that every side has its turn
COVERED = 0.5  # alpha of the source above which a pixel belongs to the avatar
BLACK = (0.0, 0.0, 0.0)


def height_px(avatar: Avatar, level: Avatar, alike_db: float = ALIKE_DB) -> int:
    """The largest height in pixels at which `level` may stand for `avatar`: its PSNR there is still `alike_db`.

    Measured in images of `SIZES` over `judging_views`, interpolated in the logarithm between two sizes; the height is
    that of the avatar in its image. It is at most that at the largest size. A level that reaches `alike_db` at no size
    gets the height at which its PSNR is largest.
    """
    found = []
    for size in SIZES:
        seen = judging_views(avatar, size)
        found.append((float(np.mean(psnr_db(avatar, level, seen[::VIEWS_APART]))), _height(avatar, seen[0])))
    alike = [index for index, (db, _) in enumerate(found) if db >= alike_db]
    if not alike:
        return round(max(found)[1])
    last = alike[-1]
    db, height = found[last]
    if last + 1 == len(found):
        return round(height)
    next_db, next_height = found[last + 1]
    share = 0.0 if np.isinf(db) else (db - alike_db) / (db - next_db)
    return round(float(height * (next_height / height) ** share))


def level_psnr(avatar: Avatar, level: Avatar, size: int = 512) -> float:
    """Mean PSNR in dB of `level` against `avatar` over poses and views that no level was fitted to."""
    return float(np.mean(psnr_db(avatar, level, judging_views(avatar, size))))


def psnr_db(avatar: Avatar, level: Avatar, seen: Sequence[View]) -> list[float]:
    """PSNR of each view over black, where `avatar` covers more than half of a pixel; infinite if nothing differs."""
    truth, player, result = Player(avatar), Player(level), []
    for view in seen:
        wanted, drawn = (p.frame(view.pose, view.camera, BLACK).image for p in (truth, player))
        mask = 1 - wanted.transmittance > COVERED
        error = (drawn.colour[mask] - wanted.colour[mask]).astype(np.float64)
        square = float(np.mean(error**2)) if len(error) else 0.0
        result.append(-10 * float(np.log10(square)) if square else np.inf)
    return result


def _height(avatar: Avatar, view: View) -> float:
    """Rows from the first to the last that the avatar covers; 1 at least."""
    image = Player(avatar).frame(view.pose, view.camera, BLACK).image
    rows = np.flatnonzero((1 - image.transmittance > COVERED).any(axis=1))
    return float(rows[-1] - rows[0] + 1) if len(rows) else 1.0
