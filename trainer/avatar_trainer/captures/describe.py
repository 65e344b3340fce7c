"""A capture in a few lines for people."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from avatar_runtime import F32, F64
from avatar_trainer.captures.model import Capture, Frame

SEEN = 0.05  # an expression whose weight stays below was not seen
LISTED = 60  # names in a line


def describe(capture: Capture) -> list[str]:
    """Lines for `avatar-train check`: frames and split, size, cameras, joints, expressions with their ranges.

    An expression counts as seen in training if its weight exceeds SEEN in a training frame.
    """
    train, test = capture.train, capture.test
    lines = [
        f"{capture.name}: {capture.layout}",
        f"frames       {len(capture.frames)} at {capture.fps:g} a second: {len(train)} to train on, "
        + (f"{len(test)} held out ({_span(test)})" if test else "none held out: nothing will be measured"),
        f"images       {capture.width}x{capture.height}",
        _cameras(capture),
        f"rig          {len(capture.rig.vertices)} vertices, {len(capture.rig.triangles)} triangles, "
        f"{capture.rig.joint_count} joints; head pose in the {capture.head_pose_in}",
        f"joints       {_joints(capture)}",
        *_weights("expressions", capture.expression_names, train, test),
        *_weights("eyelids", capture.eyelids, train, test),
    ]
    if capture.poses == "estimated":
        lines.append("poses        estimated: training refines them")
    lines += [f"{key:<12} {text}" for key, text in capture.rights.items()]
    return [*lines, *(f"note         {note}" for note in capture.notes)]


def _span(frames: Sequence[Frame]) -> str:
    return frames[0].name if len(frames) == 1 else f"{frames[0].name} .. {frames[-1].name}"


def _cameras(capture: Capture) -> str:
    middle = (capture.rig.vertices.min(axis=0) + capture.rig.vertices.max(axis=0)) / 2
    world = np.stack([f.pose.world_from_avatar for f in capture.frames])
    view = np.stack([f.camera.camera_from_world for f in capture.frames]).astype(np.float64)
    depth = (view @ world @ np.append(middle, 1.0))[:, 2]
    fov = np.degrees([2 * np.arctan(f.camera.tan_half_fov_x) for f in capture.frames])
    moves = "still" if np.ptp(view, axis=0).max() < 1e-6 else "moving"
    return (
        f"camera       {moves}, {_range(depth, 2)} m before the rest pose's middle, "
        f"field of view {_range(fov, 1)} degrees across"
    )


def _joints(capture: Capture) -> str:
    """The joints that move and by how much at most."""
    delta = np.stack([f.pose.joint_delta for f in capture.frames])
    cosine = (np.trace(delta[..., :3, :3], axis1=-2, axis2=-1) - 1) / 2
    angle = np.degrees(np.arccos(np.clip(cosine, -1, 1))).max(axis=0)
    turning = [f"{n} {a:.0f}" for n, a in zip(capture.rig.joint_names, angle, strict=True) if a > 0.5]
    return f"{_listed(turning)} degrees at most" if turning else "all rest"


def _weights(what: str, names: Sequence[str], train: Sequence[Frame], test: Sequence[Frame]) -> Iterable[str]:
    if not names:
        yield f"{what:<12} none"
        return
    late = what == "eyelids"
    seen, held = (_stack(frames, late, len(names)) for frames in (train, test))
    moved = np.abs(seen).max(axis=0) > SEEN
    only_held = ~moved & (np.abs(held).max(axis=0, initial=0) > SEEN)
    yield f"{what:<12} {len(names)}, {int(moved.sum())} seen in training (above {SEEN:g})"
    width = max(map(len, names))
    for k in np.flatnonzero(moved | only_held).tolist():
        tail = f"  test {_signed(held[:, k])}" if len(held) else ""
        flag = "  only in frames held out" if only_held[k] else ""
        yield f"  {names[k]:<{width}}  train {_signed(seen[:, k])}{tail}{flag}"
    if never := [name for name, m in zip(names, moved, strict=True) if not m]:
        yield f"  never seen in training: {_listed(never)}"


def _stack(frames: Sequence[Frame], late: bool, columns: int) -> F32:
    rows = [f.pose.late_weights if late else f.pose.expression_weights for f in frames]
    return np.stack(rows) if rows else np.zeros((0, columns), np.float32)


def _signed(values: F32) -> str:
    return f"{values.min():+6.2f} .. {values.max():+6.2f}"


def _range(values: F64, digits: int) -> str:
    low, high = (f"{v:.{digits}f}" for v in (values.min(), values.max()))
    return low if low == high else f"{low} to {high}"


def _listed(names: Sequence[str]) -> str:
    return ", ".join(names[:LISTED]) + (f" and {len(names) - LISTED} more" if len(names) > LISTED else "")
