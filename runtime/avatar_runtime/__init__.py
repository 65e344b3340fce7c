"""Plays avatar bundles: load one, pose it, see it through a camera. NumPy only; faster backends are extras.

The names in `__all__` are the public interface. What a sub-package lists in its own `__all__` is for packages that
build on this one, as the exporter and the trainer do, and may change from one version to the next.
"""

from __future__ import annotations

from avatar_runtime import rotation, rules, topology
from avatar_runtime.avatar import (
    F32,
    F64,
    I32,
    I64,
    U32,
    Avatar,
    Blendshapes,
    Clip,
    Enhancer,
    Expression,
    Gaussians,
    Group,
    RasterSettings,
    Rig,
    Rules,
    SparseRows,
)
from avatar_runtime.backends import BACKENDS, default_backend
from avatar_runtime.bundle import load
from avatar_runtime.camera import Camera
from avatar_runtime.checks.avatar import check_avatar
from avatar_runtime.clips import clip_pose
from avatar_runtime.driving.driver import Driver
from avatar_runtime.driving.frame import DrivingFrame
from avatar_runtime.driving.idle import idle
from avatar_runtime.engine_pose import EnginePose, engine_clip, engine_pose, target_names
from avatar_runtime.io.errors import AvatarError
from avatar_runtime.light import DirectLight, Light
from avatar_runtime.player import Frame, Player
from avatar_runtime.pose import Pose, PoseArrays, joint_rotation, resolve
from avatar_runtime.posed import Poser, posed_mesh
from avatar_runtime.stages.activate import Splats
from avatar_runtime.stages.raster import Image
from avatar_runtime.version import __version__

# fmt: off
__all__ = [
    "BACKENDS", "F32", "F64", "I32", "I64", "U32", "Avatar", "AvatarError", "Blendshapes", "Camera", "Clip",
    "DirectLight", "Driver", "DrivingFrame", "EnginePose", "Enhancer", "Expression", "Frame", "Gaussians",
    "Group", "Image", "Light", "Player", "Pose", "PoseArrays", "Poser", "RasterSettings", "Rig", "Rules",
    "SparseRows", "Splats", "__version__", "check_avatar", "clip_pose", "default_backend", "engine_clip",
    "engine_pose", "idle", "joint_rotation", "load", "posed_mesh", "resolve", "rotation", "rules",
    "target_names", "topology",
]
# fmt: on
