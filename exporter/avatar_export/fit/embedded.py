"""The mesh that Gaussians are embedded in, against the rig given for it, and the Gaussians against their mesh."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from avatar_export.fit.judge import WARNED, Sides, judged, length, mend, percent
from avatar_export.fit.known import TIMES, Search, explanation
from avatar_export.fit.surface import SEARCHED, Mesh, group_fits, size_of
from avatar_export.notes import DOUBT
from avatar_runtime.avatar import F64, Avatar

CLOSE = 1e-3  # metres; rounding to six decimals, to float32 and other body model code gives far less


@dataclass(frozen=True)
class Posed:
    """The mesh as a rig poses it."""

    when: str  # "at rest", "in frame 0 of 'walk'"
    vertices: F64  # [U, 3]
    tracked: bool = False  # the training's own pose: the mesh must have it


def rig_fit(own: F64, poses: list[Posed], sides: Sides) -> tuple[list[str], bool]:
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
    if off[near].max() > CLOSE:  # the pose by which it would fit is the one to speak of
        causes = [_cause(own, pose.vertices, sides) for pose in poses]
        known = [(cause[1], k) for k, cause in enumerate(causes) if cause is not None]
        near = min(known)[1] if known else near
        best = causes[near]
        cause = None if best is None else best[0]
    posed, distance = poses[near], off[near]
    far, rms, median = distance.max(), np.sqrt(np.mean(distance**2)), float(np.median(distance))
    notes = [f"the rig {posed.when} is the mesh to within {1e3 * far:.3f} mm (rms {1e3 * rms:.3f} mm)"]
    if far <= CLOSE:
        return notes, True
    size = min(size_of(own), size_of(posed.vertices))
    share = median / max(size, 1e-30)
    text = (
        f"{sides.own} lies {length(median)} (median; {length(far)} at most) from {sides.goal} {posed.when}, "
        f"{percent(share)} its size"
    )
    doubts = judged(text, share, cause, sides)
    if doubts:
        return [*notes, *doubts], False
    if any(p.tracked for p in poses):
        look = "look whether the identity (--shape), the poses and the rig are those of the training"
        return [*notes, f"{DOUBT}{text}, although its tracked poses are given; {look}"], False
    tried = " or ".join(p.when for p in poses)
    text = f"the mesh is not the rig {tried}, and no tracked poses (--poses) show that the rig fits it"
    return [*notes, text], False


def _cause(own: F64, goal: F64, sides: Sides) -> tuple[str, float] | None:
    """(what would make the vertices fit, the median that it would leave), if it is known."""
    sizes = size_of(own), size_of(goal)
    median = float(np.median(np.linalg.norm(goal - own, axis=1)))
    share = median / max(min(sizes), 1e-30)
    pick = np.unique(np.linspace(0, len(own) - 1, min(4 * SEARCHED, len(own))).astype(np.int64))
    a, b = own[pick], goal[pick]
    boxes = [(p.min(axis=0), p.max(axis=0)) for p in (own, goal)]
    search = Search(a, lambda _: b, lambda _: b, boxes[0], boxes[1])
    found = explanation(search, WARNED * sizes[1], pairs=share > WARNED)
    if found is not None:
        return mend(*found, sides), found[1]
    turn, left = _rigid(a, b)
    if share > WARNED and left <= min(median / TIMES, WARNED * min(sizes)):
        text = f"a turn by {turn:.0f} degrees and a shift would leave {length(left)}: the mesh stands in another pose"
        return f"{text}; pass the poses of the training (--poses)", left
    return None


def _rigid(a: F64, b: F64) -> tuple[float, float]:
    """(degrees, median distance left) of the rotation and shift that best take `a` [N, 3] to `b` (Kabsch 1976)."""
    x, y = a - a.mean(axis=0), b - b.mean(axis=0)
    u, _, vt = np.linalg.svd(y.T @ x)
    turn = (u * (1.0, 1.0, float(np.sign(np.linalg.det(u @ vt))))) @ vt
    cosine = float(np.clip((np.trace(turn) - 1) / 2, -1, 1))
    left = float(np.median(np.linalg.norm(x @ turn.T - y, axis=1)))
    return float(np.degrees(np.arccos(cosine))), left


def own_mesh_fit(avatar: Avatar, mesh: Mesh, sides: Sides) -> list[str]:
    """Doubts about Gaussians far from the mesh that their own files name. Raises AvatarError as `judge.judged`.

    Embedded Gaussians closer to the mesh than its edges are long are fine: offsets are as long as triangles are large.
    """
    if not mesh.sound:
        return []
    fits, size = group_fits(avatar, mesh)
    return [
        doubt
        for fit in fits
        if avatar.embedding is None or fit.median > mesh.edge
        for doubt in judged(
            f"{sides.own} lie {length(fit.median)} (median) from {sides.goal}, "
            f"{percent(fit.median / max(size, 1e-30))} its size",
            fit.median / max(size, 1e-30),
            None,
            sides,
        )
    ]
