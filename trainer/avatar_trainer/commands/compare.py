"""`avatar-train compare OUT BUNDLE`."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Annotated

import typer

from avatar_export.commands import arguments, console
from avatar_export.readers import table
from avatar_runtime import load
from avatar_trainer.commands.arguments import Captured, Run
from avatar_trainer.evaluation import compare as comparison
from avatar_trainer.loop.progress import note
from avatar_trainer.loop.resume import load_run


def compare(
    out: Run,
    bundle: Annotated[Path, typer.Argument(help="The bundle that was made of it.")],
    every: Annotated[int, typer.Option(help="Every how many-th frame held out.", min=1)] = 1,
    capture: Captured = None,
    as_json: arguments.AsJson = False,
) -> None:
    """Hold a bundle's images, by every backend, against the model it was made of; exit code 1 if they differ."""
    with console.Steps() as step:
        step("loading")
        system = load_run(out, capture).system
        table.expect_bundle(bundle)
        avatar = load(bundle)
        step("drawing")
        backends, missing = comparison.playable(avatar)
        rows = comparison.compare(system, avatar, every, backends)
    for line in missing:
        note(line)
    if as_json:
        console.print_json([{**dataclasses.asdict(row), "holds": row.holds} for row in rows])
    else:
        console.output.print(comparison.table(rows))
    raise typer.Exit(0 if all(row.holds for row in rows if row.profile == comparison.TRAINED) else 1)
