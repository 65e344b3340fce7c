"""`avatar-export validate`: every problem of a bundle or a pack."""

from __future__ import annotations

from pathlib import Path

import typer

from avatar_export.checks import bundle as checks
from avatar_export.checks.pack import validate_pack
from avatar_export.commands import arguments
from avatar_export.commands.console import Steps, output, print_json
from avatar_export.readers.table import expect_bundle
from avatar_runtime.bundle import handedness, opener, read_manifest
from avatar_runtime.packs import is_pack, read_pack


def validate(bundle: arguments.Bundle, as_json: arguments.AsJson = False) -> None:
    """Check every file of a bundle, or a pack. The exit code is 1 if there is an error."""
    with Steps() as step:
        step("checking")
        expect_bundle(bundle)
        problems = validate_pack(bundle) if is_pack(bundle) else checks.validate(bundle)
    errors = [p for p in problems if not p.warning]
    if as_json:
        print_json([{"path": p.path, "message": p.message, "warning": p.warning} for p in problems])
    else:
        for problem in problems:
            output.print(f"{'warning' if problem.warning else 'error'}: {problem}")
        if not errors:
            left = _handedness(bundle) == "left"
            output.print(f"{bundle}: sound{', left-handed' if left else ''}")
    raise typer.Exit(1 if errors else 0)


def _handedness(path: Path) -> str:
    document = read_pack(path).document["avatar"] if is_pack(path) else read_manifest(opener(path))
    return handedness(document)
