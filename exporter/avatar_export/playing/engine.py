"""One pose as an engine sets it on rig.glb or rig.usdc, as plain data."""

from __future__ import annotations

from typing import Any

import numpy as np

from avatar_runtime.avatar import Avatar
from avatar_runtime.engine_pose import engine_pose, node_names, target_names
from avatar_runtime.pose import Pose


def pose_document(avatar: Avatar, posed: Pose) -> dict[str, Any]:
    """{"nodes": {name: {translation, rotation_xyzw, scale}}, "weights": {target: weight}}.

    Node transforms are whole local ones in metres; `avatar_root` is the node above the joints. Raises AvatarError for
    an avatar without a rig.
    """
    found = engine_pose(avatar, posed)
    assert avatar.rig is not None  # or engine_pose would have raised
    joints, (root, _) = avatar.rig.joint_names, node_names(avatar.rig)
    nodes = {root: (found.root_translation, found.root_rotation_xyzw, np.ones(3))}
    nodes |= dict(
        zip(joints, zip(found.translation, found.rotation_xyzw, found.scale, strict=True), strict=True)
    )
    return {
        "nodes": {
            name: {"translation": t.tolist(), "rotation_xyzw": q.tolist(), "scale": s.tolist()}
            for name, (t, q, s) in nodes.items()
        },
        "weights": dict(zip(target_names(avatar), found.weights.tolist(), strict=True)),
    }
