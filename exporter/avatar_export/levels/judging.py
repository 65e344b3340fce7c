"""The poses in which a level is judged, and which Gaussians make up the centre of the face, where people look."""

from __future__ import annotations

import numpy as np

from avatar_export.images import FRAMED, SHEET_EXPRESSIONS, animated_rows, arkit_pose
from avatar_export.measure.poses import poses
from avatar_runtime.avatar import I64, Avatar
from avatar_runtime.clips import frame_pose
from avatar_runtime.driving.arkit import canonical
from avatar_runtime.pose import IDENTITY, Pose

LEAST_POSES = 48
FURTHER = 16  # poses of clips and mixtures at least, besides the faces and the ends of ranges
MOST_TURNED = 12  # frames in which a joint is turned farthest
# Of the farthest move in an expression: Gaussians that move more belong to the face's centre.
MOVED_MOST = 0.5
STILL = 1e-4  # of the avatar's size: an expression that moves nothing farther does not count
TEETH = ("jawOpen", "mouthSmile", "mouthUpperUp", "mouthLowerDown")
SIDES = ("", "Left", "Right")


def judged_poses(avatar: Avatar) -> list[Pose]:
    """At least 48 poses, the hardest first, for an avatar that moves; none moves in the world.

    Closed lids, wide mouth, bared teeth and the other faces of a contact sheet, where ARKit drives the avatar; eyelids
    shut; each expression at each end of its range; the frames of the clips in which a joint is turned farthest; frames
    of clips, mixtures and joints (`measure.poses`).
    """
    found = [*_faces(avatar), *_ends(avatar), *_turned(avatar)]
    further = poses(avatar, max(FURTHER, LEAST_POSES - len(found)))
    return [*found, *(named.pose for named in further)]


def centre_rows(avatar: Avatar) -> I64 | None:
    """Ids of some Gaussians that single expressions move most, which make up the centre of the face; None without."""
    ends = _ends(avatar)
    count = avatar.gaussians.count
    rows = np.unique(np.linspace(0, count - 1, min(count, FRAMED)).astype(np.int64))
    rest, *posed = animated_rows(avatar, rows, Pose(), *ends)
    found, size = np.zeros(len(rows), bool), float(np.ptp(rest.mean, axis=0).max())
    for splats in posed:
        moved = np.linalg.norm(splats.mean - rest.mean, axis=1)
        if float(moved.max()) > STILL * size:
            found |= moved > MOVED_MOST * moved.max()
    return rows[found] if found.any() else None


def _faces(avatar: Avatar) -> list[Pose]:
    if avatar.driving.mode == "none":
        return []
    reached = {canonical(name) for name in (*avatar.driving.inputs, *avatar.expression_names)}
    teeth = {name + side: 1.0 for name in TEETH for side in SIDES}
    asked = (
        {name: w for name, w in face.items() if name in reached}
        for face in (teeth, *SHEET_EXPRESSIONS.values())
    )
    return [arkit_pose(avatar, face) for face in asked if face]


def _ends(avatar: Avatar) -> list[Pose]:
    """The eyelids shut, and each expression at each end of its range that is not 0."""
    lids = [Pose(eyelids=dict.fromkeys(avatar.eyelids, 1.0))] if avatar.eyelids else []
    return lids + [Pose({e.name: end}) for e in avatar.expressions for end in e.range if end]


def _turned(avatar: Avatar) -> list[Pose]:
    """Frames of the clips in which a joint is turned farthest from its rest."""
    if not avatar.clips or avatar.rig is None or not avatar.rig.joint_count:
        return []
    frames = [(clip, frame) for clip in avatar.clips for frame in range(clip.frames)]
    turns = np.concatenate([clip.joint_delta[..., :3, :3] for clip in avatar.clips])
    cosine = np.trace(turns, axis1=2, axis2=3)  # [frames, J] 1 + 2 cos
    chosen = np.unique(np.argmin(cosine, axis=0))
    chosen = chosen[np.unique(np.linspace(0, len(chosen) - 1, min(len(chosen), MOST_TURNED)).astype(int))]
    found = [frame_pose(avatar, *frames[index]) for index in chosen]
    return [Pose(p.expressions, p.joints, p.eyelids, IDENTITY) for p in found]
