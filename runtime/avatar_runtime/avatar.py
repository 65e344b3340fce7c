"""The one in-memory model of an avatar: frozen dataclasses of plain arrays.

Every reader returns an `Avatar`, every writer takes one, every op maps one to another, the runtime plays one.
Gaussians stay in training space (log scale, logit opacity, raw quaternion) because blendshape deltas add
there; `stages.activate` leaves it once. Shapes are checked at the border by `check()`, never inside stages.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

from avatar_runtime.errors import AvatarError

F32 = npt.NDArray[np.float32]
F64 = npt.NDArray[np.float64]
I32 = npt.NDArray[np.int32]
U16 = npt.NDArray[np.uint16]
U32 = npt.NDArray[np.uint32]

BINDINGS = ("skin", "anchor", "joint_mix", "none")
ROTATION_RULES = ("polar3", "head_bone", "none")
SH_DIRECTIONS = ("inverse_rotation", "world")
ANCHOR_RULES = ("repeats", "unique")
HEAD_POSE_IN = ("camera", "mesh")
BACKGROUNDS = ("random", "per_view")  # where it is no one colour


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
        return len(self.row_ptr) - 1

    @property
    def entries(self) -> int:
        return len(self.column)

    @staticmethod
    def empty(rows: int, columns: int, shapes: Mapping[str, tuple[int, ...]]) -> SparseRows:
        """No entries; `shapes` gives the trailing shape of each attribute."""
        return SparseRows(
            np.zeros(rows + 1, np.uint32),
            np.zeros(0, np.uint16),
            {name: np.zeros((0, *shape), np.float32) for name, shape in shapes.items()},
            columns,
        )

    def check(self, name: str, rows: int, columns: int, shapes: Mapping[str, tuple[int, ...]]) -> None:
        """Raise AvatarError unless this has `rows`, `columns`, sorted in-range columns and these attributes."""
        ptr, col = self.row_ptr, self.column
        _expect(
            ptr.dtype == np.uint32 and ptr.shape == (rows + 1,), f"{name}.row_ptr", f"u32[{rows + 1}]", ptr
        )
        _expect(col.dtype == np.uint16 and col.ndim == 1, f"{name}.column", "u16[E]", col)
        if self.columns != columns:
            raise AvatarError(f"has {self.columns} columns, expected {columns}", field=name)
        if ptr[0] != 0 or int(ptr[-1]) != len(col) or (ptr[1:] < ptr[:-1]).any():
            raise AvatarError(
                f"must rise from 0 to the number of entries, {len(col)}", field=f"{name}.row_ptr"
            )
        if len(col):
            if int(col.max()) >= columns:
                entry = int(np.argmax(col >= columns))
                raise AvatarError(
                    f"[{entry}] = {int(col[entry])}, but there are {columns} columns", field=f"{name}.column"
                )
            starts = np.zeros(len(col), bool)
            starts[ptr[:-1][ptr[:-1] < len(col)]] = True
            falls = (col[1:] <= col[:-1]) & ~starts[1:]
            if falls.any():
                entry = int(np.argmax(falls)) + 1
                raise AvatarError("must strictly increase inside a row", field=f"{name}.column[{entry}]")
        if set(self.values) != set(shapes):
            raise AvatarError(f"has attributes {sorted(self.values)}, expected {sorted(shapes)}", field=name)
        for attribute, shape in shapes.items():
            _check_f32(f"{name}.{attribute}", self.values[attribute], (len(col), *shape))


@dataclass(frozen=True)
class Gaussians:
    """N splats in training space, in the binding pose (the pose in which every rule is the identity)."""

    mean: F32  # [N, 3] bundle units, right-handed, +Y up, face +Z
    log_scale: F32  # [N, 3] ln of bundle units
    quat_wxyz: F32  # [N, 4] raw, not necessarily unit
    opacity_logit: F32  # [N]
    sh: F32  # [N, (degree + 1)^2, 3] coefficient-major, graphdeco signs, DC without the + 0.5

    @property
    def count(self) -> int:
        return len(self.mean)

    @property
    def sh_degree(self) -> int:
        return {1: 0, 4: 1, 9: 2, 16: 3}.get(self.sh.shape[1], -1)


@dataclass(frozen=True)
class Blendshapes:
    """What moves each Gaussian besides its joints; every part has one row per Gaussian."""

    geometry: SparseRows  # columns: expressions; mean [E, 3], quat_wxyz [E, 4]
    appearance: SparseRows  # columns: expressions; log_scale [E, 3], opacity_logit [E], sh [E, K, 3]
    correctives: SparseRows  # columns: pose features; mean [E, 3]
    late_morphs: SparseRows  # columns: late morphs; mean [E, 3], added after skinning, unrotated


@dataclass(frozen=True)
class Rig:
    """The mesh and skeleton as trained. The body model is baked in: no FLAME or SMPL is needed to play it."""

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
    anchor_vertices: U32  # [A] vertices that carry the `anchor` groups, repeats kept

    @property
    def joint_count(self) -> int:
        return len(self.joint_names)


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
    binding: str  # one of BINDINGS
    joint_mix: Mapping[str, float] = field(default_factory=dict)  # joint -> factor, for binding joint_mix


@dataclass(frozen=True)
class Rules:
    """Which formula moves what; each value is defined in SPEC.md by formula and source."""

    rotation: str = "polar3"  # ROTATION_RULES, how the skin turns a Gaussian
    rotation_joint: str | None = None  # for head_bone
    sh_direction: str = "inverse_rotation"  # SH_DIRECTIONS
    anchor: str = "repeats"  # ANCHOR_RULES


@dataclass(frozen=True)
class Driving:
    """How the 52 ARKit names reach this avatar.

    `names`: an input drives the expression of the same name. `matrix`: weights and joint rotation vectors are
    `matrix` times the inputs. `none`: no known way, said plainly.
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
    """What the trainer's renderer used."""

    near: float = 0.2  # bundle units
    low_pass: float = 0.3  # pixels squared
    background: tuple[float, float, float] | str = (
        0.0,
        0.0,
        0.0,
    )  # display-referred rgb, "random" or "per_view"


@dataclass(frozen=True)
class Avatar:
    """A trained avatar, whatever system it came from."""

    name: str
    gaussians: Gaussians
    groups: tuple[Group, ...]
    rules: Rules
    expressions: tuple[Expression, ...]
    late_morph_names: tuple[str, ...]
    blendshapes: Blendshapes
    skin: SparseRows  # rows: Gaussians; columns: joints; weight [E]
    rig: Rig | None
    sh_degree: int  # active degree; more coefficients may be stored
    driving: Driving = Driving()
    raster: RasterSettings = RasterSettings()
    head_pose_in: str = "camera"  # HEAD_POSE_IN
    training_per_bundle: float = 1.0  # training units in one bundle unit (metre)
    delta_threshold: Mapping[str, float] = field(
        default_factory=dict
    )  # attribute -> |delta| dropped on reading
    provenance: Mapping[str, Any] = field(default_factory=dict)
    extras: Mapping[str, Any] = field(default_factory=dict)  # unknown manifest keys, kept

    @property
    def expression_names(self) -> tuple[str, ...]:
        return tuple(e.name for e in self.expressions)

    def check(self) -> Avatar:
        """Return self, or raise AvatarError that names the field whose shape, type, range or value is wrong."""
        _check_gaussians(self.gaussians)
        if not 0 <= self.sh_degree <= self.gaussians.sh_degree:
            raise AvatarError(
                f"is {self.sh_degree}; 0..{self.gaussians.sh_degree} is stored", field="sh_degree"
            )
        _check_groups(self)
        _check_names("expressions", self.expression_names)
        _check_names("late_morph_names", self.late_morph_names)
        n, k = self.gaussians.count, len(self.expressions)
        joints = self.rig.joint_count if self.rig else 0
        features = 9 * len(self.rig.corrective_joints) if self.rig else 0
        b, sh = self.blendshapes, self.gaussians.sh.shape[1:]
        b.geometry.check("geometry", n, k, {"mean": (3,), "quat_wxyz": (4,)})
        b.appearance.check("appearance", n, k, {"log_scale": (3,), "opacity_logit": (), "sh": sh})
        b.correctives.check("correctives", n, features, {"mean": (3,)})
        b.late_morphs.check("late_morphs", n, len(self.late_morph_names), {"mean": (3,)})
        self.skin.check("skin", n, joints, {"weight": ()})
        if self.rig:
            _check_rig(self.rig, k, len(self.late_morph_names))
        _check_rules(self)
        return self


def _expect(ok: bool, name: str, want: str, got: npt.NDArray[Any]) -> None:
    if not ok:
        raise AvatarError(f"expected {want}, got {got.dtype}{list(got.shape)}", field=name)


def _check_f32(name: str, array: npt.NDArray[Any], shape: Sequence[int]) -> None:
    _expect(array.dtype == np.float32 and array.shape == tuple(shape), name, f"float32{list(shape)}", array)
    # A float64 sum is finite exactly when every float32 is: one pass, no mask of the array's size.
    with np.errstate(invalid="ignore"):  # inf - inf
        total = np.sum(array, dtype=np.float64)
    if not np.isfinite(total):
        row = np.unravel_index(int(np.argmax(~np.isfinite(array))), array.shape)
        raise AvatarError(f"is {array[row]} at row {int(row[0])}; finite numbers are needed", field=name)


def _check_gaussians(g: Gaussians) -> None:
    n = len(g.mean)
    if n == 0:
        raise AvatarError("an avatar needs at least one Gaussian", field="gaussians")
    for name, array, shape in (
        ("mean", g.mean, (n, 3)),
        ("log_scale", g.log_scale, (n, 3)),
        ("quat_wxyz", g.quat_wxyz, (n, 4)),
        ("opacity_logit", g.opacity_logit, (n,)),
    ):
        _check_f32(f"gaussians.{name}", array, shape)
    if g.sh.ndim != 3 or g.sh.shape[1] not in (1, 4, 9, 16):
        _expect(False, "gaussians.sh", "float32[N, 1 | 4 | 9 | 16, 3]", g.sh)
    _check_f32("gaussians.sh", g.sh, (n, g.sh.shape[1], 3))


def _check_groups(avatar: Avatar) -> None:
    at = 0
    for group in avatar.groups:
        where = f"groups.{group.name}"
        if group.first != at or group.count < 1:
            raise AvatarError(f"covers {group.first}+{group.count}, but row {at} comes next", field=where)
        at += group.count
        if group.binding not in BINDINGS:
            raise AvatarError(f"binding {group.binding!r} is none of {', '.join(BINDINGS)}", field=where)
        if group.binding != "none" and avatar.rig is None:
            raise AvatarError(f"binding {group.binding!r} needs a rig", field=where)
        if group.binding == "anchor" and avatar.rig is not None and len(avatar.rig.anchor_vertices) < 3:
            raise AvatarError("binding 'anchor' needs at least three anchor vertices in the rig", field=where)
        if (group.binding == "joint_mix") != bool(group.joint_mix):
            raise AvatarError("joint_mix goes with binding 'joint_mix'", field=where)
        for joint in group.joint_mix:
            if avatar.rig is not None and joint not in avatar.rig.joint_names:
                raise AvatarError(f"joint_mix names {joint!r}, which the rig lacks", field=where)
    if at != avatar.gaussians.count:
        raise AvatarError(f"cover {at} of {avatar.gaussians.count} Gaussians", field="groups")
    _check_names("groups", tuple(g.name for g in avatar.groups))


def _check_names(what: str, names: tuple[str, ...]) -> None:
    seen: set[str] = set()
    for name in names:
        if not name or name in seen:
            raise AvatarError(f"{name!r} is empty or stands twice", field=what)
        seen.add(name)


def _check_rig(rig: Rig, expressions: int, late: int) -> None:
    v, j = len(rig.vertices), rig.joint_count
    _check_f32("rig.vertices", rig.vertices, (v, 3))
    t = rig.triangles
    _expect(t.dtype == np.uint32 and t.ndim == 2 and t.shape[1:] == (3,), "rig.triangles", "u32[F, 3]", t)
    anchors = rig.anchor_vertices
    _expect(anchors.dtype == np.uint32 and anchors.ndim == 1, "rig.anchor_vertices", "u32[A]", anchors)
    for name, index in (("triangles", t), ("anchor_vertices", anchors)):
        if index.size and int(index.max()) >= v:
            raise AvatarError(f"holds {int(index.max())}, but the rig has {v} vertices", field=f"rig.{name}")
    rig.morphs.check("rig.morphs", v, expressions, {"position": (3,)})
    rig.correctives.check("rig.correctives", v, 9 * len(rig.corrective_joints), {"position": (3,)})
    rig.late_morphs.check("rig.late_morphs", v, late, {"position": (3,)})
    rig.skin.check("rig.skin", v, j, {"weight": ()})
    _check_names("rig.joint_names", rig.joint_names)
    _expect(
        rig.parents.dtype == np.int32 and rig.parents.shape == (j,), "rig.parents", f"i32[{j}]", rig.parents
    )
    if (rig.parents >= np.arange(j)).any() or (rig.parents < -1).any():
        raise AvatarError("a parent must come before its children; a root is -1", field="rig.parents")
    for name, matrix in (("rest_local", rig.rest_local), ("inverse_bind_matrix", rig.inverse_bind_matrix)):
        _check_f32(f"rig.{name}", matrix, (j, 4, 4))
        volume = np.abs(np.linalg.det(matrix.astype(np.float64)))
        sound = (matrix[:, 3] == (0, 0, 0, 1)).all(axis=1) & (volume > 1e-18)
        if not sound.all():
            raise AvatarError(
                "is no affine matrix with an inverse", field=f"rig.{name}[{int(np.argmin(sound))}]"
            )
    _check_f32("rig.joint_basis", rig.joint_basis, (expressions, j, 3))
    c = rig.corrective_joints
    _expect(c.dtype == np.int32 and c.ndim == 1, "rig.corrective_joints", "i32[C]", c)
    if c.size and (int(c.max()) >= j or int(c.min()) < 0):
        raise AvatarError(f"must lie in 0..{j - 1}", field="rig.corrective_joints")


def _check_rules(avatar: Avatar) -> None:
    rules = avatar.rules
    for name, value, known in (
        ("rules.rotation", rules.rotation, ROTATION_RULES),
        ("rules.sh_direction", rules.sh_direction, SH_DIRECTIONS),
        ("rules.anchor", rules.anchor, ANCHOR_RULES),
        ("head_pose_in", avatar.head_pose_in, HEAD_POSE_IN),
    ):
        if value not in known:
            raise AvatarError(f"{value!r} is none of {', '.join(known)}", field=name)
    _check_numbers(avatar)
    names = avatar.rig.joint_names if avatar.rig else ()
    d = avatar.driving
    for name, joint in (
        ("rules.rotation_joint", rules.rotation_joint),
        ("driving.head_joint", d.head_joint),
        ("driving.left_eye_joint", d.left_eye_joint),
        ("driving.right_eye_joint", d.right_eye_joint),
    ):
        if joint is not None and joint not in names:
            raise AvatarError(f"{joint!r} is no joint of the rig", field=name)
    if rules.rotation == "head_bone" and rules.rotation_joint is None:
        raise AvatarError("rule head_bone needs a rotation_joint", field="rules.rotation_joint")
    if d.mode not in ("names", "matrix", "none"):
        raise AvatarError(f"{d.mode!r} is none of names, matrix, none", field="driving.mode")
    if (d.mode == "matrix") != (d.matrix is not None):
        raise AvatarError("a matrix goes with mode 'matrix'", field="driving.matrix")
    if d.matrix is not None:
        _check_f32("driving.matrix", d.matrix, (len(d.outputs), len(d.inputs)))
        _check_outputs(avatar)


def _check_outputs(avatar: Avatar) -> None:
    known = {f"expression/{name}" for name in avatar.expression_names}
    known |= {f"eyelid/{name}" for name in avatar.late_morph_names}
    joints = avatar.rig.joint_names if avatar.rig else ()
    known |= {f"joint/{name}/{axis}" for name in joints for axis in "xyz"}
    for output in avatar.driving.outputs:
        if output not in known:
            raise AvatarError(
                f"{output!r} is no expression/NAME, eyelid/NAME or joint/NAME/x|y|z of this avatar",
                field="driving.outputs",
            )
    _check_names("driving.outputs", avatar.driving.outputs)


def _check_numbers(avatar: Avatar) -> None:
    """What no array holds: finite, and of a sign that makes sense."""
    raster, u = avatar.raster, avatar.training_per_bundle
    factors = [f for group in avatar.groups for f in group.joint_mix.values()]
    colour = () if isinstance(raster.background, str) else raster.background
    for name, values in (
        ("groups.joint_mix", factors),
        ("raster.near", (raster.near,)),
        ("raster.low_pass", (raster.low_pass,)),
        ("raster.background", colour),
        ("training_per_bundle", (u,)),
        ("driving.head_pivot", avatar.driving.head_pivot),
        ("expressions.range", [end for e in avatar.expressions for end in e.range]),
    ):
        if not np.isfinite(np.array(values, np.float64)).all():
            raise AvatarError("must be finite", field=name)
    if raster.near <= 0 or raster.low_pass < 0 or u <= 0:
        raise AvatarError(
            "near and training_per_bundle must be positive, low_pass not negative", field="raster"
        )
    if isinstance(raster.background, str) and raster.background not in BACKGROUNDS:
        raise AvatarError(
            f"{raster.background!r} is none of {', '.join(BACKGROUNDS)}", field="raster.background"
        )
