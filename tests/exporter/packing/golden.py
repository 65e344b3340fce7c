"""Golden packs. `python -m tests.exporter.packing.golden VERSION` writes those of a version; old ones stay for ever.

Beside each pack lies what it played when it was written: splats of one pose, posed by backend `reference`.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

from avatar_export.packing.steps import Fineness
from avatar_export.packing.write import pack
from avatar_runtime.avatar import Avatar
from avatar_runtime.bundle import load
from avatar_runtime.clips import frame_pose
from avatar_runtime.player import Player
from avatar_runtime.pose import Pose
from tests.avatars import full_avatar, surface_avatar

DATA = Path(__file__).parents[2] / "data" / "packs"
ARRAYS = ("mean", "scale", "quat_wxyz", "opacity", "sh", "sh_rotation")
MAKE = {
    "joints": (full_avatar(3), Fineness(40.0)),
    "joints_wide": (full_avatar(3), Fineness(0.02)),
    "joints_exact": (full_avatar(3), None),
    "surface": (surface_avatar(3), Fineness(40.0)),
    "surface_without_rig": (surface_avatar(3, rigged=False), Fineness(40.0)),
}


def played(avatar: Avatar) -> dict[str, np.ndarray]:
    """Splats of a frame of the first clip, or at rest."""
    pose = frame_pose(avatar, avatar.clips[0], 2) if avatar.clips else Pose()
    splats = Player(avatar, "reference").animate(pose)
    return {name: getattr(splats, name) for name in ARRAYS}


def main(version: str) -> None:
    """Write the packs and what they play."""
    folder = DATA / version
    folder.mkdir(parents=True)
    for name, (avatar, fine) in MAKE.items():
        path = folder / f"{name}.avatar"
        path.write_bytes(pack([avatar], fine).file)
        np.savez_compressed(folder / f"{name}.npz", **played(load(path)))


if __name__ == "__main__":
    main(sys.argv[1])
