"""`avatar-export pose`: what an engine sets on rig.glb or rig.usdc for one pose, as JSON."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer

from avatar_export.commands import arguments, playing
from avatar_export.commands.console import output
from avatar_export.readers.table import expect_bundle
from avatar_runtime.avatar import Avatar
from avatar_runtime.bundle import load
from avatar_runtime.engine_pose import engine_pose, node_names, target_names
from avatar_runtime.io.errors import AvatarError
from avatar_runtime.io.text_files import refuse_existing, write_text
from avatar_runtime.pose import Pose


def pose(
    bundle: Annotated[Path, typer.Argument(help="A bundle folder or .avatar.zip.")],
    out: Annotated[Path, typer.Option("--out", "-o", help="FILE.json to write.")],
    expression: arguments.Expressions = None,
    arkit: arguments.Arkit = None,
    joint: arguments.Turns = None,
    eyelid: arguments.Eyelids = None,
    clip: Annotated[str | None, typer.Option(help="A clip of the bundle, by name.")] = None,
    frame: Annotated[int, typer.Option(help="Which frame of the clip.", min=0)] = 0,
    force: arguments.Force = False,
) -> None:
    """Write the node transforms and target weights with which an engine shows a pose."""
    arguments.exclude(
        {"--clip": clip, "a pose (-e, -a, -j, --eyelid)": expression or arkit or joint or eyelid}
    )
    expect_bundle(bundle)
    avatar = load(bundle)
    if clip is None:
        posed = flags_pose(avatar, expression, arkit, joint, eyelid)
    else:
        poses = playing.own_clip(avatar, clip, 1).poses
        if frame >= len(poses):
            raise AvatarError(f"is {frame}, the clip has {len(poses)} frames", field="--frame")
        posed = poses[frame]
    text = json.dumps(pose_document(avatar, posed), indent=1, ensure_ascii=False) + "\n"
    refuse_existing(out, force)
    write_text(out, text)
    output.print(f"{out}: a node each joint, a weight each target of rig.glb and rig.usdc")


def flags_pose(
    avatar: Avatar,
    expression: list[str] | None,
    arkit: list[str] | None,
    joint: list[str] | None,
    eyelid: list[str] | None,
) -> Pose:
    """The pose that NAME=VALUE options describe."""
    turns = {name: arguments.numbers(value, 3) for name, value in arguments.pairs(joint)}
    weights = [
        {name: arguments.numbers(value, 1)[0] for name, value in arguments.pairs(given)}
        for given in (expression, arkit, eyelid)
    ]
    return playing.pose_from_flags(avatar, weights[0], weights[1], turns, weights[2])


def pose_document(avatar: Avatar, posed: Pose) -> dict[str, Any]:
    """{"nodes": {name: {translation, rotation_xyzw, scale}}, "weights": {target: weight}}: node transforms are
    whole local ones, metres; `avatar_root` is the node above the joints. Raises AvatarError without a rig.
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
