"""`avatar-export systems`: what can be read."""

from __future__ import annotations

from avatar_export.commands import arguments
from avatar_export.commands.console import output, print_json
from avatar_export.readers.table import READERS


def systems(as_json: arguments.AsJson = False) -> None:
    """List the systems whose avatars can be read, with the files that each needs."""
    if as_json:
        print_json([{"system": r.system, "about": r.about, "files": list(r.files)} for r in READERS])
        return
    for reader in READERS:
        output.print(f"{reader.system}  {reader.about}", style="bold")
        for line in reader.files:
            output.print(f"    {line}")
