"""ARKit driving of a rig from another tool, by the names of expressions and of the joints of head and eyes."""

from __future__ import annotations

import re
from collections.abc import Iterator

import numpy as np

from avatar_runtime.avatar import I64, U32, Driving, Expression, Rig
from avatar_runtime.driving.arkit import canonical, first_canonical

# Joint names, letters only, without the skeleton's prefix; the first that exists is used. FLAME's head rotates at the
# neck.
JOINTS: dict[str, tuple[str, ...]] = {
    "head": ("head", "neck"),
    "left_eye": ("lefteye", "leye", "eyel", "eyeleft"),
    "right_eye": ("righteye", "reye", "eyer", "eyeright"),
}
PREFIX = re.compile(r"^(bip\d*|cc_base|mixamorig\d*|def|j_bip_[clr]|armature)[\s_:.\-]+", re.IGNORECASE)
EYE_SHAPE = 1e-3  # metres; an eyeLook shape that moves an eyeball by more rotates it without its joint


def expressions_named(names: tuple[str, ...]) -> tuple[Expression, ...]:
    """An expression for each name; its ARKit name, if any and if unique, becomes an alias."""
    spelled = [canonical(name) for name in names]
    return tuple(
        Expression(name, (arkit,) if arkit and spelled.count(arkit) == 1 and arkit not in names else ())
        for name, arkit in zip(names, spelled, strict=True)
    )


def rig_driving(rig: Rig, expressions: tuple[Expression, ...]) -> Driving:
    """Driving by names if any expression has an ARKit name; head and eyes rotate at the joints with such names.

    An eye that eyeLook shapes already move gets no joint, since it would rotate twice.
    """
    named = any(first_canonical((e.name, *e.aliases)) for e in expressions)
    found = {part: _joint(rig, part) for part in JOINTS}
    shaped = named and any(_shaped(rig, expressions, found[eye]) for eye in ("left_eye", "right_eye"))
    head = found["head"]
    return Driving(
        mode="names" if named else "none",
        head_joint=head,
        left_eye_joint=None if shaped else found["left_eye"],
        right_eye_joint=None if shaped else found["right_eye"],
    )


def _joint(rig: Rig, part: str) -> str | None:
    plain = {re.sub(r"[^a-z]", "", PREFIX.sub("", name).lower()): name for name in reversed(rig.joint_names)}
    return next((plain[name] for name in JOINTS[part] if name in plain), None)


def _shaped(rig: Rig, expressions: tuple[Expression, ...], joint: str | None) -> bool:
    """Whether an eyeLook expression moves the vertices of an eye joint."""
    if joint is None:
        return False
    column = rig.joint_names.index(joint)
    heavy = (rig.skin.column == column) & (rig.skin.values["weight"] > 0.5)
    eyeball = np.zeros(len(rig.vertices), bool)
    eyeball[_rows(rig.skin.row_ptr)[heavy]] = True
    looks = list(_looks(expressions))
    moved = np.isin(rig.morphs.column, looks) & eyeball[_rows(rig.morphs.row_ptr)]
    return bool((np.abs(rig.morphs.values["position"][moved]) > EYE_SHAPE).any())


def _looks(expressions: tuple[Expression, ...]) -> Iterator[int]:
    for index, expression in enumerate(expressions):
        if (first_canonical((expression.name, *expression.aliases)) or "").startswith("eyeLook"):
            yield index


def _rows(row_ptr: U32) -> I64:
    ptr = row_ptr.astype(np.int64)
    return np.repeat(np.arange(len(ptr) - 1), ptr[1:] - ptr[:-1])
