"""`avatar-export convert`: a trained avatar in, a bundle out."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from avatar_export import conversion
from avatar_export.commands import arguments
from avatar_export.commands.console import Steps, output, print_json, tell
from avatar_export.commands.declared import command
from avatar_export.convert_options import ConvertOptions
from avatar_export.notes.note import Note
from avatar_export.packing.choices import Choices
from avatar_export.packing.make import make_pack
from avatar_export.summary import summary
from avatar_runtime.avatar import Avatar
from avatar_runtime.io.text_files import refuse_existing


@command
def convert(
    source: Annotated[
        Path, typer.Argument(help="The output of training: a folder, checkpoint or zip (see `systems`).")
    ],
    out: Annotated[Path, typer.Option("--out", "-o", help="Bundle folder to write, or FILE.avatar.zip.")],
    options: ConvertOptions,
    pack: Annotated[Path | None, typer.Option(help="NAME.avatar to write too: see `pack`.")] = None,
    force: arguments.Force = False,
    as_json: arguments.AsJson = False,
) -> None:
    """Convert a trained avatar to a bundle."""
    if pack is not None:
        refuse_existing(pack, force)
    handedness, notes = options.handedness, list[Note]()
    with Steps() as step:
        made = conversion.convert(source, out, options, force=force, progress=step)
        if pack is not None:
            packed = make_pack(made.avatar, pack, Choices(handedness=handedness), force=force, progress=step)
            notes = [note for note in packed.notes if note.doubtful]
    tell([*notes, *(note for note in made.notes if note.doubtful and as_json)])
    if as_json:
        print_json({"out": str(out), "bytes": made.size, "handedness": handedness, **summary(made.avatar)})
        return
    left = ", left-handed" if handedness == "left" else ""
    output.print(f"{out}: {_contents(made.avatar)}, {made.size / 1e6:.1f} MB{left}")
    tell(made.notes)


def _contents(avatar: Avatar) -> str:
    """`1000 Gaussians, 50 expressions, 2 clips`."""
    count = len(avatar.clips)
    clips = f", {count} clip{'s' * (count > 1)}" if count else ""
    return f"{avatar.gaussians.count} Gaussians, {len(avatar.expressions)} expressions{clips}"
