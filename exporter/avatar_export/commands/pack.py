"""`avatar-export pack`: an avatar in, one small file for players out."""

from __future__ import annotations

import re
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path
from typing import Annotated

import typer

from avatar_export import conversion
from avatar_export.clips.sources import clip_notes
from avatar_export.commands import arguments, inputs
from avatar_export.commands.console import Steps, messages, output, print_json
from avatar_export.measure.yardstick import Measured
from avatar_export.packing.make import Choices, Made, make_pack
from avatar_runtime.handedness import HANDEDNESS

UNITS = {"": 1, "kb": 10**3, "mb": 10**6, "kib": 1 << 10, "mib": 1 << 20}
SIZE = re.compile(r"([0-9]{1,12}(?:\.[0-9]{1,6})?) ?([a-z]{0,3})", re.IGNORECASE)
MOST_LEVELS = 8


def pack(
    source: Annotated[
        Path, typer.Argument(help="A bundle, a pack, or the output of training (see `systems`).")
    ],
    out: Annotated[Path, typer.Option("--out", "-o", help="File to write, NAME.avatar.")],
    max_bytes: Annotated[
        str | None,
        typer.Option(
            help="Largest size of the file, such as 900kB or 2MB. The best image that fits is chosen."
        ),
    ] = None,
    min_psnr: Annotated[
        float | None,
        typer.Option(
            help="Least mean PSNR in dB, inside the avatar's outline at 512x512, in every kind of poses. The smallest "
            "file is chosen.",
            min=10,
            max=120,
        ),
    ] = None,
    levels: Annotated[
        str, typer.Option(help="Levels of detail as parts of the Gaussians, finest first: 1,0.5,0.25.")
    ] = "1",
    sh_degree: Annotated[int | None, typer.Option(help="Highest SH degree to keep.", min=0, max=3)] = None,
    handedness: Annotated[
        str,
        typer.Option(help=f"Frame of the pack: {' or '.join(HANDEDNESS)} (Unity, Unreal)."),
    ] = HANDEDNESS[0],
    exact: Annotated[
        bool, typer.Option("--exact", help="Keep float32 throughout, for people who port kernels.")
    ] = False,
    reference: Annotated[
        bool,
        typer.Option(
            "--reference", help="Write NAME.reference too: a small pack with the outputs of every stage."
        ),
    ] = False,
    report: Annotated[
        Path | None, typer.Option(help="FILE.html to write: source, pack, difference, bytes by part.")
    ] = None,
    no_preview: Annotated[
        bool, typer.Option("--no-preview", help="Put no still image into the file.")
    ] = False,
    system: arguments.System = None,
    body_model: inputs.BodyModel = None,
    body_scale: inputs.BodyScale = None,
    shape: inputs.Shape = None,
    eyelids: inputs.Eyelids = None,
    anchor_faces: inputs.AnchorFaces = None,
    dataset: inputs.Dataset = None,
    rig: inputs.Rig = None,
    mesh: inputs.Mesh = None,
    poses: inputs.Poses = None,
    units: inputs.Units = None,
    mesh_scaling: inputs.MeshScaling = None,
    sh_direction: inputs.ShDirection = None,
    quaternion_sign: inputs.QuaternionSign = None,
    no_rig: inputs.NoRig = False,
    accept_misfit: inputs.AcceptMisfit = False,
    rotation: inputs.Rotation = None,
    driving: inputs.Driving = None,
    clip: inputs.Clip = None,
    name: inputs.Name = None,
    licence: inputs.Licence = None,
    author: inputs.Author = None,
    consent: inputs.Consent = None,
    force: arguments.Force = False,
    as_json: arguments.AsJson = False,
) -> None:
    """Write an avatar as one small file for players. The exit code is 1 if a budget cannot be met."""
    arguments.one_of("--handedness", handedness, HANDEDNESS)
    arguments.exclude({"--max-bytes": max_bytes, "--min-psnr": min_psnr, "--exact": exact})
    given = {**locals(), "exact": False, "sh_degree": None}
    choices = Choices(
        exact,
        None if max_bytes is None else byte_count(max_bytes),
        min_psnr,
        level_parts(levels),
        sh_degree,
        handedness,
        not no_preview,
    )
    with Steps() as step:
        avatar = conversion.read_source(
            source,
            inputs.read_options(given),
            system=system,
            driving=driving,
            clips=clip or (),
            licence=licence,
            author=author,
            consent=consent,
            progress=step,
        )
        notes = [note for path in clip or () for note in clip_notes(avatar, path)]
        made = make_pack(avatar, out, choices, report=report, reference=reference, force=force, progress=step)
    if as_json:
        print_json({"out": str(out), "bytes": len(made.file), "parts": dict(made.parts), **made.document})
    else:
        _print(out, made, notes)
    raise typer.Exit(0 if made.met else 1)


def _print(out: Path, made: Made, notes: Sequence[str]) -> None:
    for index, measured in enumerate(made.measured):
        count, figures = made.counts[index], _figures(measured)
        output.print(
            f"{out}: {len(made.file) / 1e6:.2f} MB, {count} Gaussians, {figures}"
            if index == 0
            else f"  level {index}: {count} Gaussians, {figures}"
        )
    for part, size in made.parts.items():
        output.print(f"  {size / 1e3:9.1f} kB  {part}")
    for note in (*notes, *made.notes):
        messages.print(f"note: {note}")


def _figures(measured: Measured) -> str:
    pixel = measured.worst_pixel
    return f"mean {measured.mean:.1f} dB, worst {measured.worst:.1f} dB {measured.region}" + (
        "" if pixel is None else f", no pixel off by more than {255 * pixel:.0f} of 255"
    )


def byte_count(text: str) -> int:
    """Bytes from 900000, 900kB, 2MB or 2MiB. Raises a usage error for anything else."""
    found = SIZE.fullmatch(text.strip())
    if found is None or found[2].lower() not in UNITS or not float(found[1]):
        raise typer.BadParameter(f"{text!r} is not a size such as 900kB or 2MB", param_hint="--max-bytes")
    return int(float(found[1]) * UNITS[found[2].lower()])


def level_parts(text: str) -> tuple[float, ...]:
    """Parts of the Gaussians from 1,0.5,0.25: the first is 1, and each is smaller than the one before."""
    try:
        parts = tuple(float(part) for part in text.split(","))
    except ValueError:
        parts = ()
    falling = all(0 < later < earlier for earlier, later in pairwise(parts))
    if not parts or parts[0] != 1 or not falling or len(parts) > MOST_LEVELS:
        raise typer.BadParameter(
            f"{text!r} is not a list such as 1,0.5,0.25: it begins at 1 and falls, up to {MOST_LEVELS} levels",
            param_hint="--levels",
        )
    return parts
