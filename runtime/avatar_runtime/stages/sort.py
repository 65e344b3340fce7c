"""Stage `sort`: the order in which splats are composited."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from avatar_runtime.stages.project import Projected


def sort(projected: Projected) -> npt.NDArray[np.int64]:
    """Ids of the drawn splats, front to back: by view z as float32, ties by id."""
    drawn = np.flatnonzero(projected.radius)
    return drawn[np.argsort(projected.depth[drawn], kind="stable")]
