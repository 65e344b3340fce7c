"""The tensors of clips.safetensors, both directions; names and rates stand in the manifest."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy.typing as npt

from avatar_runtime.avatar import Clip
from avatar_runtime.codec.tensors import tensor
from avatar_runtime.io.errors import AvatarError

Tensors = dict[str, npt.NDArray[Any]]

ARRAYS = ("expression_weights", "late_weights", "joint_delta", "world_from_avatar")


def clip_tensors(clips: Sequence[Clip]) -> Tensors:
    """What clips.safetensors holds: tensor "I.ARRAY" is that of clip I of the manifest."""
    return {f"{i}.{name}": getattr(clip, name) for i, clip in enumerate(clips) for name in ARRAYS}


def read_clip_tensors(tensors: Tensors, listed: Sequence[Mapping[str, Any]], file: str) -> tuple[Clip, ...]:
    """Inverse of `clip_tensors`; `listed` is the manifest's. Raises AvatarError for a missing or short tensor."""
    clips = []
    for i, entry in enumerate(listed):
        arrays = {name: tensor(tensors, f"{i}.{name}", file) for name in ARRAYS}
        for name, array in arrays.items():
            if array.ndim == 0 or len(array) != entry["frames"]:
                raise AvatarError(
                    f"has shape {list(array.shape)}, the manifest says {entry['frames']} frames",
                    file=file,
                    field=f"{i}.{name}",
                )
        clips.append(Clip(entry["name"], float(entry["fps"]), **arrays))
    return tuple(clips)
