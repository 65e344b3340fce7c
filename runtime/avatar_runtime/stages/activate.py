"""Stage `activate`: log scales, opacity logits and raw quaternions become scales, opacities and unit quaternions."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any

import numpy as np
import numpy.typing as npt

from avatar_runtime.avatar import F32
from avatar_runtime.stages.bind import Bound


@dataclass(frozen=True)
class Splats:
    """Gaussians as the rasteriser takes them, world space."""

    mean: F32  # [N, 3]
    scale: F32  # [N, 3] standard deviations
    quat_wxyz: F32  # [N, 4] used as it is
    opacity: F32  # [N] 0..1
    sh: F32  # [N, K, 3]
    sh_rotation: F32 | None = None  # [N, 3, 3]; SH are evaluated along sh_rotation^T d; None: along d

    @staticmethod
    def of(arrays: Mapping[str, npt.NDArray[Any]]) -> Splats:
        """The splats whose arrays stand in `arrays` under the names of the fields; other names are ignored."""
        return Splats(**{field.name: arrays[field.name] for field in fields(Splats)})


def activate(bound: Bound) -> Splats:
    """exp of the scale, sigmoid of the opacity, unit quaternion."""
    g = bound.gaussians
    with np.errstate(
        over="ignore"
    ):  # a scale beyond float32 becomes infinite, and `project` does not draw it
        scale = np.exp(g.log_scale)
    norm = np.sqrt(np.sum(g.quat_wxyz * g.quat_wxyz, axis=-1, keepdims=True))
    length: F32 = np.maximum(norm, np.float32(1e-12))
    return Splats(
        g.mean,
        scale,
        g.quat_wxyz / length,
        sigmoid(g.opacity_logit),
        g.sh,
        bound.rotation,
    )


def sigmoid(x: F32) -> F32:
    """1 / (1 + e^-x), without overflow."""
    e = np.exp(-np.abs(x))
    result: F32 = np.where(x >= 0, np.float32(1), e) / (1 + e)
    return result
