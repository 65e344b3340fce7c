"""Shared by the project's command lines: the option --version, and the handling of errors."""

from __future__ import annotations

import io
import sys
from functools import cache
from typing import Annotated, NoReturn

import typer

from avatar_export.batch.locations import cleaned
from avatar_export.commands.process import LITTLE_MEMORY, ending_by_signals
from avatar_export.version import GENERATOR
from avatar_runtime.io.errors import AvatarError, MemoryShortage, printable

# Building the parser takes longer than many a command: a process that runs several, as the tests do, builds it once.
parser_of = cache(typer.main.get_command)


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
    """Run `app`: bad data becomes one line and exit code 2, too little memory one line and 3 (see `process`).

    Any other exception is a bug and shows its traceback.
    """
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")
    with ending_by_signals():
        try:
            try:
                parser_of(app)()
            finally:
                sys.stdout.flush()
        except (MemoryError, MemoryShortage) as error:
            _fail(program, str(error) or "memory ran out", LITTLE_MEMORY)
        except (AvatarError, OSError, UnicodeError) as error:
            _fail(program, str(error), 2)  # the last two: names that this system cannot represent


def _fail(program: str, text: str, code: int) -> NoReturn:
    """Prints one line and ends the program."""
    shown = printable(" ".join(cleaned(text).split()).encode("utf-8", "backslashreplace").decode())
    print(f"{program}: {shown}", file=sys.stderr)
    sys.exit(code)
