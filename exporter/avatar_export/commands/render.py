"""`avatar-export render`: a bundle in, pictures out."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from avatar_export.commands import arguments, playing
from avatar_export.commands.console import Steps, messages, output
from avatar_export.commands.pose import flags_pose
from avatar_export.readers.table import expect_bundle
from avatar_runtime.backends import BACKENDS
from avatar_runtime.bundle import load, warnings
from avatar_runtime.io.errors import AvatarError
from avatar_runtime.stages.raster import PROFILES


def render(
    bundle: Annotated[Path, typer.Argument(help="A bundle folder or .avatar.zip.")],
    out: Annotated[
        Path, typer.Option("--out", "-o", help="FILE.png, FILE.webp (animated) or a folder of PNGs.")
    ],
    expression: arguments.Expressions = None,
    arkit: arguments.Arkit = None,
    joint: arguments.Turns = None,
    eyelid: arguments.Eyelids = None,
    drive: Annotated[Path | None, typer.Option(help="Live Link Face recording: CSV or UDP packets.")] = None,
    clip: Annotated[
        str | None,
        typer.Option(
            help="A clip of the bundle by name; or a .glb, .fbx, LAM zip or pose file for its joints.",
            metavar="NAME|FILE",
        ),
    ] = None,
    clip_name: Annotated[str | None, typer.Option(help="Which clip of FILE; default: the first.")] = None,
    meshes: Annotated[
        list[Path] | None,
        typer.Option(
            help="Posed meshes for a surface avatar: an .npz with vertices [frames, V, 3], a folder of .obj "
            "in the order of their names, or this option again for each .obj."
        ),
    ] = None,
    mesh_units: Annotated[
        float | None,
        typer.Option(
            help="Units of --meshes in a metre; default: the avatar's training units.", min=1e-6, max=1e6
        ),
    ] = None,
    every: Annotated[int, typer.Option(help="Take each N-th frame of the sequence.", min=1)] = 1,
    frames: Annotated[str | None, typer.Option(help="Only frames FIRST:END of the sequence.")] = None,
    fps: Annotated[
        float,
        typer.Option(help="Frames a second of --meshes and --orbit; clips have their own.", min=0.1, max=240),
    ] = 30.0,
    size: Annotated[str, typer.Option(help="Pixels, N or WxH.")] = "512",
    yaw: Annotated[float, typer.Option(help="Camera, degrees; positive: from the subject's left.")] = 0.0,
    pitch: Annotated[float, typer.Option(help="Camera, degrees; positive: from above.")] = 0.0,
    zoom: Annotated[float, typer.Option(help="1 shows the whole avatar.", min=0.01)] = 1.0,
    orbit: Annotated[
        float,
        typer.Option(help="Degrees the camera travels; one pose becomes a turntable."),
    ] = 0.0,
    background: Annotated[
        str | None, typer.Option(help="R,G,B from 0 to 1, or `transparent`; default: the trainer's.")
    ] = None,
    profile: Annotated[
        str | None,
        typer.Option(help=f"{' or '.join(PROFILES)}; default: the first that the backend draws."),
    ] = None,
    backend: arguments.Backend = None,
    enhance: Annotated[
        bool, typer.Option("--enhance", help="Put each picture through the avatar's enhancer.")
    ] = False,
    force: arguments.Force = False,
) -> None:
    """Draw a bundle: one pose, a recording or a clip."""
    width, height = arguments.size(size)
    arguments.one_of("--profile", profile, PROFILES)
    arguments.one_of("--backend", backend, BACKENDS)
    arguments.finite({"--yaw": yaw, "--pitch": pitch, "--zoom": zoom, "--orbit": orbit, "--fps": fps})
    posed = expression or arkit or joint or eyelid
    if clip_name is not None and (clip is None or not Path(clip).exists()):
        raise typer.BadParameter("names a clip of a --clip FILE", param_hint="--clip-name")
    moving = {"--drive": drive, "--clip": clip, "--meshes": meshes}
    arguments.exclude({**moving, "a pose (-e, -a, -j, --eyelid)": posed})
    if not any(moving.values()) and orbit == 0 and frames is not None:
        raise typer.BadParameter(
            "there is one picture; --frames goes with --drive, --clip, --meshes or --orbit"
        )
    view = playing.View(
        width,
        height,
        yaw,
        pitch,
        zoom,
        orbit,
        arguments.background(background),
        background == "transparent",
        profile,
        backend,
        enhance,
    )
    with Steps() as step:
        step("loading")
        expect_bundle(bundle)
        avatar = load(bundle)
        newer = warnings(bundle)
        flags = flags_pose(avatar, expression, arkit, joint, eyelid)
        if drive is not None:
            sequence = playing.recorded(avatar, drive, every)
        elif clip is not None:
            sequence = playing.clip(avatar, clip, clip_name, every)
        elif meshes:
            sequence = playing.meshes(avatar, meshes, mesh_units, fps, every)
        elif orbit != 0 and out.suffix != ".png":
            sequence = playing.turntable(flags, fps)
        else:
            sequence = playing.PoseSequence([flags], fps)
        shown = sequence.part(arguments.frame_slice(frames))
        count = len(shown.poses)
        if not count:
            raise AvatarError(f"no frame of {len(sequence.poses)} is in {frames}", field="--frames")
        pictures = playing.frames(avatar, shown, view)
        playing.save(out, pictures, count, sequence.fps, force, lambda i: step(f"frame {i} of {count}"))
    for note in (*newer, *sequence.notes):
        messages.print(f"note: {note}")
    output.print(f"{out}: {count} {'picture' if count == 1 else 'pictures'} of {width}x{height}")
