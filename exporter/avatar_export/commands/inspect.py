"""`avatar-export inspect` and `systems`: what is in a bundle or a trained avatar, and what can be read."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from avatar_export import summary
from avatar_export.commands import arguments
from avatar_export.commands.console import Steps, facts_table, output, print_json
from avatar_export.commands.declared import command
from avatar_export.convert_options import System
from avatar_export.readers.table import READERS


@command
def inspect(
    path: Annotated[Path, typer.Argument(help="A bundle, a pack or a trained avatar.")],
    system: System = None,
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


def systems(as_json: arguments.AsJson = False) -> None:
    """List the systems whose avatars can be read, with the files that each needs."""
    if as_json:
        print_json([{"system": r.system, "about": r.about, "files": list(r.files)} for r in READERS])
        return
    for reader in READERS:
        output.print(f"{reader.system}  {reader.about}", style="bold")
        for line in reader.files:
            output.print(f"    {line}")
