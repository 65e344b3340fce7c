"""ARKit channels to a pose, and the skeleton of that pose: float64, one number at a time, as SPEC.md says it."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from avatar_runtime.avatar import Avatar, Group, Rig
from tests.oracles.lbs import rodrigues

Array = npt.NDArray[Any]
X, Y, Z = np.eye(3)
LOOK = 0.609  # radians of an eyeLook weight of 1


def key(name: str) -> str:
    """Equal for two spellings of one name."""
    last = re.split(r"[.:|/]", name.strip())[-1].lower()
    plain = re.sub(r"[-_ ]", "", re.sub(r"^(ak_[0-9]+_|arkit_|bs_)", "", last))
    short = re.sub("right$", "r", re.sub("left$", "l", plain))
    return short[:-1] if short[:-1] in ("browinnerup", "cheekpuff") else short


def driven(
    avatar: Avatar, channels: Mapping[str, float], *, within_range: bool, left_handed: bool
) -> dict[str, Array]:
    """The outputs of `driving` for the 61 channels by name."""
    weights = {name: value for name, value in channels.items() if not re.search("(Yaw|Pitch|Roll)$", name)}
    values = _values(avatar, weights)
    expressions = [values.get(f"expression/{e.name}", 0.0) for e in avatar.expressions]
    late = [values.get(f"eyelid/{name}", 0.0) for name in avatar.eyelids]
    if within_range:
        for k, e in enumerate(avatar.expressions):
            if f"expression/{e.name}" in values:
                expressions[k] = e.range[0] if expressions[k] < e.range[0] else expressions[k]
                expressions[k] = e.range[1] if expressions[k] > e.range[1] else expressions[k]
        late = [0.0 if w < 0 else 1.0 if w > 1 else w for w in late]
    turns: dict[str, Array] = {}
    for output, value in values.items():
        if output.startswith("joint/"):
            joint, axis = output[len("joint/") : -2], "xyz".index(output[-1])
            turns.setdefault(joint, np.zeros(3))[axis] = value
    turns = {joint: rodrigues(vector) for joint, vector in turns.items()}
    _eyes(avatar, turns, channels, left_handed)
    yaw, pitch, roll = (channels[f"head{angle}"] for angle in ("Yaw", "Pitch", "Roll"))
    signs = (-1, -1, -1) if left_handed else (1, -1, 1)
    head, whole = euler(yaw, pitch, roll, signs), np.eye(4)
    driving = avatar.driving
    if driving.head_joint is not None:
        turns[driving.head_joint] = head @ turns.get(driving.head_joint, np.eye(3))
    else:
        pivot = np.array(driving.head_pivot)
        whole[:3, :3], whole[:3, 3] = head, pivot - head @ pivot
    return {
        "expression_weights": np.array(expressions),
        "late_weights": np.array(late),
        "joint_delta": _deltas(avatar, turns),
        "world_from_avatar": whole,
    }


def euler(yaw: float, pitch: float, roll: float, signs: tuple[int, int, int]) -> Array:
    """Rotation by roll about Z first, then pitch about X, then yaw about Y, each with its sign."""
    about_y, about_x, about_z = signs[0] * yaw * Y, signs[1] * pitch * X, signs[2] * roll * Z
    return rodrigues(about_y) @ rodrigues(about_x) @ rodrigues(about_z)


def _values(avatar: Avatar, weights: Mapping[str, float]) -> dict[str, float]:
    driving, values = avatar.driving, {}
    if driving.mode == "matrix":
        assert driving.matrix is not None
        for row, output in enumerate(driving.outputs):
            terms = zip(driving.matrix[row], driving.inputs, strict=True)
            values[output] = math.fsum(float(factor) * weights[name] for factor, name in terms)
        return values
    known = {key(name): name for name in weights}
    targets = [(f"expression/{e.name}", (e.name, *e.aliases)) for e in avatar.expressions]
    targets += [(f"eyelid/{name}", (name,)) for name in avatar.eyelids]
    for output, names in targets:
        found = [known[key(name)] for name in names if key(name) in known]
        if found:
            values[output] = weights[found[0]]
    return values


def _eyes(avatar: Avatar, turns: dict[str, Array], channels: Mapping[str, float], left_handed: bool) -> None:
    signs = (1, 1, 1) if left_handed else (-1, 1, -1)
    # The recorder's names are those of the other eye.
    for side, joint, recorded in (
        ("Left", avatar.driving.left_eye_joint, "rightEye"),
        ("Right", avatar.driving.right_eye_joint, "leftEye"),
    ):
        if joint is None:
            continue
        yaw, pitch, roll = (channels[f"{recorded}{angle}"] for angle in ("Yaw", "Pitch", "Roll"))
        if yaw or pitch or roll:
            turns[joint] = euler(yaw, pitch, roll, signs)
        elif joint not in turns:
            inward, outward, up, down = (
                channels[f"eyeLook{way}{side}"] for way in ("In", "Out", "Up", "Down")
            )
            right = inward - outward if side == "Left" else outward - inward
            turns[joint] = euler(LOOK * right, LOOK * (down - up), 0.0, signs)


def _rest(rig: Rig, joint: int) -> Array:
    """mesh_from_joint at rest."""
    local: Array = rig.rest_local[joint].astype(np.float64)
    parent = int(rig.parents[joint])
    return local if parent < 0 else _rest(rig, parent) @ local


def _deltas(avatar: Avatar, turns: Mapping[str, Array]) -> Array:
    rig = avatar.rig
    if rig is None:
        return np.zeros((0, 4, 4))
    deltas = np.stack([np.eye(4)] * rig.joint_count)
    for joint, turn in turns.items():
        row = rig.joint_names.index(joint)
        rest = _rest(rig, row)[:3, :3]
        deltas[row, :3, :3] = np.linalg.inv(rest) @ turn @ rest
    return deltas


def skeleton(avatar: Avatar, rig: Rig, x: Mapping[str, Array]) -> dict[str, Array]:
    """The outputs of stage `joints` for its inputs."""
    weights, delta = x["expression_weights"].astype(np.float64), x["joint_delta"]
    moved = [_moved(rig, weights, joint) for joint in range(rig.joint_count)]
    posed: list[Array] = []
    skin: list[Array] = []
    for joint, parent in enumerate(rig.parents):
        rest = moved[joint] @ _rest(rig, joint)
        if parent >= 0:
            rest = posed[parent] @ np.linalg.inv(moved[parent] @ _rest(rig, int(parent))) @ rest
        posed.append(rest @ delta[joint])
        inverse_bind = rig.inverse_bind_matrix[joint].astype(np.float64)
        skin.append(posed[joint] @ inverse_bind @ np.linalg.inv(moved[joint]))
    features = [(delta[joint, :3, :3] - np.eye(3)).reshape(9) for joint in rig.corrective_joints]
    groups = [_group(avatar, rig, group, skin, x.get("anchor_vertices")) for group in avatar.groups]
    return {
        "skin_matrix": np.stack(skin),
        "pose_feature": np.concatenate([np.zeros(0), *features]),
        "group_matrix": np.stack([matrix[:3] for matrix, _ in groups]),
        "group_rotation": np.stack([rotation for _, rotation in groups]),
    }


def _moved(rig: Rig, weights: Array, joint: int) -> Array:
    result = np.eye(4)
    for k, weight in enumerate(weights):
        result[:3, 3] += weight * rig.joint_basis[k, joint].astype(np.float64)
    return result


def _group(
    avatar: Avatar, rig: Rig, group: Group, skin: list[Array], anchors: Array | None
) -> tuple[Array, Array]:
    if group.binding == "anchor":
        assert anchors is not None
        matrix = _fitted(avatar, rig, anchors.astype(np.float64))
        return matrix, matrix[:3, :3]
    if group.binding == "joint_mix":
        rest = 1 - math.fsum(group.joint_mix.values())
        parts = [factor * skin[rig.joint_names.index(name)] for name, factor in group.joint_mix.items()]
        mixed = sum(parts, rest * np.eye(4))
        return mixed, _newton(mixed[:3, :3])
    if group.binding == "skin" and avatar.rules.rotation == "head_bone":
        bone = skin[rig.joint_names.index(str(avatar.rules.rotation_joint))]
        return np.eye(4), _newton(bone[:3, :3])
    return np.eye(4), np.eye(3)


def _newton(m: Array) -> Array:
    for _ in range(3):
        m = (m + np.linalg.inv(m).T) / 2
    return m


def _fitted(avatar: Avatar, rig: Rig, posed: Array) -> Array:
    """The rigid fit by the quaternion of Horn (1987): the largest eigenvector of a symmetric 4x4 matrix."""
    rows = list(range(len(posed)))
    if avatar.rules.anchor == "unique":
        rows = [rows[list(rig.anchor_vertices).index(v)] for v in sorted(set(rig.anchor_vertices))]
    a, b = rig.vertices[rig.anchor_vertices[rows]].astype(np.float64), posed[rows]
    s = (a - a.mean(axis=0)).T @ (b - b.mean(axis=0))
    cross = np.array([s[1, 2] - s[2, 1], s[2, 0] - s[0, 2], s[0, 1] - s[1, 0]])
    n = np.zeros((4, 4))
    n[0, 0], n[0, 1:], n[1:, 0] = np.trace(s), cross, cross
    n[1:, 1:] = s + s.T - np.trace(s) * np.eye(3)
    w, *v = np.linalg.eigh(n)[1][:, -1]
    axis = np.array(v)
    sine = math.sqrt(float(axis @ axis))
    turn = rodrigues(2 * math.atan2(sine, float(w)) * axis / (sine or 1))
    result = np.eye(4)
    result[:3, :3], result[:3, 3] = turn, b.mean(axis=0) - turn @ a.mean(axis=0)
    return result
