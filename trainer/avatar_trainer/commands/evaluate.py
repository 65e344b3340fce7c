"""`avatar-train evaluate OUT`."""

from __future__ import annotations

from avatar_export.commands import arguments
from avatar_export.commands.console import Steps, output, print_json
from avatar_trainer.commands.arguments import Captured, Run
from avatar_trainer.evaluation import evaluate as evaluation
from avatar_trainer.loop import run
from avatar_trainer.loop.machine import disk_advice, memory_advice
from avatar_trainer.loop.resume import load_run
from avatar_trainer.systems.drawing import Drawing


def evaluate(out: Run, capture: Captured = None, as_json: arguments.AsJson = False) -> None:
    """Measure a run's newest checkpoint on the frames held out, PSNR and SSIM; writes OUT/evaluation.json."""
    with Steps() as step, memory_advice():
        step("loading")
        system, settings, iteration = load_run(out, capture)
        step("measuring")
        by = Drawing(settings.rasteriser, settings.threads or None)
        result = evaluation.evaluate(system, system.capture, by)
        with disk_advice(out):
            run.write(out, {"iteration": iteration, **result}, run.EVALUATION)
    if as_json:
        print_json(result)
        return
    output.print(evaluation.table(result))
