"""The skeleton at rest, its animations, and the node that moves the whole avatar."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from pxr import Gf, UsdGeom, UsdSkel

from avatar_export.writers.usd.values import (
    Array,
    floats,
    matrices,
    prim_names,
    quatf,
    text,
    tokens,
    vec3f,
    vec3h,
)
from avatar_runtime.avatar import F64, Avatar, Rig
from avatar_runtime.engine_pose import EnginePose, bind_nodes, engine_rest, local_transforms, node_transforms


@dataclass(frozen=True)
class Animation:
    """A clip as it is stored in the stage."""

    name: str
    prim: str  # name of its SkelAnimation, and suffix of its transform ops
    fps: float
    time: F64  # [T] time codes
    pose: EnginePose  # arrays with a first axis [T]
    rests: bool = False  # whether every joint is at rest in all frames


def joint_paths(rig: Rig) -> tuple[str, ...]:
    """The UsdSkel name of each joint: the names from its root down, as identifiers, joined by slashes."""
    paths: list[str] = []
    for name, parent in zip(prim_names(rig.joint_names), rig.parents, strict=True):
        paths.append(name if parent < 0 else f"{paths[parent]}/{name}")
    return tuple(paths)


def author_skeleton(stage: Any, path: str, avatar: Avatar, rig: Rig) -> Any:
    """The Skeleton prim: bind transforms in mesh space, rest transforms relative to the parent."""
    bind, rest = bind_nodes(rig), engine_rest(avatar)
    local = local_transforms(rest.translation, rest.rotation_xyzw, rest.scale)
    skeleton = UsdSkel.Skeleton.Define(stage, path)
    skeleton.CreateJointsAttr(tokens(joint_paths(rig)))
    skeleton.CreateJointNamesAttr(tokens(rig.joint_names))
    skeleton.CreateBindTransformsAttr(matrices(bind))
    skeleton.CreateRestTransformsAttr(matrices(local))
    ends = node_transforms(rig, rest)[:, :3, 3]
    skeleton.CreateExtentAttr(vec3f(np.stack([ends.min(axis=0), ends.max(axis=0)])))
    UsdSkel.BindingAPI.Apply(skeleton.GetPrim())
    return skeleton.GetPrim()


def author_animation(stage: Any, path: str, animation: Animation, rig: Rig, targets: tuple[str, ...]) -> None:
    """One SkelAnimation: every joint's local transform and every blend shape's weight, by frame.

    Scales of a SkelAnimation are half floats, rest transforms doubles: a clip that rests has no joints, since joints
    that an animation lacks are at rest.
    """
    prim = UsdSkel.Animation.Define(stage, path)
    prim.GetPrim().SetDisplayName(text(animation.name))
    joints = slice(0 if animation.rests else rig.joint_count)
    prim.CreateJointsAttr(tokens(joint_paths(rig)[joints]))
    prim.CreateBlendShapesAttr(tokens(targets))
    pose, time = animation.pose, animation.time
    _author(prim.CreateTranslationsAttr(), time, pose.translation[:, joints], vec3f)
    _author(prim.CreateRotationsAttr(), time, pose.rotation_xyzw[:, joints], quatf)
    _author(prim.CreateScalesAttr(), time, pose.scale[:, joints], vec3h)
    _author(prim.CreateBlendShapeWeightsAttr(), time, pose.weights[:, : len(targets)], floats)


def author_world(world: Any, animations: tuple[Animation, ...]) -> None:
    """Transform ops for every animation that moves the whole avatar; xformOpOrder lists those of the first."""
    xform = UsdGeom.Xformable(world)
    for animation in animations:
        pose, time = animation.pose, animation.time
        if pose.root_translation.any() or (pose.root_rotation_xyzw != (0, 0, 0, 1)).any():
            move = xform.AddTranslateOp(UsdGeom.XformOp.PrecisionDouble, animation.prim)
            turn = xform.AddOrientOp(UsdGeom.XformOp.PrecisionDouble, animation.prim)
            _author(move.GetAttr(), time, pose.root_translation, lambda v: Gf.Vec3d(*v.tolist()))
            _author(turn.GetAttr(), time, pose.root_rotation_xyzw, _quatd)
        if animation is animations[0]:
            playing = xform.GetOrderedXformOps()
    xform.SetXformOpOrder(playing)


def _quatd(xyzw: Array) -> Any:
    x, y, z, w = xyzw.tolist()
    return Gf.Quatd(w, x, y, z)


def _author(attribute: Any, time: F64, frames: Array, make: Callable[[Array], Any]) -> None:
    """Writes time samples of frames [T, ...], or one value if nothing changes."""
    values = [make(frame) for frame in frames]
    if all(value == values[0] for value in values):
        attribute.Set(values[0])
        return
    for code, value in zip(time.tolist(), values, strict=True):
        attribute.Set(value, code)
