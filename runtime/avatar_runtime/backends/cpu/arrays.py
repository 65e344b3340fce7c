"""The inputs of the kernels: NamedTuples of contiguous arrays, always of the types named here.

The inputs of a kernel are read-only, so that one compiled kernel serves arrays of any owner. No NamedTuple that a
parallel kernel takes holds another one: Numba's parallel loops do not accept that.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from avatar_runtime.avatar import F32, F64, U16, U32, Avatar
from avatar_runtime.stages.activate import Splats

U8 = npt.NDArray[np.uint8]
U64 = npt.NDArray[np.uint64]
I32 = npt.NDArray[np.int32]
Array = npt.NDArray[Any]

BLOCK = 64  # Gaussians that a kernel takes at a time: their intermediate values stay in the nearest cache


def read_only(values: npt.ArrayLike, dtype: Any = np.float32, shape: tuple[int, ...] | None = None) -> Array:
    """`values` as a kernel takes an input: contiguous, of `dtype` and read-only. Copies only if necessary.

    Raises ValueError for another shape than `shape`.
    """
    result = np.require(values, dtype, ["C", "A"])
    if shape is not None and result.shape != shape:
        raise ValueError(f"the array has shape {result.shape}; {shape} is needed")
    view = result.view()
    view.flags.writeable = False
    return view


class Base(NamedTuple):
    """Gaussians in training space."""

    mean: F32  # [N, 3]
    log_scale: F32  # [N, 3]
    quat_wxyz: F32  # [N, 4]
    opacity_logit: F32  # [N]
    sh: F32  # [N, 3 K]


class Deltas(NamedTuple):
    """Blendshapes of some attributes side by side, stored by row; `deform.inputs.column_mask` makes `mask`."""

    row_ptr: U32  # [N + 1]
    column: U16  # [E]
    mask: U64  # [N, ceil(K / 64)]
    values: F32  # [E, W]
    room: int  # the most entries of BLOCK rows one after another


class Blendable(NamedTuple):
    """Everything that stage `blend` reads of an avatar."""

    base: Base
    geometry: Deltas  # W = 8: position, quaternion, 0
    shape: Deltas  # W = 4: log scale, opacity logit
    colour: Deltas  # W = 3 K: SH


class Offsets(NamedTuple):
    """Offsets of position by some weight, stored by row: correctives, late morphs, morphs of the mesh."""

    row_ptr: U32  # [R + 1]
    column: U16  # [E]
    offset: F32  # [E, 3]


class Influences(NamedTuple):
    """Skin weights, stored by row."""

    row_ptr: U32  # [R + 1]
    joint: U16  # [E]
    weight: F32  # [E]


class Blocks(NamedTuple):
    """Runs of at most BLOCK Gaussians of one group, and the rules by which the groups are bound."""

    begin: I32  # [B]
    size: I32  # [B]
    group: I32  # [B]
    matrix_by_row: U8  # [G] 1 where each Gaussian has a matrix of its own, from its skin weights
    rotation_by_polar: U8  # [G] 1 where its rotation is that matrix's polar factor
    sh_world: bool  # rule sh_direction is world


class Embedded(NamedTuple):
    """Where each Gaussian sits on the mesh."""

    triangle: U32  # [N]
    vertex: U32  # [N, 3]
    barycentric: F32  # [N, 3]
    displacement: F32  # [N], or [0] for position rule triangle_frame
    local_offset: F32  # [N, 3], or [0, 3] for the position rules along a normal
    local_quat_wxyz: F32  # [N, 4]


class Mesh(NamedTuple):
    """The triangles under the Gaussians and what the binding pose fixes of them."""

    triangles: U32  # [F, 3]
    frame: F64  # [F, 9] canonical, row-major
    size: F64  # [F] canonical
    vertex_triangle_ptr: U32  # [V + 1]
    vertex_triangle: U32  # [3 F]


class EmbeddedRules(NamedTuple):
    """Which formulas move embedded Gaussians, and the numbers that these take."""

    position: int  # the code of rule `position` in rules.json
    scale: int  # the code of rule `scale` in rules.json
    log_unit: float  # ln of training_per_bundle
    damping: float  # constant area_damping, in bundle units squared
    sh_world: bool  # rule sh_direction is world


class PosedMesh(NamedTuple):
    """Triangles and vertices of a posed mesh as the surface rules read them; each frame overwrites them."""

    size: F64  # [F] area, or edge length for rotation rule triangle_frame
    # [F, 13] except for triangle_frame: edge cross edge (3), canonical area times the turn since the binding pose (4);
    # of triangle_frame: the frame, row-major (9), and its quaternion (4)
    triangle: F64
    vertex: F64  # [V, 7] normal (3) and quaternion (4), except for triangle_frame
    matrix: (
        F32  # [V, 9] linear part of the skin matrix, row-major, for bary_vertex_lbs; of other rules [0, 9]
    )


class RigArrays(NamedTuple):
    """A rig's mesh."""

    template: F32  # [V, 3]
    morphs: Offsets
    correctives: Offsets
    late_morphs: Offsets
    skin: Influences


class Sizes(NamedTuple):
    """The sizes of a frame's arrays."""

    expressions: int
    features: int
    late: int
    joints: int
    groups: int

    @staticmethod
    def of(avatar: Avatar) -> Sizes:
        """The sizes of `Posed` for `avatar`."""
        rig = avatar.rig
        return Sizes(
            len(avatar.expressions),
            avatar.blendshapes.correctives.columns if rig is None else 9 * len(rig.corrective_joints),
            len(avatar.eyelids),
            0 if rig is None else rig.joint_count,
            len(avatar.groups),
        )


class PosedArrays(NamedTuple):
    """The inputs of a frame besides the avatar."""

    expression_weights: F32  # [K]
    expression_mask: U64  # [ceil(K / 64)] a bit for each that is not 0
    pose_feature: F32  # [9 C]
    late_weights: F32  # [L]
    skin_matrix: F32  # [J, 16]
    group_matrix: F32  # [G, 12]
    group_rotation: F32  # [G, 9]
    world: F32  # [12], the first rows of world_from_avatar
    world_quat: F32  # [4]


class Out(NamedTuple):
    """Splats as the fused kernels write them, in place."""

    mean: F32  # [N, 3]
    scale: F32  # [N, 3]
    quat_wxyz: F32  # [N, 4]
    opacity: F32  # [N]
    sh: F32  # [N, 3 K]
    sh_rotation: F32  # [N, 9]
    touched: U8  # [N, 2] 0 where `scale` and `opacity`, and `sh`, hold what they are without any expression

    def splats(self) -> Splats:
        """The same memory, as the stages see it."""
        n, width = self.sh.shape
        return Splats(
            self.mean,
            self.scale,
            self.quat_wxyz,
            self.opacity,
            self.sh.reshape(n, width // 3, 3),
            self.sh_rotation.reshape(n, 3, 3),
        )
