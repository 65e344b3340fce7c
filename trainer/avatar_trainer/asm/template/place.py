"""The places of ASM's 84 bones on a head: a table of landmarks, mirrored from the subject's left to the right.

Source: ASM (arXiv 2304.09423) section 3.3 and appendix A (names, parents, a symmetric placement by hand); the places
are this project's. Heads are in metres, +Y up, face +Z, +X towards the subject's left; landmarks are iBUG's 68,
counted from 0. All bones are parallel to the axes (R^0 = S^0 = I).
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from avatar_runtime import F64, I32, I64, AvatarError

BONES_FILE = Path(__file__).with_name("bones.json")
LANDMARKS = 68
# The landmark on the other side of each.
MIRRORED = (
    *range(16, -1, -1), *range(26, 16, -1), 27, 28, 29, 30, 35, 34, 33, 32, 31,
    45, 44, 43, 42, 47, 46, 39, 38, 37, 36, 41, 40,
    54, 53, 52, 51, 50, 49, 48, 59, 58, 57, 56, 55, 64, 63, 62, 61, 60, 67, 66, 65,
)  # fmt: skip
MIDDLE = tuple(k for k, other in enumerate(MIRRORED) if k == other)
MOST_ASYMMETRY = 0.15  # of the outer eye corners' distance, by which a landmark may miss its mirrored mean
MOST_PAIRS = 2**22  # of a point and a triangle, looked at together
SUNK = 0.05  # of the outer eye corners' distance, by which bones of the surface lie under it

Array = npt.NDArray[Any]
Shares = dict[int, float]


@dataclass(frozen=True)
class Place:
    """The place of a bone: a mean of landmarks, plus an offset."""

    landmarks: Shares  # adding up to 1
    offset: tuple[float, float, float] = (0.0, 0.0, 0.0)  # in distances of the outer eye corners
    on_surface: bool = False  # whether z is the front surface's, less SUNK


def _mean(*landmarks: int) -> Shares:
    return {k: 1 / len(landmarks) for k in landmarks}


def _front(shares: Shares, x: float = 0.0, y: float = 0.0) -> Place:
    return Place(shares, (x, y, 0.0), on_surface=True)


EYE = _mean(42, 43, 44, 45, 46, 47)
SKULL = _mean(0, 16)
# Bones of the middle and of the subject's left.
PLACES: dict[str, Place] = {
    "root": Place(SKULL, (0, -1.10, -0.45)),
    "head": Place(SKULL, (0, 0.40, -0.35)),
    "neck_front": _front(_mean(8), y=-0.45),
    "neck_side.L": Place({8: 0.35, 14: 0.65}, (0, -0.80, -0.35)),
    "nose": Place(_mean(28, 33), (0, 0, -0.20)),
    "nose_bridge_upper": _front(_mean(27)),
    "nose_bridge": _front(_mean(28)),
    "nose_mid": _front(_mean(29)),
    "nose_tip": _front(_mean(30)),
    "nose_wing.L": Place(_mean(35), (0.04, 0.07, -0.02)),
    "nose_bottom.L": Place(_mean(33, 34), (0, 0, -0.02)),
    "nose_hole.L": Place(_mean(34, 35), (0.01, 0.03, -0.03)),
    "mouth": Place(_mean(48, 54, 62, 66), (0, 0, -0.25)),
    "lip_corner.L": Place(_mean(54), (0, 0, -0.02)),
    "lip_upper_side.L": Place(_mean(52, 53), (0, 0, -SUNK)),
    "lip_upper_mid": Place(_mean(51), (0, -0.03, -SUNK)),
    "lip_lower_mid": Place(_mean(57), (0, 0.03, -SUNK)),
    "lip_lower_side.L": Place(_mean(55, 56), (0, 0, -SUNK)),
    "eye.L": Place(EYE, (0, 0, -0.15)),
    "eye_hole.L": Place(EYE, (0, 0, -0.04)),
    "eye_inner_corner.L": Place(_mean(42), (0, 0, -0.02)),
    "eye_inner_upper.L": Place(_mean(43), (0, 0, -0.02)),
    "eye_outer_upper.L": Place(_mean(44), (0, 0, -0.02)),
    "eye_outer_corner.L": Place(_mean(45), (0, 0, -0.02)),
    "eye_outer_lower.L": Place(_mean(46), (0, 0, -0.02)),
    "eye_inner_lower.L": Place(_mean(47), (0, 0, -0.02)),
    "eyelid_inner.L": _front({42: 0.25, 43: 0.35, 22: 0.20, 23: 0.20}),
    "eyelid_middle.L": _front({43: 0.3, 44: 0.3, 24: 0.4}),
    "eyelid_outer.L": _front({44: 0.25, 45: 0.35, 25: 0.20, 26: 0.20}),
    "eyebrow.L": Place(_mean(22, 23, 24, 25, 26), (0, 0, -0.20)),
    "eyebrow_inner.L": _front({22: 0.7, 23: 0.3}),
    "eyebrow_mid.L": _front(_mean(24)),
    "eyebrow_outer.L": _front(_mean(25, 26)),
    "eyebrow_center": _front(_mean(21, 22), y=-0.05),
    "eyebrow_center_up": _front(_mean(21, 22), y=0.15),
    "forehead": _front(_mean(21, 22), y=0.45),
    "forehead.L": _front(_mean(24), y=0.33),
    "temple.L": Place(_mean(26), (0.08, 0.05, -0.30)),
    "apple_inner.L": _front(_mean(35, 47), x=0.04),
    "apple_center.L": _front({46: 0.5, 35: 0.3, 13: 0.2}),
    "apple_outer.L": _front(_mean(45, 14)),
    "apple_lower.L": _front({54: 0.35, 46: 0.35, 13: 0.30}),
    "cheek.L": _front({54: 0.45, 13: 0.55}),
    "chin": _front({8: 0.65, 57: 0.35}),
    "chin_side.L": _front({9: 0.3, 10: 0.3, 55: 0.4}),
    "chin_low": Place(_mean(8), (0, 0.02, -0.15)),
    "chin_side_low.L": Place(_mean(9, 10), (0, 0.02, -0.10)),
    "jaw.L": Place(_mean(11, 12), (-0.02, 0.02, -0.05)),
    "jaw_corner.L": Place(_mean(13), (0, -0.05, -0.20)),
}
EAR_INWARDS = 0.08  # of the outer eye corners' distance, from the outermost vertex


@dataclass(frozen=True)
class Skeleton:
    """Bones and their parents, a parent before its children."""

    names: tuple[str, ...]  # [J]
    parents: I32  # [J], -1 for the root


@dataclass(frozen=True)
class Placed:
    """Bones on a head."""

    rest_position: F64  # [J, 3] psi^0, metres
    anchor_vertex: I64  # [J] v_t of Eq. 5


def skeleton() -> Skeleton:
    """The 84 bones of the paper's Table 8, whose bone 19 is the right corner of the lips."""
    rows = json.loads(BONES_FILE.read_text())
    names = tuple(str(row["name"]) for row in rows)
    parents = [-1 if row["parent"] is None else names.index(row["parent"]) for row in rows]
    return Skeleton(names, np.array(parents, np.int32))


def place(vertices: Array, triangles: Array, landmarks: Array) -> Placed:
    """The bones on a head with vertices [V, 3] metres, triangles [F, 3] and landmark vertices [68].

    The landmarks are made symmetric about the plane through those of the middle; the bones are exactly symmetric.
    Raises AvatarError for landmarks that do not form an upright face towards +Z, or that are farther from symmetric
    than MOST_ASYMMETRY.
    """
    vertices = vertices.astype(np.float64)
    middle, point = symmetric_landmarks(vertices[landmarks])
    unit = float(np.linalg.norm(point[45] - point[36]))
    across = np.array([-1.0, 1.0, 1.0]), np.array([2 * middle, 0.0, 0.0])
    found: dict[str, F64] = {"ear.L": _ear(vertices, point, middle, unit)}
    for name, spot in PLACES.items():
        at = sum((share * point[k] for k, share in spot.landmarks.items()), np.zeros(3))
        at = at + unit * np.asarray(spot.offset)
        if spot.on_surface:
            sides = np.stack([at, at * across[0] + across[1]])[:, :2]
            depth = front_depth(vertices, triangles, sides)
            seen = depth[np.isfinite(depth)]
            at[2] = (float(seen.mean()) if len(seen) else at[2]) - SUNK * unit
        found[name] = at
    names = skeleton().names
    for name in names:
        if name.endswith(".R"):
            found[name] = found[f"{name[:-2]}.L"] * across[0] + across[1]
    position = np.stack([found[name] for name in names])
    return Placed(position, anchors(vertices, triangles, position))


def symmetric_landmarks(point: F64) -> tuple[float, F64]:
    """(x of the mirror plane, landmarks [68, 3] made symmetric about it) of points [68, 3] metres.

    Raises AvatarError as `place` does.
    """
    middle = float(point[list(MIDDLE), 0].mean())
    other = point[list(MIRRORED)] * (-1.0, 1.0, 1.0) + (2 * middle, 0.0, 0.0)
    symmetric: F64 = 0.5 * (point + other)
    unit = symmetric[45, 0] - symmetric[36, 0]
    eyes, mouth, nose = symmetric[36:48].mean(axis=0), symmetric[48:68].mean(axis=0), symmetric[30]
    if unit <= 0 or eyes[1] <= mouth[1] or nose[2] <= eyes[2]:
        raise AvatarError(
            "are not iBUG's 68 of an upright face towards +Z with the subject's left at +X; turn the mesh",
            field="landmarks",
        )
    missed = np.linalg.norm(point - symmetric, axis=1)
    if missed.max() > MOST_ASYMMETRY * unit:
        worst = int(missed.argmax())
        raise AvatarError(
            f"{1000 * missed[worst]:.1f} mm from the mirrored mean, more than {1000 * MOST_ASYMMETRY * unit:.1f} mm; "
            "is it on the right vertex?",
            field=f"landmarks[{worst}]",
        )
    return middle, symmetric


def anchors(vertices: F64, triangles: Array, position: F64) -> I64:
    """v_t [J] of Eq. 5: along z onto the front of the head, then the nearest vertex.

    Outside of the head's outline, the nearest vertex in x and y.
    """
    depth = front_depth(vertices, triangles, position[:, :2])
    used = np.unique(triangles)
    found = np.empty(len(position), np.int64)
    for j, at in enumerate(position):
        seen = bool(np.isfinite(depth[j]))
        target = np.array([at[0], at[1], depth[j] if seen else 0.0])
        apart = vertices[used] - target
        found[j] = used[np.square(apart if seen else apart[:, :2]).sum(axis=1).argmin()]
    return found


def front_depth(vertices: F64, triangles: Array, xy: F64) -> F64:
    """z [N] of the foremost triangle at xy [N, 2]; -inf if there is no triangle."""
    depth = np.full(len(xy), -np.inf)
    piece = max(1, MOST_PAIRS // max(1, len(xy)))
    for first in range(0, len(triangles), piece):
        np.maximum(depth, _front_depth(vertices[triangles[first : first + piece]], xy), out=depth)
    return depth


def _front_depth(corner: F64, xy: F64) -> F64:
    """`front_depth` of the triangles with these corners [T, 3, 3]."""
    a, b, c = (corner[:, k, :2] for k in range(3))
    area = _cross(b - a, c - a)
    depth = np.full(len(xy), -np.inf)
    point, triangle = _in_boxes(xy, corner[..., :2].min(axis=1), corner[..., :2].max(axis=1))
    kept = area[triangle] != 0
    point, triangle = point[kept], triangle[kept]
    from_a = xy[point] - a[triangle]
    second = _cross(from_a, (c - a)[triangle]) / area[triangle]
    third = _cross((b - a)[triangle], from_a) / area[triangle]
    inside = (second >= -1e-9) & (third >= -1e-9) & (second + third <= 1 + 1e-9)
    share = np.stack([1 - second - third, second, third], axis=1)[inside]
    np.maximum.at(depth, point[inside], np.sum(share * corner[triangle[inside], :, 2], axis=1))
    return depth


def _in_boxes(xy: F64, low: F64, high: F64) -> tuple[Array, Array]:
    """(rows of xy [N, 2], rows of the boxes low..high [T, 2]) of each point in each box."""
    order = np.argsort(xy[:, 0])
    first = np.searchsorted(xy[order, 0], low[:, 0], "left")
    count = np.searchsorted(xy[order, 0], high[:, 0], "right") - first
    box = np.repeat(np.arange(len(low)), count)
    point = order[np.arange(len(box)) + np.repeat(first - np.cumsum(count) + count, count)]
    inside = (xy[point, 1] >= low[box, 1]) & (xy[point, 1] <= high[box, 1])
    return point[inside], box[inside]


def _ear(vertices: F64, point: F64, middle: float, unit: float) -> F64:
    """The ears' mean on the left: the outermost vertex of each side between brows and nose, behind the jaw's ends."""
    behind = point[16, 2]
    height = (vertices[:, 1] > point[33, 1]) & (vertices[:, 1] < point[24, 1])
    beside = height & (vertices[:, 2] < behind) & (vertices[:, 2] > behind - unit)
    if not beside.any():
        raise AvatarError("nothing of the mesh lies behind the jaw, where ears are", field="vertices")
    sides = []
    for sign in (1.0, -1.0):
        out = np.where(beside, sign * (vertices[:, 0] - middle), -np.inf)
        tip = vertices[out.argmax()]
        sides.append([sign * (tip[0] - middle), tip[1], tip[2]])
    ear = np.mean(sides, axis=0)
    return np.array([middle + ear[0] - EAR_INWARDS * unit, ear[1], ear[2]])


def _cross(a: F64, b: F64) -> F64:
    result: F64 = a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]
    return result
