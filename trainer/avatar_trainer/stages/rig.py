"""A rig as tensors."""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor

from avatar_runtime import Rig
from avatar_trainer.stages.sparse import Entries


@dataclass(frozen=True)
class RigTensors:
    """The arrays of `avatar_runtime.avatar.Rig` for stages morph and skin."""

    vertices: Tensor  # [V, 3]
    morphs: Entries  # by expression
    correctives: Entries  # by pose feature
    late_morphs: Entries  # by late morph
    skin: Entries  # by joint

    @staticmethod
    def of(rig: Rig, dtype: torch.dtype = torch.float32) -> RigTensors:
        """`rig` in that floating type."""
        return RigTensors(
            torch.from_numpy(rig.vertices.copy()).to(dtype),
            Entries.of(rig.morphs, "position", dtype),
            Entries.of(rig.correctives, "position", dtype),
            Entries.of(rig.late_morphs, "position", dtype),
            Entries.of(rig.skin, "weight", dtype),
        )
