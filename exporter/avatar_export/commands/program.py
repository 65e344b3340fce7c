"""Shared by the project's command lines: the option --version, and the handling of errors.

Readers, operations and writers are used by many commands and know no command line. What they advise is completed here
where it names options that the command lacks, from what the commands declare.
"""

from __future__ import annotations

import io
import re
import sys
from collections.abc import Iterator, Sequence
from functools import cache
from typing import Annotated, Any, NoReturn

import typer

from avatar_export.batch.locations import cleaned
from avatar_export.commands.process import LITTLE_MEMORY, ending_by_signals
from avatar_export.version import GENERATOR
from avatar_runtime.io.errors import AvatarError, MemoryShortage, printable

OPTION = re.compile(r"(?<![\w-])--[a-z][a-z0-9]*(?:-[a-z0-9]+)*")
NAMES_ONE = re.compile(r"`(avatar-export )?(pack|convert)\b|\bconvert it\b")
FIRST = ("pack", "convert")  # commands that prepare what others play
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


def run(app: typer.Typer, program: str, **others: typer.Typer) -> None:
    """Run `app`: bad data becomes one line and exit code 2, too little memory one line and 3 (see `process`).

    `others` are programs whose commands may be advised, too, by their names with _ for -. Any other exception is a bug
    and shows its traceback.
    """
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")
    with ending_by_signals(program):
        try:
            try:
                parser_of(app)()
            finally:
                sys.stdout.flush()
        except (MemoryError, MemoryShortage) as error:
            _fail(program, str(error) or "memory ran out", LITTLE_MEMORY)
        except (AvatarError, OSError, UnicodeError) as error:
            parsers = [(program, parser_of(app))]
            parsers += [(name.replace("_", "-"), parser_of(other)) for name, other in others.items()]
            # The last two: names that this system cannot represent.
            _fail(program, advised(str(error), parsers, sys.argv[1:]), 2)


def _fail(program: str, text: str, code: int) -> NoReturn:
    """Prints one line and ends the program."""
    shown = printable(" ".join(cleaned(text).split()).encode("utf-8", "backslashreplace").decode())
    print(f"{program}: {shown}", file=sys.stderr)
    sys.exit(code)


def advised(text: str, parsers: Sequence[tuple[str, Any]], words: Sequence[str]) -> str:
    """`text`, and a command that has the options in it if the one in `words` lacks them.

    `parsers` are (program, its parser), that of `words` first. A text that names such a command already stays.
    """
    name, command = _asked(parsers[0][1], words)
    named = dict.fromkeys(OPTION.findall(text))
    lacking = [option for option in named if option not in _options(command)]
    takers = [taker for taker in _commands(parsers) if set(lacking) <= _options(taker[1])] if lacking else []
    if name is None or not takers or NAMES_ONE.search(text):
        return text
    them = "it" if len(lacking) == 1 else "them"
    return (
        f"{text}; `{name}` has no {', '.join(lacking)}: run `{takers[0][0]}` with {them} first, and give `{name}` "
        "what it writes"
    )


def _asked(parser: Any, words: Sequence[str]) -> tuple[str | None, Any]:
    """The command that the words of a command line ask for, by its name and parser."""
    name = None
    for word in words:
        if word in getattr(parser, "commands", {}):
            name, parser = word, parser.commands[word]
    return name, parser


def _commands(parsers: Sequence[tuple[str, Any]]) -> Iterator[tuple[str, Any]]:
    """(program and name, parser) of every command, those of FIRST first."""
    every = [(program, name, own) for program, parser in parsers for name, own in parser.commands.items()]
    for program, name, own in sorted(
        every, key=lambda one: FIRST.index(one[1]) if one[1] in FIRST else len(FIRST)
    ):
        yield f"{program} {name}", own


def _options(command: Any) -> set[str]:
    return {option for parameter in command.params for option in (*parameter.opts, *parameter.secondary_opts)}
