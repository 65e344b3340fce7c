"""`avatar-train SYSTEM CAPTURE -o OUT`: from captured frames to an avatar."""

from __future__ import annotations

import importlib.util
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Annotated, Any

import typer

from avatar_export.commands import arguments, console
from avatar_runtime import AvatarError
from avatar_runtime.io import no_such
from avatar_trainer.captures.checks.verdict import judge
from avatar_trainer.captures.load import check_pixels, load
from avatar_trainer.captures.model import Capture
from avatar_trainer.captures.targets import resized
from avatar_trainer.commands.places import expect_bundle_place, expect_run_folder
from avatar_trainer.evaluation.evaluate import table
from avatar_trainer.loop import checkpoint, run
from avatar_trainer.loop.machine import disk_advice, memory_advice
from avatar_trainer.loop.measure import measure
from avatar_trainer.loop.train import Trained, train
from avatar_trainer.raster.renderer import RASTERISERS, expect_rasteriser
from avatar_trainer.settings import REFINE, Rule, TrainSettings, chosen_rules, settable, with_values
from avatar_trainer.systems.drawing import Drawing
from avatar_trainer.systems.protocol import System
from avatar_trainer.systems.table import SystemModule, system_module

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
    "refine",
    "threads",
    "checkpoint_every",
)


def train_command(name: str) -> Callable[..., None]:
    """The command that trains the system `name` of `SYSTEMS`."""

    def command(
        capture: Annotated[Path, typer.Argument(help="Folder of the captured frames (schema/CAPTURE.md).")],
        out: Annotated[
            Path, typer.Option("--out", "-o", help="Folder to write; a run that is there is resumed.")
        ],
        iterations: Annotated[int | None, typer.Option(help="Iterations, one image each.", min=1)] = None,
        gaussians: Annotated[
            int | None,
            typer.Option(
                help="Gaussians at the start; of gaussian_blendshapes those on the face, beside mouth_gaussians in "
                "each set of teeth.",
                min=1,
            ),
        ] = None,
        sh_degree: Annotated[int | None, typer.Option(help="Highest SH degree.", min=0, max=3)] = None,
        size: Annotated[int, typer.Option(help="Pixels of the longer side; 0: as captured.", min=0)] = 0,
        seed: Annotated[int, typer.Option(help="Seed of all random numbers.", min=0)] = 0,
        refine: Annotated[
            str,
            typer.Option(
                help="Refine tracked poses and expressions: auto (where `poses` are estimated), on, off."
            ),
        ] = "auto",
        threads: Annotated[int, typer.Option(help="Threads; 0: one per core.", min=0)] = 0,
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
            bool, typer.Option(help="Resume from a checkpoint in OUT, or remove what is there.")
        ] = True,
        export: Annotated[
            Path | None, typer.Option(help="Bundle to write at the end.", metavar="BUNDLE")
        ] = None,
        force: Annotated[bool, typer.Option("--force", help="Replace BUNDLE if it exists.")] = False,
        accept_misfit: Annotated[
            bool, typer.Option("--accept-misfit", help="Train on a capture that `check` refuses.")
        ] = False,
    ) -> None:
        arguments.one_of("--rasteriser", rasteriser, RASTERISERS)
        arguments.one_of("--refine", refine, REFINE)
        expect_rasteriser(rasteriser)
        module = system_module(name)
        of_system = {"iterations": iterations, "gaussians": gaussians, "sh_degree": sh_degree}
        of_run = {
            "seed": seed, "rasteriser": rasteriser, "size": size, "refine": refine, "threads": threads,
            "checkpoint_every": checkpoint_every, "preview_every": OFTEN if preview else None,
        }  # fmt: skip
        own, settings = _settings(
            module, arguments.pairs(set_, "--set"), arguments.pairs(rule, "--rule"), of_system, of_run
        )
        expect_run_folder(out)
        # The same command again: the existing bundle is then that of this run.
        finished = resume and checkpoint.path_of(out / run.CHECKPOINTS, settings.iterations).is_file()
        there = export is not None and export.exists() and finished and not force
        if export is not None:
            _expect_exportable(module.RULES, own.rules)
            expect_bundle_place(export, out, force=force or there)
        scene = _read(capture, out, settings, resume, accept_misfit)
        with memory_advice():
            with console.Steps() as step:
                step("preparing")
                system = module.create(scene, own, seed)
            trained = train(system, scene, settings, out, system_settings=own, resume=resume)
            console.output.print(
                f"{out}: {trained.iterations} iterations, {trained.gaussians} Gaussians, {trained.seconds:.0f} s"
            )
            _evaluate(system, out, trained, Drawing(rasteriser, threads or None))
            if there:
                console.output.print(f"{export}: exists already and is kept; --force replaces it")
            elif export is not None:
                _export(system, trained, export, force)

    command.__doc__ = f"Train an avatar of {name}; the same command resumes an interrupted run."
    return command


def _settings(
    module: SystemModule,
    pairs: list[tuple[str, str]],
    rules: list[tuple[str, str]],
    of_system: Mapping[str, object],
    of_run: Mapping[str, object],
) -> tuple[Any, TrainSettings]:
    """(the system's settings, the run's) from `--set` and `--rule` texts, and from options; None: not given.

    Raises AvatarError for a name or a value that neither takes, and for a loss whose package is not installed.
    """
    general, special = settable(TrainSettings(), OPTIONS), settable(module.Settings(), OPTIONS)
    for name, _ in pairs:
        if name not in general and name not in special:
            raise no_such("setting", name, [*special, *general], field="--set")
    chosen = {"rules": chosen_rules(module.RULES, rules)}
    own = with_values(module.Settings(), [p for p in pairs if p[0] in special], {**of_system, **chosen})
    given = {**of_run, "iterations": own.iterations}
    settings = with_values(TrainSettings(), [p for p in pairs if p[0] not in special], given)
    _expect_lpips(own)
    return own, settings


def _expect_lpips(own: object) -> None:
    for name, value in settable(own).items():
        if name.rpartition(".")[2] == LPIPS and value and importlib.util.find_spec(LPIPS) is None:
            raise AvatarError(f"needs the package {LPIPS}: pip install {LPIPS}", field=name)


def _expect_exportable(rules: Mapping[str, Rule], chosen: Mapping[str, str]) -> None:
    """Raise AvatarError for a rule whose result no bundle can hold."""
    for name, rule in rules.items():
        if chosen[name] in rule.trainer_only:
            raise AvatarError(
                f"{name}={chosen[name]} is for comparison in the trainer alone, no bundle holds it; train without "
                "--export",
                field="--rule",
            )


def _read(folder: Path, out: Path, settings: TrainSettings, resume: bool, accept_misfit: bool) -> Capture:
    """The capture; everything is checked before a new run begins, as `check` does."""
    with console.Steps() as step:
        step("reading")
        scene = load(folder)
        if not (resume and checkpoint.paths(out / run.CHECKPOINTS)):
            step("decoding images")
            check_pixels(scene)
            if not accept_misfit:
                step("comparing mesh and images")
                judge(scene).refuse(scene)
    return resized(scene, settings.size)


def _evaluate(system: System, out: Path, trained: Trained, by: Drawing) -> None:
    with console.Steps() as step, disk_advice(out):
        step("measuring")
        result = measure(out, trained.iterations, system, trained.refinement, by)
    console.output.print(table(result))


def _export(system: System, trained: Trained, bundle: Path, force: bool) -> None:
    from avatar_trainer.bundles.export import export

    if trained.upstream is None:
        raise AvatarError(
            "is not written: the released layout cannot hold what was trained (see the note above)",
            file=bundle,
        )
    with console.Steps() as step:
        step(f"writing {bundle}")
        export(system, trained.upstream, bundle, force=force)
    console.output.print(f"{bundle}: written")
