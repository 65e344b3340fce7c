"""`avatar-train check CAPTURE`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from avatar_export.commands import console
from avatar_trainer.captures.checks import overlays
from avatar_trainer.captures.checks.verdict import judge
from avatar_trainer.captures.describe import describe
from avatar_trainer.captures.load import check_pixels, load
from avatar_trainer.film.judge import judge_film


def check(
    capture: Annotated[Path, typer.Argument(help="Folder of the captured frames.")],
    pictures: Annotated[
        Path | None,
        typer.Option(
            help="Folder to write: images with mesh and mask drawn over them, and all on one sheet.",
            metavar="OUT",
        ),
    ] = None,
) -> None:
    """Read a whole capture, say what is in it, and find what does not fit: cameras, units, poses, masks.

    Of a capture that was made from a film, also what was wrong with the film.
    """
    with console.Steps() as step:
        if pictures is not None:
            overlays.expect_place(pictures)
        step("reading")
        scene = load(capture)
        step("decoding images")
        check_pixels(scene)
        if pictures is not None:
            step("drawing overlays")
            count = overlays.write(scene, pictures)
        step("comparing mesh and images")
        verdict = judge(scene)
        step("looking at the film")
        notes = judge_film(scene.folder)
    for line in describe(scene):
        console.output.print(line)
    if pictures is not None:
        console.output.print(f"{pictures}: {count} overlays, together in {overlays.SHEET}")
    console.tell(notes)
    for text in verdict.odd:
        console.messages.print(f"warning: {text}")
    verdict.refuse(scene)
