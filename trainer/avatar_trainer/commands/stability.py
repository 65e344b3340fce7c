"""`avatar-train stability BUNDLE --clip OTHER`."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Annotated

import typer

from avatar_export.commands import arguments, console
from avatar_export.playing import sequences
from avatar_export.readers import table
from avatar_runtime import load
from avatar_trainer.captures.load import load as load_capture
from avatar_trainer.evaluation import stability as measures
from avatar_trainer.loop.progress import note

PSAVATAR = "psavatar"  # the system whose learned bases are in the rig of its bundle


def stability(
    bundle: arguments.Bundle,
    clip: Annotated[
        str,
        typer.Option(
            help="Motion that the avatar was not trained on: a recording, another file with clips, or the name of a "
            "clip of the bundle.",
            metavar="NAME|FILE",
        ),
    ],
    capture: Annotated[
        Path | None,
        typer.Option(help="Capture of its training, whose body model has no learned bases; for psavatar."),
    ] = None,
    every: Annotated[int, typer.Option(help="Take every N-th frame of the clip.", min=1)] = 1,
    as_json: arguments.AsJson = False,
) -> None:
    """Measure how a bundle holds up in motion that it was not trained on: torn share, flicker, sharpness."""
    with console.Steps() as step:
        step("loading")
        table.expect_bundle(bundle)
        avatar = load(bundle)
        trained_on = None if capture is None else load_capture(capture)
        sequence = sequences.clip(avatar, clip, None).part(slice(None, None, every))
        step(f"playing {len(sequence.poses)} frames")
        result = measures.stability(avatar, sequence.poses, trained_on)
    console.tell(sequence.notes)
    if trained_on is None and avatar.provenance.get("system") == PSAVATAR:
        note(
            "flicker is measured against a mesh that has the learned bases of this bundle; pass --capture to "
            "measure it against the body model"
        )
    if as_json:
        console.print_json({"clip": clip, "how": measures.HOW, **dataclasses.asdict(result)})
    else:
        console.output.print(measures.table(result))
