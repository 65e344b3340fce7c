"""Shared by the project's command lines: the option --version, and the handling of errors."""

from __future__ import annotations

import io
import sys
from typing import Annotated

import typer

from avatar_export.commands.console import clean
from avatar_export.version import GENERATOR
from avatar_runtime.io.errors import AvatarError


def _version(show: bool) -> None:
    if show:
        print(GENERATOR)
        raise typer.Exit


def root(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Show the version.")
    ] = False,
) -> None:
    """The options before every command."""


def run(app: typer.Typer, program: str) -> None:
    """Run `app`: bad data becomes one line and exit code 2; any other exception is a bug and shows its traceback."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")
    try:
        app()
    except (
        AvatarError,
        OSError,
        UnicodeError,
    ) as error:  # the last two: names that this system cannot represent
        text = clean(" ".join(str(error).split()).encode("utf-8", "backslashreplace").decode())
        print(f"{program}: {text}", file=sys.stderr)
        sys.exit(2)
