"""The command line: convert, inspect, validate, conform, render, pose, systems."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from avatar_export.checks.bundle import validate as validate_bundle
from avatar_export.commands import arguments, program
from avatar_export.commands.conform import conform
from avatar_export.commands.console import Steps, facts_table, output, print_json
from avatar_export.commands.convert import convert
from avatar_export.commands.pose import pose
from avatar_export.commands.render import render
from avatar_export.commands.summary import inspect as inspect_avatar
from avatar_export.readers.table import READERS, expect_bundle
from avatar_runtime.bundle import handedness, opener, read_manifest

app = typer.Typer(
    help=f"Turns trained avatars ({', '.join(r.system for r in READERS)}) into portable bundles, and plays them.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
)

app.command()(convert)


@app.command()
def inspect(
    path: Annotated[Path, typer.Argument(help="A bundle, or a trained avatar.")],
    system: arguments.System = None,
    as_json: arguments.AsJson = False,
) -> None:
    """Show what is in a bundle or a trained avatar."""
    with Steps() as step:
        step("reading")
        facts = inspect_avatar(path, system)
    if as_json:
        print_json(facts)
        return
    output.print(facts_table(facts))


@app.command()
def validate(
    bundle: Annotated[Path, typer.Argument(help="A bundle folder or .avatar.zip.")],
    as_json: arguments.AsJson = False,
) -> None:
    """Check every file of a bundle; exit code 1 if anything is wrong."""
    with Steps() as step:
        step("checking")
        expect_bundle(bundle)
        problems = validate_bundle(bundle)
    errors = [p for p in problems if not p.warning]
    if as_json:
        print_json([{"path": p.path, "message": p.message, "warning": p.warning} for p in problems])
    else:
        for problem in problems:
            output.print(f"{'warning' if problem.warning else 'error'}: {problem}")
        if not errors:
            left = handedness(read_manifest(opener(bundle))) == "left"
            output.print(f"{bundle}: sound{', left-handed' if left else ''}")
    raise typer.Exit(1 if errors else 0)


app.command()(conform)
app.command()(render)
app.command()(pose)


@app.command()
def systems(as_json: arguments.AsJson = False) -> None:
    """List the systems whose avatars can be read, and from which files."""
    if as_json:
        print_json([{"system": r.system, "about": r.about, "files": list(r.files)} for r in READERS])
        return
    for reader in READERS:
        output.print(f"{reader.system}  {reader.about}", style="bold")
        for line in reader.files:
            output.print(f"    {line}")


app.callback(help=app.info.help)(program.root)


def main() -> None:
    """Entry point."""
    program.run(app, "avatar-export")
