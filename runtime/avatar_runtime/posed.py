"""The small inputs of one frame. Stage `joints` runs here, in NumPy, for every backend."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any, TypeVar

import numpy as np
import numpy.typing as npt

from avatar_runtime.avatar import F32, F64, Avatar, Rig
from avatar_runtime.light import Light, LightArrays, head_joint, light_arrays
from avatar_runtime.pose import PoseArrays
from avatar_runtime.stages.groups import GroupTransforms, group_transforms
from avatar_runtime.stages.joints import Joints, joints
from avatar_runtime.stages.morph import morph
from avatar_runtime.stages.skin import skin

T = TypeVar("T")


@dataclass
class Clock:
    """Wall time in milliseconds, summed by stage."""

    milliseconds: dict[str, float] = field(default_factory=dict)

    def timed(self, stage: str, run: Callable[[], T]) -> T:
        """Calls `run`, adds its wall time to `stage`, and returns its result."""
        start = time.perf_counter()
        result = run()
        spent = 1e3 * (time.perf_counter() - start)
        self.milliseconds[stage] = self.milliseconds.get(stage, 0.0) + spent
        return result


@dataclass(frozen=True)
class Posed:
    """The small inputs of one frame: everything that a GPU receives for it."""

    expression_weights: F32  # [K]
    late_weights: F32  # [L]
    pose_feature: F32  # [9 C]
    skin_matrix: F32  # [J, 4, 4] mesh from binding mesh; no joints without a rig
    groups: GroupTransforms
    world_from_avatar: F64  # [4, 4] rigid
    vertices: F32 | None = None  # [V, 3] a posed mesh that replaces the rig's
    light: LightArrays | None = None  # None: stages shadow and light do not run


class Poser:
    """Makes `Posed` for one avatar."""

    def __init__(self, avatar: Avatar) -> None:
        self.avatar = avatar
        self._anchors = _anchor_rig(avatar)

    def posed(self, arrays: PoseArrays, vertices: F32 | None = None, light: Light | None = None) -> Posed:
        """Stage `joints`, the transforms of the groups, and the numbers of a light."""
        state: Joints | None = None
        anchors: F32 | None = None
        if self.avatar.rig is not None:
            state = joints(self.avatar.rig, arrays)
        if self._anchors is not None and state is not None:
            rig, repeats = self._anchors
            anchors = posed_mesh(rig, arrays, state)[repeats]
        return Posed(
            arrays.expression_weights,
            arrays.late_weights,
            np.zeros(self.avatar.blendshapes.correctives.columns, np.float32)
            if state is None
            else state.pose_feature,
            np.zeros((0, 4, 4), np.float32) if state is None else state.skin_matrix,
            group_transforms(self.avatar, state, anchors),
            arrays.world_from_avatar,
            vertices,
            None if light is None else self._lit(light, arrays, state),
        )

    def _lit(self, light: Light, arrays: PoseArrays, state: Joints | None) -> LightArrays | None:
        relight, head = self.avatar.relight, head_joint(self.avatar)
        if relight is None:
            return None
        turned = None if head is None or state is None else state.skin_matrix[head]
        return light_arrays(light, relight, arrays.world_from_avatar, turned)


def posed_mesh(rig: Rig, arrays: PoseArrays, state: Joints) -> F32:
    """Stages morph and skin of `rig`: [V, 3], mesh space."""
    vertices = morph(rig, arrays.expression_weights, state.pose_feature)
    return skin(rig, vertices, state.skin_matrix, arrays.late_weights)


def _anchor_rig(avatar: Avatar) -> tuple[Rig, npt.NDArray[Any]] | None:
    """The rig's anchor vertices alone, and their order with repeats; None where no group needs them."""
    rig = avatar.rig
    if rig is None or all(group.binding != "anchor" for group in avatar.groups):
        return None
    unique, repeats = np.unique(rig.anchor_vertices, return_inverse=True)
    part = replace(
        rig,
        vertices=rig.vertices[unique],
        morphs=rig.morphs.take(unique),
        correctives=rig.correctives.take(unique),
        late_morphs=rig.late_morphs.take(unique),
        skin=rig.skin.take(unique),
    )
    return part, repeats
