"""From checkpoints back to systems, and on to the released code's layout."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any, NamedTuple

from avatar_runtime import AvatarError
from avatar_trainer.captures.load import load
from avatar_trainer.captures.targets import resized
from avatar_trainer.loop import checkpoint, run
from avatar_trainer.loop.progress import note
from avatar_trainer.loop.refine import Refinement
from avatar_trainer.settings import TrainSettings
from avatar_trainer.systems.protocol import System
from avatar_trainer.systems.table import system_module


class Loaded(NamedTuple):
    """A run as it was left; the system's capture has the refined poses."""

    system: System
    settings: TrainSettings
    iteration: int
    refinement: Refinement | None  # None: poses stayed as they were tracked


def load_run(out: Path, capture: Path | None = None) -> Loaded:
    """The newest whole checkpoint of `out`.

    capture: its present folder, if it was moved. Raises AvatarError for a folder without a run, and if run.json,
    checkpoint and capture do not belong together, since that would play another model.
    """
    content = run.read(out)
    settings, system_settings = run.settings_of(content, out / run.FILE)
    folder = Path(str(content["capture"].get("folder"))) if capture is None else capture
    if not folder.is_dir():
        raise AvatarError(
            "the capture of this run is not a folder any more; say where with --capture", file=folder
        )
    found = checkpoint.newest(out / run.CHECKPOINTS, note)
    if found is None:
        raise AvatarError("has no checkpoint yet", file=out)
    different = run.differences(found.state.get("run"), content, found.iteration, settings.iterations)
    if different:
        raise AvatarError(
            f"differs from its checkpoint ({'; '.join(different[:4])}); undo what was changed, or train anew",
            file=out / run.FILE,
        )
    scene = resized(load(folder), settings.size)
    if run.fingerprint(scene) != run.fingerprint_of(content):
        trained_on = run.short(content["capture"].get("folder"))
        raise AvatarError(
            f"is not the capture that {out} was trained on, which was in {trained_on}: poses, body model or images "
            "are others; name that one with --capture, or train again on this one",
            file=folder,
        )
    system = system_module(content["system"]).create(scene, system_settings, settings.seed)
    load_system(system, found.state)
    refinement = None
    if run.refines(settings, scene):
        refinement = Refinement(scene, settings.iterations)
        refinement.load_state(found.state.get("refinement"))
        system.capture = refinement.present()
    return Loaded(system, settings, found.iteration, refinement)


def load_system(system: System, state: dict[str, Any]) -> None:
    """Let `system` continue from a checkpoint's state. Raises AvatarError for one that does not fit it."""
    try:
        system.load_state(state["system"])
    except (KeyError, ValueError, TypeError, RuntimeError, IndexError, AttributeError) as error:
        raise AvatarError(f"the checkpoint does not fit {system.name} on this capture ({error})") from None


def save_upstream(system: System, out: Path, iteration: int) -> Path:
    """Write the released code's layout into `out`, replacing that of an earlier run as a whole; returns its folder."""
    partial, folder = out / f".{run.UPSTREAM}.partial", out / run.UPSTREAM
    shutil.rmtree(partial, ignore_errors=True)
    partial.mkdir(parents=True)
    try:
        system.save(partial, iteration)
    except BaseException:
        shutil.rmtree(partial, ignore_errors=True)
        raise
    shutil.rmtree(folder, ignore_errors=True)
    partial.replace(folder)
    return folder
