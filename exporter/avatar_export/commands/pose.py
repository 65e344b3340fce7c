"""`avatar-export pose`: what an engine sets on rig.glb or rig.usdc for one pose, as JSON."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer

from avatar_export.commands import arguments
from avatar_export.commands.console import output, tell
from avatar_export.commands.declared import command
from avatar_export.playing.engine import pose_document
from avatar_export.playing.sequences import own_clip
from avatar_export.readers.table import expect_bundle
from avatar_runtime.bundle import load
from avatar_runtime.io.errors import AvatarError
from avatar_runtime.io.text_files import refuse_existing, write_text


@command
def pose(
    bundle: arguments.Bundle,
    out: Annotated[Path, typer.Option("--out", "-o", help="FILE.json to write.")],
    posed: arguments.Posed,
    clip: Annotated[str | None, typer.Option(help="Name of a clip of the bundle.")] = None,
    frame: Annotated[int, typer.Option(help="Frame of the clip, from 0.", min=0)] = 0,
    force: arguments.Force = False,
) -> None:
    """Write the node transforms and morph target weights that show a pose in an engine, as JSON."""
    arguments.exclude({"--clip": clip, "a pose (-e, -a, -j, --eyelid)": posed.given})
    expect_bundle(bundle)
    avatar = load(bundle)
    if clip is None:
        shown = posed.pose(avatar)
    else:
        poses = own_clip(avatar, clip).poses
        if frame >= len(poses):
            raise AvatarError(f"is {frame}, but the clip has {len(poses)} frames", field="--frame")
        shown = poses[frame]
    text = json.dumps(pose_document(avatar, shown), indent=1, ensure_ascii=False) + "\n"
    refuse_existing(out, force)
    write_text(out, text, force=force)
    tell(posed.notes(avatar))
    output.print(f"{out}: a transform for each node, a weight for each morph target of rig.glb and rig.usdc")
