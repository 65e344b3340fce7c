"""The steps of `make`, one after the other; memory goes back to the system between them."""

from __future__ import annotations

import importlib.util
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

from avatar_export.making import child
from avatar_export.making.progress import alone, open_progress
from avatar_export.making.steps import Plan, Step
from avatar_runtime.io.errors import AvatarError
from avatar_schema.extras import how_to_install

NEEDED = {  # module: what pip calls it
    "torch": "torch",
    "tensorboard": "tensorboard",
    "numba": "numba",
    "mediapipe": "mediapipe",
    "cv2": "opencv",
}
GRACE = 20.0  # seconds for a step to end by itself
Say = Callable[[str], None]


class StepFailed(Exception):
    """A step ended with this exit code, and has said why."""

    def __init__(self, code: int) -> None:
        super().__init__(code)
        self.code = code


def expect_libraries() -> None:
    """Raise AvatarError, with the line that installs them, if libraries of the extra [video] are missing."""
    missing = [name for module, name in NEEDED.items() if importlib.util.find_spec(module) is None]
    if missing:
        raise AvatarError(f"needs {', '.join(missing)}: {how_to_install('video')}", field="make")


def make(given: Plan, into: Path | None, *, force: bool, say: Say) -> Plan:
    """All steps that have not ended yet; `say` gets a line for each. Returns the plan, filled.

    Raises AvatarError as `open_progress` and `alone`, and for a step that was killed; StepFailed for one that failed.
    """
    with alone(given.out) as lock:
        progress = open_progress(given, force)
        plan = progress.plan
        steps = plan.steps()
        count = len(steps) + (into is not None)
        try:
            for number, step in enumerate(steps, 1):
                if progress.has(step):
                    say(f"{number} of {count}  {step.name}: done before")
                    continue
                say(f"{number} of {count}  {step.name}: {step.about}")
                progress.forget([step], removed=[step.name] if step.anew else [])
                _run(step, lock, also=2 if plan.accept_misfit and step.name == "check" else 0)
                progress.end(step)
            if into is not None:
                step = plan.drop(into)
                say(f"{count} of {count}  {step.name}: {step.about}")
                _run(step, lock)
        finally:
            progress.leave()
    return plan


def _run(step: Step, lock: int | None, also: int = 0) -> None:
    """The program of a step. Exit code 1 says that it is done and something was found; `also`: another that is good."""
    command = [sys.executable, "-m", child.__name__, step.module, *step.words]
    inherited = () if lock is None else (lock,)
    with subprocess.Popen(command, stdin=subprocess.PIPE, pass_fds=inherited) as process:
        try:
            code = process.wait()
        except BaseException:
            _end(process)
            raise
    if code < 0:
        raise AvatarError(
            f"was ended by signal {-code}, by lack of memory perhaps; the same command goes on",
            field=step.name,
        )
    if code not in (0, also):
        raise StepFailed(code)


def _end(process: subprocess.Popen[bytes]) -> None:
    """Ends a step: first its pipe is closed, at which it ends by itself."""
    assert process.stdin is not None
    process.stdin.close()
    try:
        process.wait(GRACE)
    except subprocess.TimeoutExpired:
        process.kill()
