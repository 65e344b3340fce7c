"""`avatar-train export OUT BUNDLE`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from avatar_export.commands import arguments, console
from avatar_trainer.commands.arguments import Captured, Run
from avatar_trainer.commands.places import expect_bundle_place, expect_run_folder
from avatar_trainer.loop.machine import disk_advice, memory_advice
from avatar_trainer.loop.resume import load_run, save_upstream


def export(
    out: Run,
    bundle: Annotated[Path, typer.Argument(help="Bundle folder to write, or FILE.avatar.zip.")],
    capture: Captured = None,
    no_engine_files: Annotated[
        bool, typer.Option("--no-engine-files", help="Write no glTF, USD and JSON.")
    ] = False,
    no_preview: Annotated[bool, typer.Option("--no-preview", help="Do not draw preview.png.")] = False,
    force: arguments.Force = False,
) -> None:
    """Write the bundle of a run's newest checkpoint."""
    from avatar_trainer.bundles.export import export

    expect_run_folder(out)
    expect_bundle_place(bundle, None, force=force)
    with console.Steps() as step, memory_advice():
        step("loading")
        system, _, iteration, _ = load_run(out, capture)
        step(f"writing {bundle}")
        with disk_advice(out):  # a run that was interrupted has no OUT/upstream, or an older one
            upstream = save_upstream(system, out, iteration)
        export(
            system, upstream, bundle, engine_files=not no_engine_files, preview=not no_preview, force=force
        )
    console.output.print(f"{bundle}: written from iteration {iteration}")
