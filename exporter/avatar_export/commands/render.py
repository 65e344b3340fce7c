"""`avatar-export render`: a bundle in, images out."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Annotated

import typer

from avatar_export.commands import arguments
from avatar_export.commands.console import Steps, messages, output
from avatar_export.playing import frames as playing
from avatar_export.playing import sequences
from avatar_export.playing.tracked import seen_by, tracked
from avatar_export.readers.table import expect_bundle
from avatar_runtime.avatar import Avatar
from avatar_runtime.backends import BACKENDS
from avatar_runtime.bundle import load, warnings
from avatar_runtime.io.errors import AvatarError
from avatar_runtime.player import at_level
from avatar_runtime.stages.raster import PROFILES


def render(
    bundle: arguments.Bundle,
    out: Annotated[
        Path, typer.Option("--out", "-o", help="FILE.png, FILE.webp (animated), or a folder for PNG files.")
    ],
    expression: arguments.Expressions = None,
    arkit: arguments.Arkit = None,
    joint: arguments.Turns = None,
    eyelid: arguments.Eyelids = None,
    drive: Annotated[
        Path | None,
        typer.Option(
            help="Recording to play: Live Link Face CSV or UDP packets, or bsData.json of LAM, alone or in a zip."
        ),
    ] = None,
    clip: Annotated[
        str | None,
        typer.Option(
            help="Clip to play: the name of a clip of the bundle; BUNDLE:NAME, a clip of another avatar with the "
            "same expressions or ARKit's; or a .glb, .fbx, LAM zip or pose file.",
            metavar="NAME|BUNDLE:NAME|FILE",
        ),
    ] = None,
    clip_name: Annotated[
        str | None, typer.Option(help="Name of the clip in the FILE of --clip. Default: the first.")
    ] = None,
    meshes: Annotated[
        list[Path] | None,
        typer.Option(
            help="Posed meshes, for Gaussians bound to a surface: an .npz with vertices [frames, V, 3], a folder of "
            ".obj files in the order of their names, or one .obj each time the option is given."
        ),
    ] = None,
    mesh_units: Annotated[
        float | None,
        typer.Option(
            help="Units of --meshes per metre. Default: the avatar's training units.", min=1e-6, max=1e6
        ),
    ] = None,
    every: Annotated[
        int, typer.Option(help="Take every N-th frame of the sequence, or of --frames.", min=1)
    ] = 1,
    frames: Annotated[
        str | None, typer.Option(help="Take the frames FIRST:END of the sequence, as it is stored.")
    ] = None,
    fps: Annotated[
        float,
        typer.Option(
            help="Frames per second of --meshes and --orbit. Clips have their own.", min=0.1, max=240
        ),
    ] = 30.0,
    camera: Annotated[
        Path | None,
        typer.Option(
            help="Tracked cameras: a capture's folder, or its capture.json, transforms.json, flame_params.json or "
            ".frame file. One for each pose, or one for all; a single pose is seen by each."
        ),
    ] = None,
    camera_frames: Annotated[
        str | None, typer.Option(help="Take the cameras FIRST:END of --camera, counted from 0.")
    ] = None,
    size: Annotated[
        str | None, typer.Option(help="Size in pixels, N or WxH. Default: 512; with --camera, as tracked.")
    ] = None,
    yaw: Annotated[
        float, typer.Option(help="Camera yaw in degrees. Positive: from the subject's left.")
    ] = 0.0,
    pitch: Annotated[float, typer.Option(help="Camera pitch in degrees. Positive: from above.")] = 0.0,
    zoom: Annotated[float, typer.Option(help="Camera zoom. 1 shows the whole avatar.", min=0.01)] = 1.0,
    orbit: Annotated[
        float,
        typer.Option(
            help="Degrees that the camera orbits over the sequence. A single pose becomes a turntable."
        ),
    ] = 0.0,
    background: Annotated[
        str | None,
        typer.Option(help="R,G,B from 0 to 1, or `transparent`. Default: the training background."),
    ] = None,
    profile: Annotated[
        str | None,
        typer.Option(help=f"Raster profile: {' or '.join(PROFILES)}. Default: the backend's first."),
    ] = None,
    backend: arguments.Backend = None,
    level: Annotated[int, typer.Option(help="Level of detail of a pack, 0 the finest.", min=0)] = 0,
    enhance: Annotated[
        bool, typer.Option("--enhance", help="Run the avatar's enhancer on each image.")
    ] = False,
    force: arguments.Force = False,
) -> None:
    """Draw a bundle or a pack: one pose, a recording, a clip or posed meshes."""
    width, height = arguments.size(size or "512")
    arguments.one_of("--profile", profile, PROFILES)
    arguments.one_of("--backend", backend, BACKENDS)
    arguments.finite({"--yaw": yaw, "--pitch": pitch, "--zoom": zoom, "--orbit": orbit, "--fps": fps})
    posed = expression or arkit or joint or eyelid
    if clip_name is not None and (clip is None or not Path(clip).exists()):
        raise typer.BadParameter("needs --clip FILE", param_hint="--clip-name")
    moving = {"--drive": drive, "--clip": clip, "--meshes": meshes}
    arguments.exclude({**moving, "a pose (-e, -a, -j, --eyelid)": posed})
    placed = (yaw, pitch, zoom, orbit) != (0, 0, 1, 0)
    arguments.exclude({"--camera": camera, "--yaw, --pitch, --zoom, --orbit": placed})
    if camera is None and camera_frames is not None:
        raise typer.BadParameter("needs --camera", param_hint="--camera-frames")
    if not any(moving.values()) and orbit == 0 and frames is not None:
        raise typer.BadParameter(
            "goes with --drive, --clip, --meshes or --orbit; without them there is one image",
            param_hint="--frames",
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

    def chosen(avatar: Avatar) -> sequences.PoseSequence:
        pose = arguments.pose(avatar, expression, arkit, joint, eyelid)
        if drive is not None:
            return sequences.recorded(avatar, drive)
        if clip is not None:
            return sequences.clip(avatar, clip, clip_name)
        if meshes:
            return sequences.meshes(avatar, meshes, mesh_units, fps)
        turns = orbit != 0 and out.suffix != ".png"
        return sequences.turntable(pose, fps) if turns else sequences.PoseSequence([pose], fps)

    with Steps() as step:
        step("loading")
        expect_bundle(bundle)
        avatar = at_level(load(bundle), level)
        sequence = chosen(avatar)
        shown = sequence.part(arguments.frame_slice(frames))
        if camera is not None:
            asked = None if size is None else (width, height)
            cameras = tracked(camera, asked, arguments.frame_slice(camera_frames, "--camera-frames"))
            shown = seen_by(shown, cameras, camera)
            width, height = cameras[0].width, cameras[0].height
            view = replace(view, width=width, height=height, cameras=cameras[::every])
        shown = shown.part(slice(None, None, every))
        count = len(shown.poses)
        if not count:
            raise AvatarError(
                f"{frames} holds no frame; the sequence has {len(sequence.poses)}", field="--frames"
            )
        images = playing.frames(avatar, shown, view)
        playing.save(out, images, count, shown.fps, force, lambda i: step(f"frame {i} of {count}"))
    for note in (*warnings(bundle), *sequence.notes):
        messages.print(f"note: {note}")
    output.print(f"{out}: {count} image{'s' * (count > 1)} of {width}x{height}")
