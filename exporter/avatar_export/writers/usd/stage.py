"""rig.usdc: an avatar as one self-contained USD stage that UsdSkel can animate."""

from __future__ import annotations

from typing import Any

import numpy as np
from pxr import Sdf, Usd, UsdGeom, UsdSkel

from avatar_export.ops.vertex_colour import linear_from_display, vertex_colours
from avatar_export.version import GENERATOR
from avatar_export.writers.engine_mesh import EngineMesh, engine_mesh
from avatar_export.writers.usd.extent import corners, moved, posed_corners
from avatar_export.writers.usd.layer import layer_bytes
from avatar_export.writers.usd.mesh import author_mesh
from avatar_export.writers.usd.skeleton import Animation, author_animation, author_skeleton, author_world
from avatar_export.writers.usd.splats import author_splats, splat_box
from avatar_export.writers.usd.values import Box, box_of, prim_names, text, vec3f
from avatar_runtime.avatar import Avatar, Clip, Rig
from avatar_runtime.engine_pose import engine_clip, rests_bound
from avatar_runtime.io.errors import AvatarError
from avatar_schema import LATEST

ROOT = "/avatar"
WORLD = f"{ROOT}/world_from_avatar"
SKELETON = f"{WORLD}/skeleton"
MESH = f"{WORLD}/mesh"
SPLATS = f"{WORLD}/splats"
CLIPS = f"{ROOT}/clips"
RATE = 30.0  # time codes per second of an avatar without clips
ABOUT = (
    "An animatable avatar made of Gaussians, as far as USD can say it. Purpose proxy: the skinned mesh. Purpose "
    "render: the Gaussians in their binding pose. Each clip is a SkelAnimation under `clips`; the skeleton's "
    "skel:animationSource names the one that plays. A clip that moves the avatar as a whole has transform ops of its "
    "name on world_from_avatar; xformOpOrder lists those of the clip that plays."
)


def rig_usdc(avatar: Avatar) -> bytes:
    """The avatar as a USD crate file: skeleton, mesh, blend shapes, clips and splats; without joints only splats.

    Metres, Y up, without references to other files. Same avatar and same release of usd-core, same bytes. Raises
    AvatarError for a name, a joint's scale or a clip's rate that USD cannot hold.
    """
    rig = avatar.rig if avatar.rig is not None and avatar.rig.joint_count else None
    stage = Usd.Stage.CreateInMemory()
    root = _author_root(stage, avatar, UsdGeom.Xform if rig is None else UsdSkel.Root)
    splats = author_splats(stage, SPLATS, avatar)
    if rig is not None:
        _author_rig(stage, avatar, rig, root, splats)
    return layer_bytes(stage.GetRootLayer())


def _author_root(stage: Any, avatar: Avatar, kind: Any) -> Any:
    """Stage metadata, the default prim, and below it the node that moves the whole avatar."""
    UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.y)
    UsdGeom.SetStageMetersPerUnit(stage, 1.0)
    root = kind.Define(stage, ROOT).GetPrim()
    stage.SetDefaultPrim(root)
    Usd.ModelAPI(root).SetKind("component")
    root.SetDisplayName(text(avatar.name))
    root.SetDocumentation(ABOUT)
    root.SetCustomData({"avatar": {"generator": GENERATOR, "formatVersion": LATEST}})
    UsdGeom.Xform.Define(stage, WORLD)
    return root


def _author_rig(stage: Any, avatar: Avatar, rig: Rig, root: Any, splats: Any) -> None:
    skeleton = author_skeleton(stage, SKELETON, avatar, rig)
    mesh = engine_mesh(avatar)
    targets = tuple(target.name for target in mesh.targets) if len(mesh.vertices) else ()
    if len(mesh.vertices):
        colour = linear_from_display(vertex_colours(avatar, rig))
        UsdGeom.Imageable(splats).SetProxyPrim(author_mesh(stage, MESH, mesh, colour, SKELETON))
    UsdGeom.Scope.Define(stage, CLIPS)
    animations = _animations(avatar, rig)
    for animation in animations:
        author_animation(stage, f"{CLIPS}/{animation.prim}", animation, rig, targets)
    first = animations[0]
    UsdSkel.BindingAPI(skeleton).CreateAnimationSourceRel().SetTargets([Sdf.Path(f"{CLIPS}/{first.prim}")])
    author_world(stage.GetPrimAtPath(WORLD), animations)
    UsdGeom.Boundable(root).CreateExtentAttr(vec3f(_extent(avatar, rig, mesh, first)))
    stage.SetTimeCodesPerSecond(first.fps)
    stage.SetFramesPerSecond(first.fps)
    stage.SetStartTimeCode(float(first.time[0]))
    stage.SetEndTimeCode(float(first.time[-1]))


def _animations(avatar: Avatar, rig: Rig) -> tuple[Animation, ...]:
    """Every clip, or the rest pose as a clip of one frame; a time code is a frame of the first."""
    clips = avatar.clips or (_rest(avatar, rig),)
    found = []
    for clip, prim in zip(clips, prim_names(clip.name for clip in clips), strict=True):
        with np.errstate(over="ignore", invalid="ignore"):
            time = np.arange(clip.frames) * np.float64(clips[0].fps) / clip.fps
        if not np.isfinite(time).all() or (np.diff(time) <= 0).any():
            message = (
                f"fps {clip.fps:g} beside {clips[0].fps:g} of the first clip gives no time codes; resample it"
            )
            raise AvatarError(message, field=f"clips.{clip.name}")
        found.append(Animation(clip.name, prim, clip.fps, time, engine_clip(avatar, clip), _rests(rig, clip)))
    return tuple(found)


def _rests(rig: Rig, clip: Clip) -> bool:
    """Whether a clip leaves every joint at a rest that is not the binding pose; its scales may not fit half floats."""
    return not rests_bound(rig) and bool((clip.joint_delta == np.eye(4)).all())


def _rest(avatar: Avatar, rig: Rig) -> Clip:
    identity = np.eye(4, dtype=np.float32)
    return Clip(
        "rest",
        RATE,
        np.zeros((1, len(avatar.expressions)), np.float32),
        np.zeros((1, len(avatar.eyelids)), np.float32),
        np.tile(identity, (1, rig.joint_count, 1, 1)),
        identity[None],
    )


def _extent(avatar: Avatar, rig: Rig, mesh: EngineMesh, first: Animation) -> Box:
    """The box that contains mesh and splats while the first clip plays."""
    splats = np.broadcast_to(corners(splat_box(avatar.gaussians)), (len(first.time), 8, 3))
    shown = [splats, posed_corners(rig, mesh, first.pose)] if len(mesh.vertices) else [splats]
    return box_of(moved(first.pose, np.concatenate(shown, axis=1)))
