"""The command line: one command to train each system, and check, evaluate, export, compare, rules."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Annotated

import typer

from avatar_export.commands import arguments, program
from avatar_export.commands.console import Steps, facts_table, output, print_json
from avatar_export.readers.table import expect_bundle
from avatar_runtime.bundle import load as load_bundle
from avatar_trainer import run
from avatar_trainer.capture import check_pixels, describe, load
from avatar_trainer.cli_asm import app as asm_app
from avatar_trainer.cli_train import OPTIONS, train_command
from avatar_trainer.drawing import Drawing
from avatar_trainer.evaluate import evaluate, table
from avatar_trainer.finished import load_run, save_upstream
from avatar_trainer.machine import disk_advice, memory_advice
from avatar_trainer.places import expect_bundle_place, expect_run_folder
from avatar_trainer.settings import TrainSettings, settable
from avatar_trainer.systems import SYSTEMS, system_module

app = typer.Typer(
    help=f"Trains animatable avatars made of 3D Gaussians ({', '.join(SYSTEMS)}) from captured frames.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
)
for _name in SYSTEMS:
    app.command(_name)(train_command(_name))
app.add_typer(asm_app, name="asm")

Run = Annotated[Path, typer.Argument(help="Folder that a training wrote.", metavar="OUT")]
Captured = Annotated[
    Path | None, typer.Option("--capture", help="Where the capture is now, if it was moved.")
]


@app.command()
def check(capture: Annotated[Path, typer.Argument(help="Folder of the captured frames.")]) -> None:
    """Read a whole capture, pictures too, and say what is in it."""
    with Steps() as step:
        step("reading")
        scene = load(capture)
        step("decoding pictures")
        check_pixels(scene)
    output.print(describe(scene))


@app.command("evaluate")
def evaluate_command(out: Run, capture: Captured = None, as_json: arguments.AsJson = False) -> None:
    """Measure a run's newest checkpoint on the frames held out, PSNR and SSIM; writes OUT/evaluation.json."""
    with Steps() as step, memory_advice():
        step("loading")
        system, settings, iteration = load_run(out, capture)
        step("measuring")
        result = evaluate(system, system.capture, Drawing(settings.rasteriser, settings.threads or None))
        with disk_advice(out):
            run.write(out, {"iteration": iteration, **result}, run.EVALUATION)
    if as_json:
        print_json(result)
        return
    output.print(table(result))


@app.command("export")
def export_command(
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
    from avatar_trainer.export import export

    expect_run_folder(out)
    expect_bundle_place(bundle, None, force=force)
    with Steps() as step, memory_advice():
        step("loading")
        system, _, iteration = load_run(out, capture)
        step(f"writing {bundle}")
        with disk_advice(out):
            upstream = save_upstream(system, out, iteration)
        export(
            system, upstream, bundle, engine_files=not no_engine_files, preview=not no_preview, force=force
        )
    output.print(f"{bundle}: written from iteration {iteration}")


@app.command("compare")
def compare_command(
    out: Run,
    bundle: Annotated[Path, typer.Argument(help="The bundle that was made of it.")],
    every: Annotated[int, typer.Option(help="Every how many-th frame held out.", min=1)] = 1,
    capture: Captured = None,
    as_json: arguments.AsJson = False,
) -> None:
    """Hold a bundle's pictures, by every backend, against the model it was made of; exit code 1 if they differ."""
    from avatar_trainer import compare

    with Steps() as step:
        step("loading")
        system, _, _ = load_run(out, capture)
        expect_bundle(bundle)
        avatar = load_bundle(bundle)
        step("drawing")
        rows = compare.compare(system, avatar, every)
    if as_json:
        print_json([{**dataclasses.asdict(row), "holds": row.holds} for row in rows])
    else:
        output.print(compare.table(rows))
    raise typer.Exit(0 if all(row.holds for row in rows if row.profile == compare.TRAINED) else 1)


@app.command()
def rules(as_json: arguments.AsJson = False) -> None:
    """List the rules of each system: in what paper and released code differ, and what is taken."""
    found = {name: system_module(name).RULES for name in SYSTEMS}
    if as_json:
        print_json({name: {k: dataclasses.asdict(v) for k, v in own.items()} for name, own in found.items()})
        return
    for name, own in found.items():
        output.print(name, style="bold")
        for rule, facts in own.items():
            output.print(f"  {rule} = {' | '.join(facts.values)}: {facts.about}")
            output.print(
                f"      paper {facts.paper}, released code {facts.released}, default {facts.default}"
            )


@app.command()
def settings(
    system: Annotated[str, typer.Argument(help=", ".join(SYSTEMS))], as_json: arguments.AsJson = False
) -> None:
    """List what `--set` takes for a system, with the defaults."""
    arguments.one_of("system", system, SYSTEMS)
    found = {**settable(system_module(system).Settings(), OPTIONS), **settable(TrainSettings(), OPTIONS)}
    if as_json:
        print_json(found)
        return
    output.print(facts_table(found))


app.callback(help=app.info.help)(program.root)


def main() -> None:
    """Entry point."""
    program.run(app, "avatar-train")
