"""Avatar.check: a sound avatar passes, and each broken field is refused by name."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from avatar_runtime.avatar import Avatar, Driving, Expression, Gaussians, Group, Rules, SparseRows
from avatar_runtime.checks.avatar import check_avatar
from avatar_runtime.io.errors import AvatarError
from tests.avatars import full_avatar

N = 48  # Gaussians of full_avatar


def rigless(binding: str) -> Avatar:
    """An avatar of expressions only, in one group."""
    avatar = full_avatar()
    return replace(
        avatar,
        rig=None,
        rules=Rules(),
        driving=Driving(),
        clips=(),
        groups=(Group("all", 0, N, binding, {"jaw": 1.0} if binding == "joint_mix" else {}),),
        skin=SparseRows.empty(N, 0, {"weight": ()}),
        blendshapes=replace(avatar.blendshapes, correctives=SparseRows.empty(N, 0, {"mean": (3,)})),
    )


def changed(model: Any, path: str, value: Any) -> Any:
    """`model` with the field at the dotted path replaced; a function is applied to the old value."""
    name, _, rest = path.partition(".")
    old = model[name] if isinstance(model, dict) else getattr(model, name)
    new = changed(old, rest, value) if rest else value(old) if callable(value) else value
    return {**model, name: new} if isinstance(model, dict) else replace(model, **{name: new})


def at(index: Any, value: Any) -> Any:
    """A change: a copy of the array with one entry set."""

    def change(array: np.ndarray[Any, Any]) -> np.ndarray[Any, Any]:
        array = array.copy()
        array[index] = value
        return array

    return change


def f64(array: np.ndarray[Any, Any]) -> np.ndarray[Any, Any]:
    return array.astype(np.float64)


def i64(array: np.ndarray[Any, Any]) -> np.ndarray[Any, Any]:
    return array.astype(np.int64)


def shorter(array: np.ndarray[Any, Any]) -> np.ndarray[Any, Any]:
    return array[:-1]


def group(index: int, **fields: Any) -> Any:
    """A change of one group."""

    def change(groups: tuple[Group, ...]) -> tuple[Group, ...]:
        return (*groups[:index], replace(groups[index], **fields), *groups[index + 1 :])

    return change


MATRIX = Driving("matrix", ("jawOpen",), ("expression/jawOpen",), np.ones((1, 1), np.float32))
SPARSE = (
    *((f"blendshapes.{name}", name) for name in ("geometry", "appearance", "correctives", "late_morphs")),
    *((path, path) for path in ("skin", "rig.morphs", "rig.correctives", "rig.late_morphs", "rig.skin")),
)
FLOATS = (
    *(f"gaussians.{name}" for name in ("mean", "log_scale", "quat_wxyz", "opacity_logit", "sh")),
    *("rig.vertices", "rig.rest_local", "rig.inverse_bind_matrix", "rig.joint_basis"),
)
JOINT_FIELDS = ("head_joint", "left_eye_joint", "right_eye_joint")
NO_GAUSSIANS = Gaussians(*(np.zeros((0, *shape), np.float32) for shape in ((3,), (3,), (4,), (), (16, 3))))


def each(change: Any) -> Any:
    """A change of every array of a mapping."""
    return lambda values: {name: change(array) for name, array in values.items()}


# path, value or change, the field that the message names, words of the message
BROKEN: list[tuple[str, Any, str, str]] = [
    *((path, f64, path, "float32") for path in FLOATS),
    *((path, at(0, np.nan), path, "nan at row 0") for path in FLOATS),
    *((path, at(-1, -np.inf), path, "-inf") for path in FLOATS),
    *((path, shorter, path, "expected") for path in FLOATS if path not in ("gaussians.mean", "rig.vertices")),
    ("gaussians.mean", at((3, slice(0, 2)), [np.inf, -np.inf]), "gaussians.mean", "row 3"),
    ("gaussians.mean", shorter, "gaussians.log_scale", "expected float32[47, 3]"),
    ("gaussians.sh", lambda a: a[:, :3], "gaussians.sh", "1 | 4 | 9 | 16"),
    ("gaussians.sh", lambda a: a[..., 0], "gaussians.sh", "1 | 4 | 9 | 16"),
    ("gaussians", NO_GAUSSIANS, "gaussians", "at least one"),
    ("sh_degree", 4, "sh_degree", "0..3 is stored"),
    ("sh_degree", -1, "sh_degree", "0..3 is stored"),
    ("groups", group(1, first=23), "groups.upper_teeth", "row 24 comes next"),
    ("groups", group(1, first=25), "groups.upper_teeth", "row 24 comes next"),
    ("groups", group(0, count=0), "groups.face", "row 0 comes next"),
    ("groups", group(3, count=9), "groups", "cover 49 of 48"),
    ("groups", lambda groups: groups[:-1], "groups", "cover 40 of 48"),
    ("groups", group(0, binding="glue"), "groups.face", "'glue' is not one of skin"),
    ("groups", group(0, name="hair"), "groups", "duplicate"),
    ("groups", group(0, name=""), "groups", "is empty"),
    ("groups", group(2, joint_mix={}), "groups.lower_teeth", "joint_mix"),
    ("groups", group(0, joint_mix={"jaw": 1.0}), "groups.face", "joint_mix"),
    ("groups", group(2, joint_mix={"tail": 1.0}), "groups.lower_teeth", "'tail'"),
    ("expressions", (Expression("a"), Expression("a")), "expressions", "duplicate"),
    ("expressions", (Expression(""),), "expressions", "is empty"),
    ("expressions", (Expression("a"),), "geometry", "4 columns, expected 1"),
    ("eyelids", ("a", "b", "c"), "late_morphs", "2 columns, expected 3"),
    ("eyelids", ("",), "eyelids", "is empty"),
    *((f"{path}.columns", 1000, field, "1000 columns") for path, field in SPARSE),
    *((f"{path}.column", at(0, 999), f"{field}.column", "= 999") for path, field in SPARSE),
    *((f"{path}.column", i64, f"{field}.column", "u16") for path, field in SPARSE),
    *((f"{path}.row_ptr", at(0, 1), f"{field}.row_ptr", "rise from 0") for path, field in SPARSE),
    *((f"{path}.row_ptr", at(1, 2**32 - 1), f"{field}.row_ptr", "rise from 0") for path, field in SPARSE),
    *((f"{path}.row_ptr", at(-1, 1), f"{field}.row_ptr", "rise from 0") for path, field in SPARSE),
    *((f"{path}.row_ptr", shorter, f"{field}.row_ptr", "expected u32") for path, field in SPARSE),
    *((f"{path}.row_ptr", i64, f"{field}.row_ptr", "expected u32") for path, field in SPARSE),
    *((f"{path}.values", {}, field, "attributes []") for path, field in SPARSE),
    *((f"{path}.values", each(shorter), f"{field}.", "expected") for path, field in SPARSE),
    *((f"{path}.values", each(at(0, np.nan)), f"{field}.", "nan") for path, field in SPARSE),
    ("blendshapes.geometry.column", at(1, 0), "geometry.column[1]", "strictly increase"),
    ("blendshapes.geometry.column", at(slice(0, 2), [1, 0]), "geometry.column[1]", "strictly increase"),
    ("rig.triangles", at((0, 0), 20), "rig.triangles", "holds 20"),
    ("rig.triangles", lambda a: a.astype(np.int32), "rig.triangles", "u32"),
    ("rig.triangles", lambda a: a[:, :2], "rig.triangles", "u32[F, 3]"),
    ("rig.anchor_vertices", at(0, 20), "rig.anchor_vertices", "holds 20"),
    ("rig.anchor_vertices", lambda a: a[:2], "groups.upper_teeth", "three anchor vertices"),
    ("rig.anchor_vertices", lambda a: -a.astype(np.int32), "rig.anchor_vertices", "u32"),
    ("rig.joint_names", ("neck", "neck", "jaw", "leftEye", "rightEye"), "rig.joint_names", "duplicate"),
    ("rig.parents", at(0, 0), "rig.parents", "before its children"),
    ("rig.parents", at(1, 2), "rig.parents", "before its children"),
    ("rig.parents", at(1, -2), "rig.parents", "before its children"),
    ("rig.parents", i64, "rig.parents", "i32[5]"),
    ("rig.corrective_joints", at(0, 5), "rig.corrective_joints", "0..4"),
    ("rig.corrective_joints", at(0, -1), "rig.corrective_joints", "0..4"),
    ("rig.corrective_joints", i64, "rig.corrective_joints", "i32[C]"),
    ("rules", Rules(rotation="spin"), "rules.rotation", "'spin' is not one of"),
    ("rules", Rules(sh_direction="up"), "rules.sh_direction", "'up' is not one of"),
    ("rules", Rules(anchor="most"), "rules.anchor", "'most' is not one of"),
    ("rules", Rules(rotation="head_bone"), "rules.rotation_joint", "needs a rotation_joint"),
    ("rules", Rules(rotation="head_bone", rotation_joint="tail"), "rules.rotation_joint", "'tail'"),
    ("head_pose_in", "pocket", "head_pose_in", "'pocket' is not one of"),
    ("driving", Driving("magic"), "driving.mode", "'magic' is not one of"),
    ("driving", Driving("matrix"), "driving.matrix", "goes with mode"),
    ("driving", replace(MATRIX, mode="names"), "driving.matrix", "goes with mode"),
    ("driving", replace(MATRIX, inputs=()), "driving.matrix", "expected float32[1, 0]"),
    ("driving", replace(MATRIX, matrix=np.full((1, 1), np.nan, np.float32)), "driving.matrix", "nan"),
    ("driving", replace(MATRIX, outputs=("expression/zzz",)), "driving.outputs", "'expression/zzz'"),
    ("driving", replace(MATRIX, outputs=("joint/jaw/w",)), "driving.outputs", "'joint/jaw/w'"),
    *(("driving", Driving(**{name: "tail"}), f"driving.{name}", "'tail'") for name in JOINT_FIELDS),
]


@pytest.mark.parametrize(("path", "value", "field", "words"), BROKEN)
def test_a_broken_field_is_refused_by_name(path: str, value: Any, field: str, words: str) -> None:
    broken = changed(full_avatar(), path, value)
    with pytest.raises(AvatarError) as error:
        check_avatar(broken)
    assert (error.value.field or "").startswith(field)
    assert words in str(error.value)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("binding", ["skin", "anchor", "joint_mix"])
def test_a_binding_without_a_rig_is_refused(binding: str) -> None:
    with pytest.raises(AvatarError, match="needs a rig"):
        check_avatar(rigless(binding))
