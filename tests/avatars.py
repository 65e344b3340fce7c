"""A deliberately tiny avatar with a value in every field, so that a field that gets lost is missed; and a bare one."""

from __future__ import annotations

from dataclasses import fields, is_dataclass, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from avatar_runtime.avatar import (
    Avatar,
    Blendshapes,
    Clip,
    Driving,
    Embedding,
    Expression,
    Gaussians,
    Group,
    RasterSettings,
    Rig,
    Rules,
    SparseRows,
)
from avatar_runtime.checks.avatar import check_avatar
from avatar_runtime.rotation import homogeneous, matrix_from_rotvec
from avatar_runtime.rules import NORMAL_POSITIONS
from avatar_runtime.stages.surface import binding_pose
from tests.enhancers import tiny

Array = npt.NDArray[Any]

GROUPS = (
    Group("face", 0, 24, "skin"),
    Group("upper_teeth", 24, 8, "anchor"),
    Group("lower_teeth", 32, 8, "joint_mix", {"neck": 0.0625, "jaw": 0.875}),
    Group("hair", 40, 8, "none"),
)
COUNT = 48
VERTICES = 20
JOINTS = ("root", "neck", "jaw", "leftEye", "rightEye")
PARENTS = (-1, 0, 1, 1, 1)
CORRECTIVE_JOINTS = (2, 3)
EXPRESSIONS = (
    Expression("jawOpen", ("JawOpen", "jaw_open"), (0.0, 1.0)),
    Expression("mouthSmileLeft", ("mouthSmile_L",), (-0.25, 1.25)),
    Expression("mouthSmileRight", (), (0.0, 0.5)),
    Expression("exp_003", (), (-2.0, 2.0)),
)
LATE_MORPHS = ("left", "right")
INPUTS = ("jawOpen", "eyeBlinkLeft", "mouthSmileLeft")
OUTPUTS = ("expression/jawOpen", "eyelid/left", "joint/jaw/x", "joint/leftEye/y", "expression/exp_003")


def full_avatar(seed: int = 0) -> Avatar:
    """48 Gaussians about the size of a head: all four bindings, every sparse part ragged, a turned rest pose.

    SH of degree 3 are stored, degree 2 is active; no setting has its default value.
    """
    rng = np.random.default_rng(seed)
    k, late, features = len(EXPRESSIONS), len(LATE_MORPHS), 9 * len(CORRECTIVE_JOINTS)
    return check_avatar(
        Avatar(
            name="Full Ävatar",
            gaussians=_gaussians(rng),
            groups=GROUPS,
            rules=Rules("polar3", "neck", "inverse_rotation", "unique", quaternion_sign="largest_positive"),
            expressions=EXPRESSIONS,
            eyelids=LATE_MORPHS,
            blendshapes=Blendshapes(
                _ragged(rng, COUNT, k, {"mean": ((3,), 3e-3), "quat_wxyz": ((4,), 0.1)}),
                _ragged(
                    rng,
                    COUNT,
                    k,
                    {"log_scale": ((3,), 0.2), "opacity_logit": ((), 0.5), "sh": ((16, 3), 0.1)},
                ),
                _ragged(rng, COUNT, features, {"mean": ((3,), 2e-3)}),
                _ragged(rng, COUNT, late, {"mean": ((3,), 4e-3)}),
            ),
            skin=_skin(rng, COUNT),
            rig=_rig(rng),
            sh_degree=2,
            driving=Driving(
                "matrix",
                INPUTS,
                OUTPUTS,
                _normal(rng, len(OUTPUTS), len(INPUTS), scale=0.3),
                head_joint="neck",
                head_pivot=(0.01, -0.1, 0.02),
                left_eye_joint="leftEye",
                right_eye_joint="rightEye",
            ),
            raster=RasterSettings(near=0.05, low_pass=0.25, background=(0.25, 0.5, 1.0)),
            head_pose_in="mesh",
            training_per_bundle=4.0,
            delta_threshold={"mean": 1e-8, "sh": 1e-7},
            provenance={"system": "made_for_tests", "rows_dropped": [3, 17], "author": "nobody"},
            extras={"extras": {"note": ["kept", 1, None, 0.1]}, "someVendor": {"deep": [{"er": True}]}},
            clips=(_clip(rng, "nod", 24.0, 5), _clip(rng, "blink", 30.0, 3)),
            enhancer=tiny(),
        )
    )


def surface_avatar(seed: int = 0, rules: Rules | None = None, *, rigged: bool = True) -> Avatar:
    """`full_avatar` with its Gaussians on the rig's mesh instead of its skin; the canonical mesh is not the template.

    `rules` of SplattingAvatar's code by default, or any of rules.SURFACE_RULES; u = 4.
    """
    rng = np.random.default_rng(seed + 1)
    full = full_avatar(seed)
    assert full.rig is not None
    rules = rules or Rules("vertex_quaternion", scale="log_area")
    triangle = rng.integers(0, len(full.rig.triangles), COUNT)
    by_normal = rules.position in NORMAL_POSITIONS
    embedding = Embedding(
        canonical_vertices=full.rig.vertices + _normal(rng, VERTICES, 3, scale=2e-3),
        triangles=full.rig.triangles,
        triangle=triangle.astype(np.uint32),
        barycentric=rng.dirichlet([1, 1, 1], COUNT).astype(np.float32),
        displacement=_normal(rng, COUNT if by_normal else 0, scale=3e-3),
        local_offset=_normal(rng, 0 if by_normal else COUNT, 3, scale=0.1),
        local_quat_wxyz=_normal(rng, COUNT, 4),
    )
    mean, quat_wxyz = binding_pose(embedding, rules, full.training_per_bundle)
    k, late = len(EXPRESSIONS), len(LATE_MORPHS)
    features = 9 * len(CORRECTIVE_JOINTS) if rigged else 0
    return check_avatar(
        replace(
            full,
            gaussians=replace(full.gaussians, mean=mean, quat_wxyz=quat_wxyz),
            groups=(Group("head", 0, 40, "surface"), Group("hair", 40, 8, "surface")),
            rules=rules,
            blendshapes=Blendshapes(
                SparseRows.empty(COUNT, k, {"mean": (3,), "quat_wxyz": (4,)}),
                SparseRows.empty(COUNT, k, {"log_scale": (3,), "opacity_logit": (), "sh": (16, 3)}),
                SparseRows.empty(COUNT, features, {"mean": (3,)}),
                SparseRows.empty(COUNT, late, {"mean": (3,)}),
            ),
            skin=SparseRows.empty(COUNT, len(JOINTS) if rigged else 0, {"weight": ()}),
            rig=full.rig if rigged else None,
            driving=full.driving if rigged else Driving(),
            embedding=embedding,
            clips=full.clips if rigged else (),
        )
    )


def _clip(rng: np.random.Generator, name: str, fps: float, frames: int) -> Clip:
    turns = matrix_from_rotvec(rng.normal(0, 0.2, (frames, len(JOINTS), 3)))
    moves = rng.normal(0, 2e-3, (frames, len(JOINTS), 3))
    return Clip(
        name,
        fps,
        rng.uniform(-0.2, 1.1, (frames, len(EXPRESSIONS))).astype(np.float32),
        rng.uniform(0, 1, (frames, len(LATE_MORPHS))).astype(np.float32),
        homogeneous(turns, moves).astype(np.float32),
        homogeneous(
            matrix_from_rotvec(rng.normal(0, 0.3, (frames, 3))), rng.normal(0, 0.02, (frames, 3))
        ).astype(np.float32),
    )


def _gaussians(rng: np.random.Generator) -> Gaussians:
    mean = _normal(rng, COUNT, 3, scale=0.06)
    log_scale = _normal(rng, COUNT, 3, scale=0.4) + np.float32(np.log(0.006))
    return Gaussians(
        mean,
        log_scale,
        _normal(rng, COUNT, 4),
        _normal(rng, COUNT, scale=2.0),
        _normal(rng, COUNT, 16, 3, scale=0.3),
    )


def _rig(rng: np.random.Generator) -> Rig:
    k, late, features = len(EXPRESSIONS), len(LATE_MORPHS), 9 * len(CORRECTIVE_JOINTS)
    local = homogeneous(matrix_from_rotvec(rng.normal(0, 0.3, (5, 3))), rng.normal(0, 0.03, (5, 3)))
    world: list[Array] = []
    for joint, parent in enumerate(PARENTS):
        world.append(local[joint] if parent < 0 else world[parent] @ local[joint])
    return Rig(
        vertices=_normal(rng, VERTICES, 3, scale=0.06),
        triangles=np.array([[i, (i + 1) % VERTICES, (i + 7) % VERTICES] for i in range(VERTICES)], np.uint32),
        morphs=_ragged(rng, VERTICES, k, {"position": ((3,), 3e-3)}),
        correctives=_ragged(rng, VERTICES, features, {"position": ((3,), 2e-3)}),
        late_morphs=_ragged(rng, VERTICES, late, {"position": ((3,), 4e-3)}),
        skin=_skin(rng, VERTICES),
        joint_names=JOINTS,
        parents=np.array(PARENTS, np.int32),
        rest_local=local.astype(np.float32),
        inverse_bind_matrix=np.linalg.inv(np.stack(world)).astype(np.float32),
        joint_basis=_normal(rng, k, len(JOINTS), 3, scale=2e-3),
        corrective_joints=np.array(CORRECTIVE_JOINTS, np.int32),
        anchor_vertices=np.array([0, 1, 2, 2, 5, 5, 5, 8, 11, 14], np.uint32),
    )


def _ragged(
    rng: np.random.Generator, rows: int, columns: int, shapes: dict[str, tuple[tuple[int, ...], float]]
) -> SparseRows:
    """About two thirds of all entries, first and last row empty; values normal, of the size given."""
    used = rng.uniform(size=(rows, columns)) < 2 / 3
    used[0] = used[-1] = False
    used[1] = True
    entries = int(used.sum())
    values = {name: _normal(rng, entries, *shape, scale=scale) for name, (shape, scale) in shapes.items()}
    return SparseRows(_row_ptr(used), np.nonzero(used)[1].astype(np.uint16), values, columns)


def _skin(rng: np.random.Generator, rows: int) -> SparseRows:
    """One to five joints a row, weights that add up to 1."""
    used = rng.uniform(size=(rows, len(JOINTS))) < 0.5
    used[np.arange(rows), rng.integers(0, len(JOINTS), rows)] = True
    weight = np.where(used, rng.uniform(0.1, 1, used.shape), 0)
    weight /= weight.sum(axis=1, keepdims=True)
    return SparseRows(
        _row_ptr(used),
        np.nonzero(used)[1].astype(np.uint16),
        {"weight": weight[used].astype(np.float32)},
        len(JOINTS),
    )


def _row_ptr(used: Array) -> npt.NDArray[np.uint32]:
    return np.concatenate([[0], np.cumsum(used.sum(axis=1))]).astype(np.uint32)


def _normal(rng: np.random.Generator, *shape: int, scale: float = 1.0) -> npt.NDArray[np.float32]:
    return (scale * rng.standard_normal(shape)).astype(np.float32)


def rig_of(names: tuple[str, ...], parents: list[int], rest_local: np.ndarray) -> Rig:
    """A rig of one triangle with these joints."""
    joints = len(names)
    none = {"position": (3,)}
    return Rig(
        vertices=np.eye(3, dtype=np.float32),
        triangles=np.array([[0, 1, 2]], np.uint32),
        morphs=SparseRows.empty(3, 0, none),
        correctives=SparseRows.empty(3, 0, none),
        late_morphs=SparseRows.empty(3, 0, none),
        skin=SparseRows.empty(3, joints, {"weight": ()}),
        joint_names=names,
        parents=np.array(parents, np.int32),
        rest_local=rest_local.astype(np.float32),
        inverse_bind_matrix=np.tile(np.eye(4, dtype=np.float32), (joints, 1, 1)),
        joint_basis=np.zeros((0, joints, 3), np.float32),
        corrective_joints=np.zeros(0, np.int32),
        anchor_vertices=np.zeros(0, np.uint32),
    )


def avatar_of(
    expressions: tuple[str | Expression, ...] = (),
    rig: Rig | None = None,
    driving: Driving | None = None,
    eyelids: tuple[str, ...] = (),
) -> Avatar:
    """One Gaussian that nothing moves, with these names to drive."""
    named = tuple(e if isinstance(e, Expression) else Expression(e) for e in expressions)
    joints = rig.joint_count if rig else 0
    if rig:
        rig = replace(
            rig,
            morphs=SparseRows.empty(3, len(named), {"position": (3,)}),
            late_morphs=SparseRows.empty(3, len(eyelids), {"position": (3,)}),
            joint_basis=np.zeros((len(named), joints, 3), np.float32),
        )
    return Avatar(
        name="tiny",
        gaussians=Gaussians(
            *(np.zeros((1, k), np.float32) for k in (3, 3, 4)),
            np.zeros(1, np.float32),
            np.zeros((1, 1, 3), np.float32),
        ),
        groups=(Group("all", 0, 1, "none"),),
        rules=Rules(),
        expressions=named,
        eyelids=eyelids,
        blendshapes=Blendshapes(
            SparseRows.empty(1, len(named), {"mean": (3,), "quat_wxyz": (4,)}),
            SparseRows.empty(1, len(named), {"log_scale": (3,), "opacity_logit": (), "sh": (1, 3)}),
            SparseRows.empty(1, 0, {"mean": (3,)}),
            SparseRows.empty(1, len(eyelids), {"mean": (3,)}),
        ),
        skin=SparseRows.empty(1, joints, {"weight": ()}),
        rig=rig,
        sh_degree=0,
        driving=driving or Driving(mode="names"),
    )


def leaves(value: Any, path: str = "") -> dict[str, Any]:
    """Every field of an avatar by its dotted path, arrays and all."""
    if is_dataclass(value):
        return {
            k: v for f in fields(value) for k, v in leaves(getattr(value, f.name), f"{path}.{f.name}").items()
        }
    if isinstance(value, dict):
        return {k: v for key, child in value.items() for k, v in leaves(child, f"{path}.{key}").items()} or {
            path: {}
        }
    if isinstance(value, tuple):
        found = {k: v for i, child in enumerate(value) for k, v in leaves(child, f"{path}[{i}]").items()}
        return found or {path: ()}
    return {path: value}


def bits(value: Any) -> Any:
    if isinstance(value, np.ndarray):
        return (str(value.dtype), value.shape, value.tobytes())
    return (type(value), value)


def assert_same(a: Avatar, b: Avatar) -> None:
    left, right = leaves(a), leaves(b)
    assert list(left) == list(right)
    for path, value in left.items():
        assert bits(value) == bits(right[path]), path
