"""The one in-memory model of an avatar: frozen dataclasses of plain arrays.

Every reader returns an `Avatar`, every writer takes one, every op maps one to another, the runtime plays one.
Gaussians stay in training space (log scale, logit opacity, raw quaternion) because blendshape deltas add
there; stage `activate` leaves it, once. `checks.avatar.check_avatar` checks shapes, types and ranges where an
avatar enters or leaves the program; stages check nothing again.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

F32 = npt.NDArray[np.float32]
F64 = npt.NDArray[np.float64]
I32 = npt.NDArray[np.int32]
I64 = npt.NDArray[np.int64]
U16 = npt.NDArray[np.uint16]
U32 = npt.NDArray[np.uint32]


@dataclass(frozen=True)
class SparseRows:
    """A sparse matrix stored by row (Gaussian or vertex), with a small array of values at each entry.

    Row i owns the entries row_ptr[i]:row_ptr[i+1]; columns (expressions, pose features, late morphs or
    joints) strictly increase inside a row. By row, so that one GPU thread sums one row without atomics.
    """

    row_ptr: U32  # [R + 1]
    column: U16  # [E]
    values: Mapping[str, F32]  # attribute -> [E, ...]
    columns: int  # number of columns

    @property
    def rows(self) -> int:
        """How many rows there are, R."""
        return len(self.row_ptr) - 1

    @property
    def entries(self) -> int:
        """How many entries there are, E."""
        return len(self.column)

    def take(self, rows: npt.NDArray[Any]) -> SparseRows:
        """The rows named by `rows`, in that order."""
        begin = self.row_ptr[rows].astype(np.int64)
        count = self.row_ptr[rows + 1].astype(np.int64) - begin
        ptr = np.concatenate([[0], np.cumsum(count)])
        entry = np.arange(ptr[-1]) + np.repeat(begin - ptr[:-1], count)
        values = {name: value[entry] for name, value in self.values.items()}
        return SparseRows(ptr.astype(np.uint32), self.column[entry], values, self.columns)

    @staticmethod
    def empty(rows: int, columns: int, shapes: Mapping[str, tuple[int, ...]]) -> SparseRows:
        """No entries; `shapes` gives the trailing shape of each attribute."""
        return SparseRows(
            np.zeros(rows + 1, np.uint32),
            np.zeros(0, np.uint16),
            {name: np.zeros((0, *shape), np.float32) for name, shape in shapes.items()},
            columns,
        )


@dataclass(frozen=True)
class Gaussians:
    """N splats in training space, in the binding pose (the pose in which every rule is the identity).

    For binding `surface`, mean and quat_wxyz are what the embedding gives in that pose; posing does not read them.
    """

    mean: F32  # [N, 3] bundle units, right-handed, +Y up, face +Z
    log_scale: F32  # [N, 3] ln of bundle units
    quat_wxyz: F32  # [N, 4] raw, not necessarily unit
    opacity_logit: F32  # [N]
    sh: F32  # [N, (degree + 1)^2, 3] coefficient-major, graphdeco signs, DC without the + 0.5

    @property
    def count(self) -> int:
        """How many Gaussians there are, N."""
        return len(self.mean)

    @property
    def sh_degree(self) -> int:
        """The SH degree that is stored, 0 to 3; -1 where the shape of `sh` fits none."""
        return {1: 0, 4: 1, 9: 2, 16: 3}.get(self.sh.shape[1], -1)


@dataclass(frozen=True)
class Blendshapes:
    """The sparse deltas of each Gaussian; every part has one row per Gaussian."""

    geometry: SparseRows  # columns: expressions; mean [E, 3], quat_wxyz [E, 4]
    appearance: SparseRows  # columns: expressions; log_scale [E, 3], opacity_logit [E], sh [E, K, 3]
    correctives: SparseRows  # columns: pose features; mean [E, 3]
    late_morphs: SparseRows  # columns: late morphs; mean [E, 3], added after skinning, unrotated


@dataclass(frozen=True)
class Rig:
    """The mesh and skeleton as trained. The body model is baked in: playing needs neither FLAME nor SMPL."""

    vertices: F32  # [V, 3] template with the identity shape
    triangles: U32  # [F, 3]
    morphs: SparseRows  # rows: vertices; columns: expressions; position [E, 3]
    correctives: SparseRows  # rows: vertices; columns: pose features; position [E, 3]
    late_morphs: SparseRows  # rows: vertices; columns: late morphs; position [E, 3]
    skin: SparseRows  # rows: vertices; columns: joints; weight [E]; all influences
    joint_names: tuple[str, ...]  # [J], a parent before its children
    parents: I32  # [J], -1 for a root
    rest_local: F32  # [J, 4, 4] parent_from_joint at rest
    inverse_bind_matrix: F32  # [J, 4, 4] joint_from_mesh
    joint_basis: F32  # [K, J, 3] how far each expression moves each rest joint, mesh space
    corrective_joints: (
        I32  # [C]; pose feature 9 c + i is entry i (row-major) of R - I of joint corrective_joints[c]
    )
    anchor_vertices: U32  # [A] vertices that groups of binding `anchor` follow, repeats kept

    @property
    def joint_count(self) -> int:
        """How many joints there are, J."""
        return len(self.joint_names)


@dataclass(frozen=True)
class Embedding:
    """Where each Gaussian is embedded in a triangle mesh, for binding `surface`; row = Gaussian id.

    The mesh is that of the binding pose, in which every surface rule is the identity. It need not be the rig's
    template: SplattingAvatar embeds in the first frame's posed mesh. Where there is a rig, its vertices and
    triangles are numbered as here.
    """

    canonical_vertices: F32  # [V, 3] bundle units
    triangles: U32  # [F, 3]
    triangle: U32  # [N] row of `triangles`
    barycentric: F32  # [N, 3] weights of the triangle's corners 0, 1, 2; they add up to 1
    displacement: F32  # [N] bundle units along the interpolated normal; [0] for position rule triangle_frame
    local_offset: F32  # [N, 3] in the triangle's frame, times its size; [0, 3] for position rule normal
    local_quat_wxyz: F32  # [N, 4] raw, before the mesh turns it

    @property
    def vertex_ids(self) -> U32:
        """[N, 3] the three vertices under each Gaussian: triangles[triangle]."""
        return self.triangles[self.triangle]


@dataclass(frozen=True)
class Relight:
    """What stage `light` needs: which way each Gaussian faces, and the light in which the avatar was captured."""

    normal: F32  # [N, 3] unit, in the axes of each Gaussian: its quaternion turns it into the world
    ambient: F32  # [9, 3] linear: what the captured light gave to a white matt surface, as SH of its normal
    frame: str  # rules.LIGHT_FRAMES: what the captured light moves with
    centre: tuple[
        float, float, float
    ]  # avatar space; what casts shadows lies within `radius` of it in every pose
    radius: float  # bundle units
    joint: str | None = None  # what frame `head` moves with; None: the avatar as a whole


@dataclass(frozen=True)
class Clip:
    """A named sequence of T poses at an even rate; arrays are in the order of the avatar's names."""

    name: str
    fps: float
    expression_weights: F32  # [T, K]
    late_weights: F32  # [T, L]
    joint_delta: F32  # [T, J, 4, 4] parent_from_joint = rest_local @ delta
    world_from_avatar: F32  # [T, 4, 4] rigid

    @property
    def frames(self) -> int:
        """How many poses the clip has, T."""
        return len(self.expression_weights)

    @property
    def seconds(self) -> float:
        """From the first frame to the last."""
        return (self.frames - 1) / self.fps


@dataclass(frozen=True)
class Enhancer:
    """An optional network that improves a drawn image; without it, a player shows the raw avatar.

    The file is stored unchanged; `avatar_runtime.enhance` checks its contents before running it.
    """

    onnx: bytes  # f32[1, 3, H, W] to the same shape; display-referred, over the background; any H and W
    input: str  # name in the graph
    output: str
    trained_width: int  # pixels of the images it was trained on
    trained_height: int
    psnr_raw_db: float | None  # of the avatar without it; None: not measured
    psnr_enhanced_db: float | None
    measured_on: str  # the images that these figures were measured on


@dataclass(frozen=True)
class Expression:
    """A named blendshape weight. Its index in `Avatar.expressions` is the column of every expression matrix."""

    name: str
    aliases: tuple[str, ...] = ()
    range: tuple[float, float] = (0.0, 1.0)


@dataclass(frozen=True)
class Group:
    """A run of Gaussians with one binding; groups lie in draw order and cover all rows."""

    name: str
    first: int
    count: int
    binding: str  # one of rules.BINDINGS
    joint_mix: Mapping[str, float] = field(default_factory=dict)  # joint -> factor, for binding joint_mix


@dataclass(frozen=True)
class Rules:
    """Which formula moves what; each value is defined in SPEC.md by formula and source."""

    rotation: str = "polar3"  # rules.ROTATION_RULES, how skin or surface rotate a Gaussian
    rotation_joint: str | None = None  # for head_bone
    sh_direction: str = "inverse_rotation"  # rules.SH_DIRECTIONS
    anchor: str = "repeats"  # rules.ANCHOR_RULES
    position: str = "normal"  # rules.POSITION_RULES, where an embedded Gaussian is placed
    scale: str = "none"  # rules.SCALE_RULES, how the surface stretches a Gaussian
    quaternion_sign: str = (
        "w_positive"  # rules.QUATERNION_SIGNS, of the quaternions that vertex_quaternion averages
    )


@dataclass(frozen=True)
class Driving:
    """How the 52 ARKit names reach this avatar.

    `names`: an input drives the expression of the same name. `matrix`: weights and joint rotation vectors are
    `matrix` times the inputs. `none`: ARKit names do not drive this avatar.
    """

    mode: str = "none"  # "names" | "matrix" | "none"
    inputs: tuple[str, ...] = ()  # [I] ARKit names, for matrix
    outputs: tuple[str, ...] = ()  # [O] "expression/NAME", "eyelid/NAME" or "joint/NAME/x|y|z" (radians)
    matrix: F32 | None = None  # [O, I]
    head_joint: str | None = None  # takes the head rotation; None: it goes to world_from_avatar
    head_pivot: tuple[float, float, float] = (0.0, 0.0, 0.0)  # mesh space, for world_from_avatar
    left_eye_joint: str | None = None
    right_eye_joint: str | None = None


@dataclass(frozen=True)
class RasterSettings:
    """Settings of the renderer that the avatar was trained with."""

    near: float = 0.2  # bundle units
    low_pass: float = 0.3  # pixels squared
    background: tuple[float, float, float] | str = (
        0.0,
        0.0,
        0.0,
    )  # display-referred rgb, "random" or "per_view"


PLAYED = (  # the fields of an Avatar that its program depends on
    "gaussians",
    "groups",
    "rules",
    "blendshapes",
    "skin",
    "rig",
    "sh_degree",
    "raster",
    "training_per_bundle",
    "embedding",
    "relight",
)


@dataclass(frozen=True, eq=False)
class Packed:
    """What a pack knows about the avatar that was read from it: its other levels, and a program ready for the GPU.

    The program plays the very arrays in `parts`. An avatar with other arrays is baked anew.
    """

    program: Any  # an avatar_runtime.program.model.Program
    level: int  # which of the program's levels this avatar is; 0 is the finest
    levels: int
    at: Callable[[int], Avatar]  # the avatar at another level
    parts: Mapping[str, Any]  # field of Avatar -> the value that the program plays

    @staticmethod
    def of(avatar: Avatar, program: Any, level: int, levels: int, at: Callable[[int], Avatar]) -> Packed:
        """What `avatar`, which is `level` of `program`, keeps of its pack."""
        return Packed(program, level, levels, at, {name: getattr(avatar, name) for name in PLAYED})

    def fits(self, avatar: Avatar) -> bool:
        """Whether `avatar` still has the parts that the program plays."""
        return all(getattr(avatar, name) is value for name, value in self.parts.items())


@dataclass(frozen=True)
class Avatar:
    """A trained avatar, whatever system it came from."""

    name: str
    gaussians: Gaussians
    groups: tuple[Group, ...]
    rules: Rules
    expressions: tuple[Expression, ...]
    eyelids: tuple[str, ...]  # names of the late morphs, in column order
    blendshapes: Blendshapes
    skin: SparseRows  # rows: Gaussians; columns: joints; weight [E]
    rig: Rig | None
    sh_degree: int  # active degree; more coefficients may be stored
    driving: Driving = Driving()
    raster: RasterSettings = RasterSettings()
    head_pose_in: str = "camera"  # rules.HEAD_POSE_IN
    training_per_bundle: float = 1.0  # training units in one bundle unit (metre)
    delta_threshold: Mapping[str, float] = field(
        default_factory=dict
    )  # attribute -> |delta| dropped on reading
    provenance: Mapping[str, Any] = field(default_factory=dict)
    extras: Mapping[str, Any] = field(default_factory=dict)  # unknown manifest keys, kept
    embedding: Embedding | None = None  # where the binding is surface; all groups have it then, or none
    clips: tuple[Clip, ...] = ()
    enhancer: Enhancer | None = None
    relight: Relight | None = None  # None: no light of a scene changes its colours
    packed: Packed | None = field(default=None, compare=False, repr=False)  # if it was read from a pack

    @property
    def expression_names(self) -> tuple[str, ...]:
        """Names of the expressions, [K], in column order."""
        return tuple(e.name for e in self.expressions)
