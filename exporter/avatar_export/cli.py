"""The command line of avatar-export: one row of COMMANDS for each command."""

from __future__ import annotations

from collections.abc import Callable

import typer

from avatar_export.commands import program
from avatar_export.commands.batch import batch
from avatar_export.commands.conform import conform
from avatar_export.commands.convert import convert
from avatar_export.commands.distill import check, distill, poses
from avatar_export.commands.drop import drop
from avatar_export.commands.inspect import inspect, systems
from avatar_export.commands.make import make
from avatar_export.commands.pack import pack
from avatar_export.commands.pose import pose
from avatar_export.commands.publish import publish
from avatar_export.commands.render import render
from avatar_export.commands.validate import validate
from avatar_export.commands.view import view
from avatar_export.readers.table import READERS

COMMANDS: tuple[Callable[..., None], ...] = (
    convert,
    make,
    batch,
    pack,
    view,
    publish,
    drop,
    inspect,
    validate,
    conform,
    render,
    pose,
    poses,
    distill,
    check,
    systems,
)
HELP = f"Convert trained avatars ({', '.join(r.system for r in READERS)}) to portable bundles, and play them."


def make_app() -> typer.Typer:
    """The command line with all COMMANDS."""
    app = typer.Typer(
        no_args_is_help=True, add_completion=False, pretty_exceptions_enable=False, rich_markup_mode=None
    )
    for command in COMMANDS:
        app.command()(command)
    app.callback(help=HELP)(program.root)
    return app


app = make_app()


def main() -> None:
    """Entry point."""
    program.run(app, "avatar-export")
