"""The command line: convert, inspect, validate, render, systems."""

from __future__ import annotations

import io
import sys
from pathlib import Path
from typing import Annotated

import typer

from avatar_export import GENERATOR, arguments, playing
from avatar_export.console import Steps, facts_table, messages, output, print_json
from avatar_export.driving.drive import driving_notes
from avatar_export.driving.matrix import with_driving
from avatar_export.inspect import inspect as inspect_avatar
from avatar_export.inspect import summary
from avatar_export.provenance import with_rights
from avatar_export.read import READERS, expect_bundle, read
from avatar_export.readers.inputs import found_driving
from avatar_export.readers.options import ReadOptions
from avatar_export.validate import validate as validate_bundle
from avatar_export.writers.bundle import write_bundle
from avatar_runtime.avatar import Avatar
from avatar_runtime.bundle import load, warnings
from avatar_runtime.errors import AvatarError
from avatar_runtime.rules import ROTATION_RULES
from avatar_runtime.stages.raster import PROFILES

app = typer.Typer(
    help=f"Turns trained avatars ({', '.join(r.system for r in READERS)}) into portable bundles, and plays them.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
)

AsJson = Annotated[bool, typer.Option("--json", help="Print JSON.")]
Force = Annotated[bool, typer.Option("--force", help="Replace OUT if it exists.")]
System = Annotated[
    str | None, typer.Option(help=f"Skip detection: {', '.join(r.system for r in READERS)}.", metavar="NAME")
]


@app.command()
def convert(
    source: Annotated[
        Path, typer.Argument(help="What training left: a folder, checkpoint or zip (see `systems`).")
    ],
    out: Annotated[Path, typer.Option("--out", "-o", help="Bundle folder to write, or FILE.avatar.zip.")],
    system: System = None,
    body_model: Annotated[Path | None, typer.Option(help="FLAME- or SMPL-layout .npz or .pkl.")] = None,
    body_scale: Annotated[
        float, typer.Option(help="Training units in one unit of the body model.", min=1e-6, max=1e6)
    ] = 1.0,
    shape: Annotated[
        Path | None,
        typer.Option("--shape", "--frame", help="Identity: tracked .frame, .npy, .npz, .json, or `zero`."),
    ] = None,
    eyelids: Annotated[Path | None, typer.Option(help="Folder with l_eyelid.npy and r_eyelid.npy.")] = None,
    anchor_faces: Annotated[
        Path | None, typer.Option(help="Face indices that carry the upper teeth (.txt).")
    ] = None,
    dataset: Annotated[
        Path | None,
        typer.Option(help="Folder to search for the inputs that are not given, driving.json too."),
    ] = None,
    no_rig: Annotated[bool, typer.Option("--no-rig", help="Expressions only: no joints, no skin.")] = False,
    rotation: Annotated[
        str | None,
        typer.Option(help=f"Rotation rule where a system leaves it open: {', '.join(ROTATION_RULES)}."),
    ] = None,
    driving: Annotated[
        Path | None, typer.Option(help="JSON matrix from the ARKit names to this avatar.")
    ] = None,
    exact: Annotated[bool, typer.Option("--exact", help="Keep deltas that are mere rounding noise.")] = False,
    name: Annotated[str | None, typer.Option(help="Name of the avatar.")] = None,
    licence: Annotated[str | None, typer.Option(help="Licence of the avatar, for the manifest.")] = None,
    author: Annotated[str | None, typer.Option(help="Who made it, for the manifest.")] = None,
    consent: Annotated[
        str | None, typer.Option(help="What the person shown agreed to, for the manifest.")
    ] = None,
    no_preview: Annotated[bool, typer.Option("--no-preview", help="Do not draw preview.png.")] = False,
    force: Force = False,
    as_json: AsJson = False,
) -> None:
    """Write the bundle of a trained avatar."""
    options = ReadOptions(
        body_model, body_scale, shape, eyelids, anchor_faces, dataset, no_rig, rotation, exact, name
    )
    with Steps() as step:
        step("reading")
        avatar = with_rights(read(source, options, system), licence, author, consent)
        driving = driving or found_driving(dataset)
        if driving is not None:
            avatar = with_driving(avatar, driving).check()
        manifest = write_bundle(
            avatar, out, preview=not no_preview, force=force, progress=lambda file: step(f"writing {file}")
        )
    size = sum(entry["bytes"] for entry in manifest["files"])
    if as_json:
        print_json({"out": str(out), "bytes": size, **summary(avatar)})
        return
    output.print(
        f"{out}: {avatar.gaussians.count} Gaussians, {len(avatar.expressions)} expressions, {size / 1e6:.1f} MB"
    )
    for note in _conversion_notes(avatar):
        messages.print(f"note: {note}")


@app.command()
def inspect(
    path: Annotated[Path, typer.Argument(help="A bundle, or a trained avatar.")],
    system: System = None,
    as_json: AsJson = False,
) -> None:
    """Show what is in a bundle or a trained avatar."""
    with Steps() as step:
        step("reading")
        facts = inspect_avatar(path, system)
    if as_json:
        print_json(facts)
        return
    output.print(facts_table(facts))


@app.command()
def validate(
    bundle: Annotated[Path, typer.Argument(help="A bundle folder or .avatar.zip.")],
    as_json: AsJson = False,
) -> None:
    """Check every file of a bundle; exit code 1 if anything is wrong."""
    with Steps() as step:
        step("checking")
        expect_bundle(bundle)
        problems = validate_bundle(bundle)
    errors = [p for p in problems if not p.warning]
    if as_json:
        print_json([{"path": p.path, "message": p.message, "warning": p.warning} for p in problems])
    else:
        for problem in problems:
            output.print(f"{'warning' if problem.warning else 'error'}: {problem}")
        if not errors:
            output.print(f"{bundle}: sound")
    raise typer.Exit(1 if errors else 0)


@app.command()
def render(
    bundle: Annotated[Path, typer.Argument(help="A bundle folder or .avatar.zip.")],
    out: Annotated[
        Path, typer.Option("--out", "-o", help="FILE.png, FILE.webp (animated) or a folder of PNGs.")
    ],
    expression: Annotated[
        list[str] | None, typer.Option("--expression", "-e", help="One of the avatar's own, NAME=WEIGHT.")
    ] = None,
    arkit: Annotated[
        list[str] | None,
        typer.Option("--arkit", "-a", help="ARKit NAME=WEIGHT, through the avatar's driving."),
    ] = None,
    joint: Annotated[
        list[str] | None, typer.Option("--joint", "-j", help="NAME=X,Y,Z: rotation vector in degrees.")
    ] = None,
    eyelid: Annotated[list[str] | None, typer.Option("--eyelid", help="NAME=WEIGHT.")] = None,
    drive: Annotated[Path | None, typer.Option(help="Live Link Face recording: CSV or UDP packets.")] = None,
    clip: Annotated[
        Path | None,
        typer.Option(help=".glb with an animation for the avatar's joints, or a LAM zip that holds one."),
    ] = None,
    clip_name: Annotated[str | None, typer.Option(help="Which clip; default: the first.")] = None,
    every: Annotated[int, typer.Option(help="Take each N-th frame of the recording.", min=1)] = 1,
    frames: Annotated[str | None, typer.Option(help="Only frames FIRST:END of the sequence.")] = None,
    fps: Annotated[
        float, typer.Option(help="Frames a second, for --clip and --orbit.", min=0.1, max=240)
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
    profile: Annotated[str, typer.Option(help=" or ".join(PROFILES) + ".")] = PROFILES[0],
    force: Force = False,
) -> None:
    """Draw a bundle: one pose, a recording or a clip."""
    width, height = arguments.size(size)
    arguments.finite({"--yaw": yaw, "--pitch": pitch, "--zoom": zoom, "--orbit": orbit, "--fps": fps})
    posed = expression or arkit or joint or eyelid
    posed = expression or arkit or joint or eyelid
    posed = expression or arkit or joint or eyelid
    arguments.exclude({"--drive": drive, "--clip": clip, "a pose (-e, -a, -j, --eyelid)": posed})
    if drive is None and clip is None and orbit == 0 and frames is not None:
        raise typer.BadParameter("there is one picture; --frames goes with --drive, --clip or --orbit")
    view = playing.View(
        width,
        height,
        yaw,
        pitch,
        zoom,
        orbit,
        arguments.background(background),
        background == "transparent",
        arguments.profile(profile),
    )
    with Steps() as step:
        step("loading")
        expect_bundle(bundle)
        avatar = load(bundle)
        newer = warnings(bundle)
        flags = playing.pose_from_flags(
            avatar,
            {k: arguments.numbers(v, 1)[0] for k, v in arguments.pairs(expression)},
            {k: arguments.numbers(v, 1)[0] for k, v in arguments.pairs(arkit)},
            {k: arguments.numbers(v, 3) for k, v in arguments.pairs(joint)},  # type: ignore[misc]
            {k: arguments.numbers(v, 1)[0] for k, v in arguments.pairs(eyelid)},
        )
        sequence = _sequence(avatar, drive, clip, clip_name, every, fps)
        if sequence is None:
            turning = orbit != 0 and out.suffix != ".png"
            sequence = playing.turntable(flags, fps) if turning else playing.PoseSequence([flags], fps)
        poses = sequence.poses[arguments.frame_slice(frames)]
        if not poses:
            raise AvatarError(f"no frame of {len(sequence.poses)} is in {frames}", field="--frames")
        count = len(poses)
        pictures = playing.frames(avatar, poses, view)
        playing.save(out, pictures, count, sequence.fps, force, lambda i: step(f"frame {i} of {count}"))
    for note in (*newer, *sequence.notes):
        messages.print(f"note: {note}")
    output.print(f"{out}: {count} {'picture' if count == 1 else 'pictures'} of {width}x{height}")


@app.command()
def systems(as_json: AsJson = False) -> None:
    """List the systems whose avatars can be read, and from which files."""
    if as_json:
        print_json([{"system": r.system, "about": r.about, "files": list(r.files)} for r in READERS])
        return
    for reader in READERS:
        output.print(f"{reader.system}  {reader.about}", style="bold")
        for line in reader.files:
            output.print(f"    {line}")


def _version(show: bool) -> None:
    if show:
        print(GENERATOR)
        raise typer.Exit


@app.callback()
def _root(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Show version.")
    ] = False,
) -> None:
    pass


def main() -> None:
    """Entry point: bad data is one line and exit code 2; anything else that escapes is a bug."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")
    try:
        app()
    except (AvatarError, OSError, UnicodeError) as error:  # the last two: names that this system cannot take
        text = " ".join(str(error).split()).encode("utf-8", "backslashreplace").decode()
        print(f"avatar-export: {text}", file=sys.stderr)
        sys.exit(2)


def _conversion_notes(avatar: Avatar) -> list[str]:
    notes = []
    dropped = avatar.provenance.get("face_rows_dropped")
    if dropped:
        notes.append(f"{len(dropped)} rows with a NaN or infinity were dropped; avatar.json lists them")
    if avatar.rig is None:
        notes.append("no rig: expressions only, joints and teeth do not move")
    notes.extend(driving_notes(avatar))
    notes.extend(avatar.provenance.get("notes", ()))
    return notes


def _sequence(
    avatar: Avatar, drive: Path | None, clip: Path | None, clip_name: str | None, every: int, fps: float
) -> playing.PoseSequence | None:
    if drive is not None:
        return playing.recorded(avatar, drive, every)
    if clip is not None:
        return playing.clip(avatar, clip, clip_name, fps)
    return None
