"""`avatar-export poses`: the poses and expressions to dump for distilling, as drivers.npz."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import numpy as np
import typer

from avatar_export.commands import arguments
from avatar_export.commands.console import output
from avatar_export.commands.declared import command
from avatar_export.distill import drivers
from avatar_export.distill.poses import DEGREES, driven, poses_to_dump
from avatar_export.options import Option, Shape
from avatar_runtime.io.text_files import refuse_existing


@command
def poses(
    source: Annotated[
        Path,
        typer.Argument(
            help="The body model that drives the avatar (FLAME, SMPL, SMPL-X: .npz or .pkl), or its rig "
            "(.glb, .fbx, ASM face .npz).",
            metavar="BODY|RIG",
        ),
    ],
    out: Annotated[Path, typer.Option("--out", "-o", help="FILE.npz to write.")],
    shape: Shape = None,
    frames: Annotated[
        int | None,
        typer.Option(
            help="Number of random frames. Default: as many as the others, at least 60.", min=0, max=10_000
        ),
    ] = None,
    degrees: Annotated[
        float,
        Option(
            "How far a joint turns about each of its axes. Jaw and eyes have ranges of their own; roots stay.",
            least=0,
            most=90,
        ),
    ] = DEGREES,
    seed: Annotated[int, typer.Option(help="Seed of the random frames.", min=0, max=2**31)] = 0,
    force: arguments.Force = False,
) -> None:
    """Write the poses and expressions that a code should dump, so that an avatar can be learnt from them.

    The frames show each driver alone, each joint alone at the ends of its range, and random mixtures.
    """
    refuse_existing(out, force)
    made = poses_to_dump(driven(source, shape, degrees), frames, seed)
    drivers.write(made, out, force=force)
    takes = ", ".join(str(count) for count in np.bincount(made.take))
    output.print(
        f"{out}: {made.frames} frames of {len(made.driver_names)} drivers and {len(made.joint_names)} joints, "
        f"in takes of {takes}"
    )
