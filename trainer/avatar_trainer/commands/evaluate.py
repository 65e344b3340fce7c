"""`avatar-train evaluate OUT`."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any

import typer

from avatar_export.commands import arguments, console
from avatar_export.readers import bundle as bundles
from avatar_export.readers import table
from avatar_runtime import AvatarError
from avatar_runtime import load as load_bundle
from avatar_runtime.backends import BACKENDS
from avatar_trainer.captures.load import check_pixels, load
from avatar_trainer.captures.model import Capture
from avatar_trainer.evaluation import evaluate as evaluation
from avatar_trainer.evaluation.bundle import evaluate_bundle
from avatar_trainer.evaluation.lpips import SMALLEST, Lpips
from avatar_trainer.loop import run
from avatar_trainer.loop.machine import disk_advice, memory_advice
from avatar_trainer.loop.measure import measure
from avatar_trainer.loop.resume import load_run
from avatar_trainer.systems.drawing import Drawing


def evaluate(
    out: Annotated[
        Path,
        typer.Argument(help="Folder that a training wrote, or any bundle or pack.", metavar="OUT|BUNDLE"),
    ],
    capture: Annotated[
        Path | None,
        typer.Option(
            help="Capture to measure a bundle on; of a run: where its capture is now, if it was moved."
        ),
    ] = None,
    lpips_weights: Annotated[
        Path | None,
        typer.Option(
            help="Weights of LPIPS, a .pth file (docs: training). Without it LPIPS is not measured."
        ),
    ] = None,
    backend: arguments.Backend = None,
    as_json: arguments.AsJson = False,
) -> None:
    """Measure PSNR, SSIM and LPIPS on the frames held out: of a run's newest checkpoint, or of any bundle.

    Of a run it writes OUT/evaluation.json.
    """
    arguments.one_of("--backend", backend, BACKENDS)
    with console.Steps() as step, memory_advice():
        step("loading")
        weights = None if lpips_weights is None else Lpips(lpips_weights)
        of = _of_bundle if bundles.detect(out) else _of_run
        result = of(out, capture, backend, weights, step)
    if as_json:
        console.print_json(result)
        return
    for note in result.get("notes", ()):
        console.messages.print(f"note: {note}")
    console.output.print(evaluation.table(result))
    if weights is None:
        console.messages.print("note: LPIPS is not measured without --lpips-weights")


def _of_run(
    out: Path, capture: Path | None, backend: str | None, weights: Lpips | None, step: Callable[[str], None]
) -> dict[str, Any]:
    if not (out / run.FILE).is_file():
        table.expect_bundle(out)  # a trained avatar that must be converted first
    if backend is not None:
        raise typer.BadParameter("is for bundles; a run is drawn by its rasteriser", param_hint="--backend")
    system, settings, iteration, refinement = load_run(out, capture)
    _expect_large(system.capture, weights)
    step("measuring")
    by = Drawing(settings.rasteriser, settings.threads or None)
    with disk_advice(out):
        return measure(out, iteration, system, refinement, by, weights)


def _of_bundle(
    bundle: Path,
    capture: Path | None,
    backend: str | None,
    weights: Lpips | None,
    step: Callable[[str], None],
) -> dict[str, Any]:
    if capture is None:
        raise typer.BadParameter("is needed to measure a bundle", param_hint="--capture")
    avatar, scene = load_bundle(bundle), load(capture)
    _expect_large(scene, weights)
    step("decoding images")
    check_pixels(scene)
    return evaluate_bundle(avatar, scene, backend, weights, lambda count: step(f"measuring, frame {count}"))


def _expect_large(scene: Capture, weights: Lpips | None) -> None:
    if weights is not None and min(scene.width, scene.height) < SMALLEST[weights.network]:
        least = SMALLEST[weights.network]
        raise AvatarError(
            f"needs images of {least} pixels a side, those of {scene.name} are {scene.width}x{scene.height}",
            field="--lpips-weights",
        )
