"""`avatar-train rules`."""

from __future__ import annotations

import dataclasses

from avatar_export.commands import arguments, console
from avatar_trainer.systems.table import SYSTEMS, system_module


def rules(as_json: arguments.AsJson = False) -> None:
    """List the rules of each system: in what paper and released code differ, and what is taken."""
    found = {name: system_module(name).RULES for name in SYSTEMS}
    if as_json:
        console.print_json(
            {name: {k: dataclasses.asdict(v) for k, v in own.items()} for name, own in found.items()}
        )
        return
    for name, own in found.items():
        console.output.print(name, style="bold")
        for rule, facts in own.items():
            console.output.print(f"  {rule} = {' | '.join(facts.values)}: {facts.about}")
            console.output.print(
                f"      paper {facts.paper}, released code {facts.released}, default {facts.default}"
            )
