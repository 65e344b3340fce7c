"""The mesh that Gaussians are embedded in, against the rig given for it, and the Gaussians against their mesh."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from avatar_export.fit.judge import WARNED, Sides, judged, mend
from avatar_export.fit.known import TIMES, Search, explanation
from avatar_export.fit.surface import SEARCHED, Mesh, group_fits, size_of
from avatar_export.notes.note import Note, doubt, fact
from avatar_runtime.avatar import F64, Avatar

CLOSE = 1e-3  # metres; rounding to six decimals, to float32 and other body model code gives far less


@dataclass(frozen=True)
class Posed:
    """The mesh as a rig poses it."""

    when: str  # "at rest", "in frame 0 of 'walk'"
    vertices: F64  # [U, 3]
    tracked: bool = False  # the training's own pose: the mesh must have it


def rig_fit(own: F64, poses: list[Posed], sides: Sides) -> tuple[list[Note], bool]:
    """(notes, whether they are one mesh) on the distance of the mesh's vertices [U, 3] from those of the rig.

    The nearest of `poses` counts; the first is that at rest, any other came with the rig. Raises AvatarError if they
    lie far apart and the misfit is not accepted.
    """
    poses = [posed for posed in poses if np.isfinite(posed.vertices).all()]
    if not poses or not np.isfinite(own).all():
        return [], False  # refused elsewhere
    off = [np.linalg.norm(posed.vertices - own, axis=1) for posed in poses]
    near = min(range(len(poses)), key=lambda k: float(off[k].max()))
    cause = None
    if off[near].max() > CLOSE:  # the pose by which it would fit is the one to name
        causes = [_cause(own, pose.vertices, sides) for pose in poses]
        known = {k: one.values["left"] for k, one in enumerate(causes) if one is not None}
        near = min(known, key=known.__getitem__, default=near)
        cause = causes[near]
    posed, distance = poses[near], off[near]
    far, rms, median = distance.max(), np.sqrt(np.mean(distance**2)), float(np.median(distance))
    notes = [fact("rig_fits", when=posed.when, far=1e3 * far, rms=1e3 * rms)]
    if far <= CLOSE:
        return notes, True
    size = min(size_of(own), size_of(posed.vertices))
    share = median / max(size, 1e-30)
    apart = {"median": median, "far": far, "when": posed.when}
    doubts = judged("rig_off", share, cause, sides, tracked=False, **apart)
    if doubts:
        return [*notes, *doubts], False
    if any(p.tracked for p in poses):
        return [
            *notes,
            doubt("rig_off", own=sides.own, goal=sides.goal, share=share, tracked=True, **apart),
        ], False
    return [*notes, fact("rig_unproved", tried=" or ".join(p.when for p in poses))], False


def _cause(own: F64, goal: F64, sides: Sides) -> Note | None:
    """What would make the vertices fit, if it is known; its value `left` is the median that it would leave."""
    sizes = size_of(own), size_of(goal)
    median = float(np.median(np.linalg.norm(goal - own, axis=1)))
    share = median / max(min(sizes), 1e-30)
    pick = np.unique(np.linspace(0, len(own) - 1, min(4 * SEARCHED, len(own))).astype(np.int64))
    a, b = own[pick], goal[pick]
    boxes = [(p.min(axis=0), p.max(axis=0)) for p in (own, goal)]
    search = Search(a, lambda _: b, lambda _: b, boxes[0], boxes[1])
    found = explanation(search, WARNED * sizes[1], pairs=share > WARNED)
    if found is not None:
        return mend(*found, sides)
    turn, left = _rigid(a, b)
    if share > WARNED and left <= min(median / TIMES, WARNED * min(sizes)):
        return fact("other_pose", degrees=turn, left=left)
    return None


def _rigid(a: F64, b: F64) -> tuple[float, float]:
    """(degrees, median distance left) of the rotation and shift that best take `a` [N, 3] to `b` (Kabsch 1976)."""
    x, y = a - a.mean(axis=0), b - b.mean(axis=0)
    u, _, vt = np.linalg.svd(y.T @ x)
    turn = (u * (1.0, 1.0, float(np.sign(np.linalg.det(u @ vt))))) @ vt
    cosine = float(np.clip((np.trace(turn) - 1) / 2, -1, 1))
    left = float(np.median(np.linalg.norm(x @ turn.T - y, axis=1)))
    return float(np.degrees(np.arccos(cosine))), left


def own_mesh_fit(avatar: Avatar, mesh: Mesh, sides: Sides) -> list[Note]:
    """Doubts about Gaussians far from the mesh that their own files name. Raises AvatarError as `judge.judged`.

    Embedded Gaussians closer to the mesh than its edges are long are fine: offsets are as long as triangles are large.
    """
    if not mesh.sound:
        return []
    fits, size = group_fits(avatar, mesh)
    return [
        note
        for fit in fits
        if avatar.embedding is None or fit.median > mesh.edge
        for note in judged("gaussians_off", fit.median / max(size, 1e-30), None, sides, median=fit.median)
    ]
