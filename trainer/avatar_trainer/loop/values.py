"""The values of a frame that are refined, as changes of what was tracked, and the frame that they make."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from avatar_runtime import F64, I64, Camera, PoseArrays, Rig, SparseRows, joint_rotation
from avatar_trainer.captures.model import Capture, Frame

# Deviations from the tracked values that are expected: of the head's turn (radians), its place
# (share of the mesh's size), a joint's turn (radians), an expression (times its own deviation over the frames).
TURN, PLACE, JOINT, WEIGHT = 0.05, 0.03, 0.06, 0.4
LEAST_WEIGHT = 0.03  # of the largest weight: deviation of a weight that is tracked at all
WHOLE = 0.97  # of the mesh: a joint that carries it turns the head, which is a value of its own


@dataclass(frozen=True)
class Values:
    """Which values of a frame are refined: D of them, in this order."""

    rig: Rig
    in_camera: bool  # where the head's pose is
    centre: F64  # [3] avatar space: about it the head turns
    joints: I64  # [J] of the rig
    carried: F64  # [J, V] share of each vertex that a joint carries
    columns: I64  # [K] expressions
    lids: I64  # [L] eyelids
    deviation: F64  # [D] 6 of the head: rotation vector and place; 3 of each joint; expressions; eyelids
    low: F64  # [D] bounds of the values, -inf where there is none
    high: F64
    morphs: F64  # [V, 3, K]
    late: F64  # [V, 3, L]

    @staticmethod
    def of(capture: Capture) -> Values:
        """What the training frames of a capture move."""
        rig, poses = capture.rig, [frame.pose for frame in capture.train]
        carried = _carried(rig)
        turned = np.stack([pose.joint_delta for pose in poses])
        moves = (np.abs(turned - turned[0]) > 1e-6).any(axis=(0, 2, 3))
        share = carried.mean(axis=1)
        chosen = np.flatnonzero(moves & (share > 0) & (share < WHOLE))
        size = float(np.linalg.norm(np.ptp(rig.vertices, axis=0)))
        parts = [[TURN] * 3 + [PLACE * size] * 3, [JOINT] * 3 * len(chosen)]
        free = 6 + 3 * len(chosen)
        bounds = [np.tile([-np.inf, np.inf], (free, 1))]
        used = []
        for name in ("expression_weights", "late_weights"):
            rows = np.stack([getattr(pose, name) for pose in poses]).astype(np.float64)
            varied = np.flatnonzero(np.ptp(rows, axis=0) > 0)
            rows = rows[:, varied]
            least = LEAST_WEIGHT * np.abs(rows).max(initial=0)
            parts.append(np.maximum(WEIGHT * rows.std(axis=0), least).tolist())
            within = (rows.min(axis=0) >= 0) & (rows.max(axis=0) <= 1) if len(varied) else np.zeros(0, bool)
            bounds.append(np.where(within[:, None], [0.0, 1.0], [-np.inf, np.inf]).reshape(-1, 2))
            used.append(varied)
        low, high = np.concatenate(bounds).T
        return Values(
            rig,
            capture.head_pose_in == "camera",
            rig.vertices.astype(np.float64).mean(axis=0),
            chosen,
            carried[chosen],
            used[0],
            used[1],
            np.concatenate([np.array(part, np.float64) for part in parts]),
            low,
            high,
            _dense(rig.morphs, used[0]),
            _dense(rig.late_morphs, used[1]),
        )

    @property
    def count(self) -> int:
        """D."""
        return len(self.deviation)

    def bounds(self, tracked: PoseArrays) -> tuple[F64, F64]:
        """([D] least, [D] largest) change of a tracked pose; no change is always inside."""
        weights = (tracked.expression_weights[self.columns], tracked.late_weights[self.lids])
        stated = np.concatenate([np.zeros(6 + 3 * len(self.joints)), *weights])
        return np.minimum(self.low - stated, 0), np.maximum(self.high - stated, 0)

    def posed(self, tracked: PoseArrays, change: F64) -> PoseArrays:
        """A tracked pose with `change` [D] added; the same object for none."""
        if not change.any():
            return tracked
        head, turns, weights, lids = self._split(change)
        delta = tracked.joint_delta.copy()
        for joint, turn in zip(self.joints, turns.reshape(-1, 3), strict=True):
            delta[joint] = delta[joint] @ joint_rotation(turn)
        expression, late = tracked.expression_weights.copy(), tracked.late_weights.copy()
        expression[self.columns] += weights.astype(np.float32)
        late[self.lids] += lids.astype(np.float32)
        world = tracked.world_from_avatar
        return PoseArrays(expression, late, delta, world if self.in_camera else world @ self._rigid(head))

    def camera(self, tracked: Frame, change: F64) -> Camera:
        """The camera of a frame with `change` [D]; the same object for none of the head."""
        if not self.in_camera or not change[:6].any():
            return tracked.camera
        world = tracked.pose.world_from_avatar
        before, camera = world @ self._rigid(change[:6]) @ np.linalg.inv(world), tracked.camera
        centre = np.linalg.inv(before) @ np.append(camera.centre.astype(np.float64), 1)
        return replace(
            camera,
            camera_from_world=(camera.camera_from_world.astype(np.float64) @ before).astype(np.float32),
            clip_from_world=(camera.clip_from_world.astype(np.float64) @ before).astype(np.float32),
            centre=centre[:3].astype(np.float32),
        )

    def moved(self, tracked: Frame, change: F64) -> Frame:
        """A tracked frame with `change` [D]."""
        return replace(tracked, pose=self.posed(tracked.pose, change), camera=self.camera(tracked, change))

    def _split(self, change: F64) -> list[F64]:
        """The parts of [D]: head, joints, expressions, eyelids."""
        return np.split(change, np.cumsum([6, 3 * len(self.joints), len(self.columns)]))

    def _rigid(self, head: F64) -> F64:
        rigid = joint_rotation(head[:3])
        rigid[:3, 3] = self.centre + head[3:] - rigid[:3, :3] @ self.centre
        return rigid


def _carried(rig: Rig) -> F64:
    """[J, V] share of each vertex that a joint and those below it carry."""
    share = np.zeros((rig.joint_count, len(rig.vertices)))
    row = np.repeat(np.arange(rig.skin.rows), _counts(rig.skin))
    share[rig.skin.column, row] = rig.skin.values["weight"]
    for joint in range(rig.joint_count - 1, 0, -1):  # a parent comes before its children
        if rig.parents[joint] >= 0:
            share[rig.parents[joint]] += share[joint]
    return share


def _dense(rows: SparseRows, columns: I64) -> F64:
    """[V, 3, K] the positions of some columns."""
    place = np.full(rows.columns, -1)
    place[columns] = np.arange(len(columns))
    row = np.repeat(np.arange(rows.rows), _counts(rows))
    kept = np.flatnonzero(place[rows.column] >= 0)
    out = np.zeros((rows.rows, 3, len(columns)))
    out[row[kept], :, place[rows.column[kept]]] = rows.values["position"][kept]
    return out


def _counts(rows: SparseRows) -> I64:
    """[R] entries of each row."""
    ends = rows.row_ptr.astype(np.int64)
    return ends[1:] - ends[:-1]
