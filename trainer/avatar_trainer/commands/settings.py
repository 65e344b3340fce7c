"""`avatar-train settings SYSTEM`."""

from __future__ import annotations

from typing import Annotated

import typer

from avatar_export.commands import arguments, console
from avatar_trainer.commands.train import OPTIONS
from avatar_trainer.settings import TrainSettings, settable
from avatar_trainer.systems.table import SYSTEMS, system_module


def settings(
    system: Annotated[str, typer.Argument(help=", ".join(SYSTEMS))], as_json: arguments.AsJson = False
) -> None:
    """List what `--set` takes for a system, with the defaults."""
    arguments.one_of("system", system, SYSTEMS)
    found = {**settable(system_module(system).Settings(), OPTIONS), **settable(TrainSettings(), OPTIONS)}
    if as_json:
        console.print_json(found)
        return
    console.output.print(console.facts_table(found))
