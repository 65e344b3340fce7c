"""Where a player's camera looks to show an avatar, and a still image of it."""

from __future__ import annotations

import io
from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt
from PIL import Image

from avatar_export.images import FRAMED, MARGIN, animated_rows, frame_camera, robust_box, seen
from avatar_export.ops.bounds import below, share
from avatar_runtime.avatar import Avatar
from avatar_runtime.clips import frame_pose
from avatar_runtime.player import Player
from avatar_runtime.pose import IDENTITY, Pose
from avatar_runtime.stages.activate import sigmoid
from avatar_runtime.stages.sparse import gather

UP, FRONT = (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)
HEAD_SHARE = 0.5  # a Gaussian belongs to the head if so much of its weight is on the head's joints
FEWEST = 16  # Gaussians of a part that is framed
FAINT = 0.05  # opacity; Gaussians below it set no frame
PREVIEW_SIZE = 256  # pixels
PREVIEW_YAW = np.radians(20.0)
QUALITY = 85  # of a WebP


def framing(avatar: Avatar) -> dict[str, Any]:
    """What a player's camera shows of the avatar at rest, in mesh space and metres.

    - `up`, `front`: unit vectors; the avatar looks along `front`.
    - `whole`: `target` [3], the centre of the avatar, and `size` [3], the width, height and depth that an image
      should show, a margin of 8% included. None for an avatar of fewer than 16 Gaussians.
    - `head`: the same of the head; None for an avatar whose head is unknown. The head is what follows the joint
      `driving.head_joint`, or else the first joint with "head" in its name, or else the last with "neck".

    Let tx and ty be the tangents of half the horizontal and vertical field of view. A camera shows `size` (w, h, d)
    from every yaw at the distance max(h / ty, max(w, d) / tx) / 2 + sqrt(w^2 + d^2) / 2 from `target`.
    """
    return {
        "up": list(UP),
        "front": list(FRONT),
        "whole": _part(avatar, np.arange(avatar.gaussians.count)),
        "head": _part(avatar, _head_rows(avatar)),
    }


def left_framing(framed: Mapping[str, Any]) -> dict[str, Any]:
    """`framing` in the left-handed frame: x of the targets changes its sign."""
    found = dict(framed)
    for name in ("whole", "head"):
        if found[name] is not None:
            x, y, z = found[name]["target"]
            found[name] = {**found[name], "target": [-x, y, z]}
    return found


def _part(avatar: Avatar, rows: npt.NDArray[np.int64]) -> dict[str, list[float]] | None:
    """`target` and `size` of the Gaussians `rows` at rest; None for very few. Faint ones do not count."""
    if len(rows) < FEWEST:
        return None
    solid = rows[sigmoid(avatar.gaussians.opacity_logit[rows]) >= FAINT]
    rows = solid if len(solid) >= FEWEST else rows
    rows = rows[np.unique(np.linspace(0, len(rows) - 1, min(len(rows), FRAMED)).astype(np.int64))]
    low, high = robust_box(animated_rows(avatar, rows, Pose())[0].mean)
    target, size = (low + high) / 2, (high - low) * MARGIN
    return {"target": target.astype(np.float32).tolist(), "size": size.astype(np.float32).tolist()}


def _head_rows(avatar: Avatar) -> npt.NDArray[np.int64]:
    """Ids of the Gaussians that follow the head's joints."""
    rig, joint = avatar.rig, head_joint(avatar)
    if rig is None or joint is None:
        return np.zeros(0, np.int64)
    mask = below(rig, rig.joint_names.index(joint))
    part = np.zeros(avatar.gaussians.count)
    if avatar.embedding is not None:
        of_vertex = gather(rig.skin, mask[:, None])[:, 0]
        part = np.einsum("nc,nc->n", avatar.embedding.barycentric, of_vertex[avatar.embedding.vertex_ids])
    else:
        for group in avatar.groups:
            if group.binding != "none":
                part[group.first : group.first + group.count] = share(avatar, rig, group, mask)
    return np.flatnonzero(part > HEAD_SHARE)


def head_joint(avatar: Avatar) -> str | None:
    """The joint that turns the head: that which driving turns, or else by its name; None: none is known."""
    rig = avatar.rig
    if avatar.driving.head_joint is not None or rig is None:
        return avatar.driving.head_joint
    heads, necks = ([n for n in rig.joint_names if word in n.lower()] for word in ("head", "neck"))
    return heads[0] if heads else necks[-1] if necks else None


def still_pose(avatar: Avatar) -> Pose:
    """The pose of a still image: at rest; of an avatar without expressions, the middle of its last clip."""
    if avatar.expressions or not avatar.clips:
        return Pose()
    clip = avatar.clips[-1]
    pose = frame_pose(avatar, clip, clip.frames // 2)
    return Pose(joints=pose.joints, eyelids=pose.eyelids, world_from_avatar=IDENTITY)


def preview_webp(avatar: Avatar, size: int = PREVIEW_SIZE) -> bytes:
    """`preview_image` as a WebP."""
    return webp(preview_image(avatar, size))


def preview_image(avatar: Avatar, size: int) -> npt.NDArray[np.uint8]:
    """A still image of the whole avatar, [size, size, 4] with a transparent background.

    Backend `reference` draws it, so that the same avatar gives the same pixels with and without faster backends.
    """
    pose = still_pose(avatar)
    camera = frame_camera(seen(avatar, pose), size, size, float(PREVIEW_YAW))
    return Player(avatar, "reference").frame(pose, camera, (0.0, 0.0, 0.0)).rgba8()


def webp(pixels: npt.NDArray[np.uint8]) -> bytes:
    """A lossy WebP of [H, W, 3 | 4]; the same pixels give the same bytes with the same version of the library."""
    out = io.BytesIO()
    Image.fromarray(pixels).save(out, "WEBP", quality=QUALITY, method=5)  # 6 takes ten times as long
    return out.getvalue()
