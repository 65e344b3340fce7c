"""`avatar-export pack`: an avatar in, one small file for players out."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from avatar_export.commands import arguments
from avatar_export.commands.console import Steps, output, print_json, tell
from avatar_export.commands.declared import command
from avatar_export.conversion import read_source
from avatar_export.convert_options import SourceOptions
from avatar_export.measure.yardstick import Measured
from avatar_export.packing.choices import Choices
from avatar_export.packing.make import Made, make_pack


@command
def pack(
    source: Annotated[
        Path, typer.Argument(help="A bundle, a pack, or the output of training (see `systems`).")
    ],
    out: Annotated[Path, typer.Option("--out", "-o", help="File to write, NAME.avatar.")],
    choices: Choices,
    options: SourceOptions,
    reference: Annotated[
        bool,
        typer.Option(
            "--reference", help="Write NAME.reference too: a small pack with the outputs of every stage."
        ),
    ] = False,
    report: Annotated[
        Path | None, typer.Option(help="FILE.html to write: source, pack, difference, bytes by part.")
    ] = None,
    force: arguments.Force = False,
    as_json: arguments.AsJson = False,
) -> None:
    """Write an avatar as one small file for players. The exit code is 1 if a budget cannot be met."""
    aims = {"--max-bytes": choices.max_bytes, "--min-psnr": choices.min_psnr, "--exact": choices.exact}
    arguments.exclude(aims)
    with Steps() as step:
        read = read_source(source, options, step)
        made = make_pack(
            read.avatar, out, choices, report=report, reference=reference, force=force, progress=step
        )
    notes = [*made.notes, *read.clip_notes]
    tell(note for note in notes if note.doubtful)
    if as_json:
        print_json({"out": str(out), "bytes": len(made.file), "parts": dict(made.parts), **made.document})
    else:
        _print(out, made)
        tell(note for note in notes if not note.doubtful)
    raise typer.Exit(0 if made.met else 1)


def _print(out: Path, made: Made) -> None:
    for index, measured in enumerate(made.measured):
        count, figures = made.counts[index], _figures(measured)
        output.print(
            f"{out}: {len(made.file) / 1e6:.2f} MB, {count} Gaussians, {figures}"
            if index == 0
            else f"  level {index}: {count} Gaussians, {figures}"
        )
    for part, size in made.parts.items():
        output.print(f"  {size / 1e3:9.1f} kB  {part}")


def _figures(measured: Measured) -> str:
    pixel = measured.worst_pixel
    return f"mean {measured.mean:.1f} dB, worst {measured.worst:.1f} dB {measured.region}" + (
        "" if pixel is None else f", no pixel off by more than {255 * pixel:.0f} of 255"
    )
