"""`avatar-train SYSTEM CAPTURE -o OUT`: from captured frames to an avatar."""

from __future__ import annotations

import dataclasses
import importlib.util
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Annotated

import typer

from avatar_export.commands import arguments
from avatar_export.commands.console import Steps, output
from avatar_runtime.io.errors import AvatarError, no_such
from avatar_trainer import checkpoint, run
from avatar_trainer.capture import Capture, check_pixels, load
from avatar_trainer.drawing import Drawing
from avatar_trainer.evaluate import evaluate, table
from avatar_trainer.finished import save_upstream
from avatar_trainer.machine import disk_advice, memory_advice
from avatar_trainer.pictures import resized
from avatar_trainer.places import expect_bundle_place, expect_run_folder
from avatar_trainer.renderer import RASTERISERS, expect_rasteriser
from avatar_trainer.settings import Rule, TrainSettings, chosen_rules, settable, with_values
from avatar_trainer.system import System
from avatar_trainer.systems import system_module
from avatar_trainer.train import train

LPIPS = "lpips"  # a setting and the package that it needs
OFTEN = 1000  # iterations between contact sheets
# settings that have options of their own
OPTIONS = (
    "iterations",
    "gaussians",
    "sh_degree",
    "rules",
    "seed",
    "size",
    "rasteriser",
    "threads",
    "checkpoint_every",
)


def train_command(name: str) -> Callable[..., None]:
    """The command that trains one system."""

    def command(
        capture: Annotated[Path, typer.Argument(help="Folder of the captured frames (trainer/CAPTURE.md).")],
        out: Annotated[
            Path, typer.Option("--out", "-o", help="Folder to write; goes on with what is there.")
        ],
        iterations: Annotated[int | None, typer.Option(help="Pictures to learn from.", min=1)] = None,
        gaussians: Annotated[int | None, typer.Option(help="Gaussians at the start.", min=1)] = None,
        sh_degree: Annotated[int | None, typer.Option(help="Highest SH degree.", min=0, max=3)] = None,
        size: Annotated[int, typer.Option(help="Pixels of the longer side; 0: as captured.", min=0)] = 0,
        seed: Annotated[int, typer.Option(help="Of everything random.", min=0)] = 0,
        threads: Annotated[int, typer.Option(help="0: one a core.", min=0)] = 0,
        rasteriser: Annotated[str, typer.Option(help=", ".join(RASTERISERS))] = "cpu",
        rule: Annotated[list[str] | None, typer.Option(help="NAME=VALUE, see command `rules`.")] = None,
        set_: Annotated[
            list[str] | None,
            typer.Option("--set", help="NAME=VALUE: any other setting, see command `settings`."),
        ] = None,
        preview: Annotated[
            bool, typer.Option("--preview", help="Write contact sheets to OUT/preview.")
        ] = False,
        checkpoint_every: Annotated[int, typer.Option(help="Iterations between checkpoints.", min=1)] = 500,
        resume: Annotated[
            bool, typer.Option(help="Go on from a checkpoint in OUT, or remove what is there.")
        ] = True,
        export: Annotated[
            Path | None, typer.Option(help="Bundle to write at the end.", metavar="BUNDLE")
        ] = None,
        force: Annotated[bool, typer.Option("--force", help="Replace BUNDLE if it exists.")] = False,
    ) -> None:
        arguments.one_of("--rasteriser", rasteriser, RASTERISERS)
        expect_rasteriser(rasteriser)
        module = system_module(name)
        general, special = _told_apart(arguments.pairs(set_), module.Settings())
        given = {"iterations": iterations, "gaussians": gaussians, "sh_degree": sh_degree}
        special += _texts(given)
        own = with_values(module.Settings(), special)
        own = dataclasses.replace(own, rules=chosen_rules(module.RULES, arguments.pairs(rule)))
        options = {
            "iterations": own.iterations, "seed": seed, "rasteriser": rasteriser, "size": size, "threads": threads,
            "checkpoint_every": checkpoint_every,
        }  # fmt: skip
        if preview:
            options = {"preview_every": OFTEN, **options}
        settings = with_values(with_values(TrainSettings(), _texts(options)), general)
        _expect_lpips(own)
        expect_run_folder(out)
        # The same command again: what is there is then the bundle of this run.
        finished = resume and checkpoint.path_of(out / run.CHECKPOINTS, settings.iterations).is_file()
        there = export is not None and export.exists() and finished and not force
        if export is not None:
            _expect_exportable(module.RULES, own.rules)
            expect_bundle_place(export, out, force=force or there)
        scene = _read(capture, out, settings, resume)
        with memory_advice():
            with Steps() as step:
                step("preparing")
                system = module.create(scene, own, seed)
            trained = train(system, scene, settings, out, system_settings=own, resume=resume)
            output.print(
                f"{out}: {trained.iterations} iterations, {trained.gaussians} Gaussians, {trained.seconds:.0f} s"
            )
            result = evaluate(system, scene, Drawing(rasteriser, threads or None))
            with disk_advice(out):
                run.write(out, {"iteration": trained.iterations, **result}, run.EVALUATION)
            output.print(table(result))
            if there:
                output.print(f"{export}: is there already, left as it is; --force replaces it")
            elif export is not None:
                _export(system, out, trained.iterations, export, force)

    command.__doc__ = f"Train an avatar of {name}; the same command goes on where an interrupted one stopped."
    return command


def _told_apart(
    pairs: list[tuple[str, str]], own: object
) -> tuple[list[tuple[str, str]], list[tuple[str, str]]]:
    """What `--set` names, of the run and of the system. Raises AvatarError for what is neither."""
    general, special = settable(TrainSettings(), OPTIONS), settable(own, OPTIONS)
    for name, _ in pairs:
        if name not in general and name not in special:
            raise no_such("setting", name, [*special, *general], field="--set")
    return [p for p in pairs if p[0] not in special], [p for p in pairs if p[0] in special]


def _texts(values: Mapping[str, object]) -> list[tuple[str, str]]:
    """Values that are given, as `with_values` reads them."""
    return [(name, str(value)) for name, value in values.items() if value is not None]


def _expect_lpips(own: object) -> None:
    """Raise AvatarError where a loss is asked for that this machine has no package for."""
    for name, value in settable(own).items():
        if name.rpartition(".")[2] == LPIPS and value and importlib.util.find_spec(LPIPS) is None:
            raise AvatarError(f"needs the package {LPIPS}: pip install {LPIPS}", field=name)


def _expect_exportable(rules: Mapping[str, Rule], chosen: Mapping[str, str]) -> None:
    """Raise AvatarError for a rule by which is trained what no bundle holds."""
    for name, rule in rules.items():
        if chosen[name] in rule.trainer_only:
            raise AvatarError(
                f"{name}={chosen[name]} is for comparison in the trainer alone, no bundle holds it; train without "
                "--export",
                field="--rule",
            )


def _read(folder: Path, out: Path, settings: TrainSettings, resume: bool) -> Capture:
    """The capture, wholly checked before a new run begins."""
    with Steps() as step:
        step("reading")
        scene = load(folder)
        if not (resume and checkpoint.paths(out / run.CHECKPOINTS)):
            step("decoding pictures")
            check_pixels(scene)
    return resized(scene, settings.size)


def _export(system: System, out: Path, iteration: int, bundle: Path, force: bool) -> None:
    from avatar_trainer.export import export

    with Steps() as step:
        step(f"writing {bundle}")
        with disk_advice(out):
            upstream = save_upstream(system, out, iteration)
        export(system, upstream, bundle, force=force)
    output.print(f"{bundle}: written")
