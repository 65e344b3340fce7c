"""`avatar-export inspect`: what is in a bundle or a trained avatar."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from avatar_export import summary
from avatar_export.commands import arguments
from avatar_export.commands.console import Steps, facts_table, output, print_json


def inspect(
    path: Annotated[Path, typer.Argument(help="A bundle, a pack or a trained avatar.")],
    system: arguments.System = None,
    as_json: arguments.AsJson = False,
) -> None:
    """Show what a bundle, a pack or a trained avatar contains."""
    with Steps() as step:
        step("reading")
        facts = summary.inspect(path, system)
    if as_json:
        print_json(facts)
    else:
        output.print(facts_table(facts))
