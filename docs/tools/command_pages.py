"""One page a command, from its `--help` and the examples of examples.toml, for the site: no file of the checkout.

`python docs/tools/command_pages.py FOLDER` writes them into a folder, to read them without the site.
"""

from __future__ import annotations

import contextlib
import io
import os
import re
import runpy
import sys
import tomllib
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

from engine_tables import table

HERE = Path(__file__).resolve().parent
FOLDER = "reference/commands"  # in the site
MODULES = {"avatar-export": "avatar_export", "avatar-train": "avatar_trainer"}
# What typer's versions call the same kinds of value.
KINDS = {
    "path": "PATH",
    "float": "NUMBER",
    "int": "NUMBER",
    "integer": "NUMBER",
    "str": "TEXT",
    "text": "TEXT",
}


@dataclass
class Help:
    """What `--help` says: the text, and (term, help) rows by section, as Options and Commands."""

    text: str
    sections: dict[str, list[tuple[str, str]]] = field(default_factory=dict)


def pages() -> dict[str, str]:
    """{path below FOLDER: text} of the list of commands, and of the page of each, in the order of the help."""
    commands = [command for program in MODULES for command in leaves(program)]
    return {"index.md": index(commands)} | {page_of(command): page(command) for command in commands}


def leaves(command: str) -> list[str]:
    """The commands below a program or a group that are no groups themselves, in the order of its help."""
    below = help_of(command).sections.get("Commands")
    if below is None:
        return [command]
    return [leaf for name, _ in below for leaf in leaves(f"{command} {name}")]


_HELP: dict[str, Help] = {}


def help_of(command: str) -> Help:
    """The parsed `--help` of a command, run in this process: importing the trainer takes seconds.

    Raises ValueError where the command cannot run: avatar-train needs torch.
    """
    if command not in _HELP:
        program, *rest = command.split()
        arguments, said = sys.argv, io.StringIO()
        sys.argv = [program, *rest, "--help"]
        try:
            with contextlib.redirect_stdout(said), plain_terminal():
                runpy.run_module(MODULES[program], run_name="__main__", alter_sys=True)
        except SystemExit as end:
            if end.code:
                raise ValueError(
                    f"{command} --help ends with {end.code}, so its page cannot be made"
                ) from end
        finally:
            sys.argv = arguments
        _HELP[command] = parse(said.getvalue())
    return _HELP[command]


@contextlib.contextmanager
def plain_terminal() -> Iterator[None]:
    """An environment in which widths, colours and styles of the terminal make no difference."""
    before = dict(os.environ)
    os.environ.update({"COLUMNS": "80", "TERM": "dumb", "NO_COLOR": "1"})
    os.environ.pop("FORCE_COLOR", None)
    try:
        yield
    finally:
        os.environ.clear()
        os.environ.update(before)


def parse(text: str) -> Help:
    """Help text into prose and definition rows."""
    found, section, prose = Help(""), "", list[str]()
    for line in text.splitlines():
        if heading := re.match(r"(\w+):$", line):
            section = heading[1]
            found.sections[section] = []
        elif not section:
            if not line.startswith("Usage:"):
                prose.append(line.strip())
        elif row := re.match(r"  (\S.*?)(?:\s{2,}(\S.*))?$", line):
            found.sections[section].append((row[1], row[2] or ""))
        elif line.strip():
            term, said = found.sections[section][-1]
            found.sections[section][-1] = (term, f"{said} {line.strip()}".strip())
    found.text = " ".join(prose).strip()
    return found


def page_of(command: str) -> str:
    """Where a command's page is, below FOLDER."""
    program, *rest = command.split()
    return f"{program}/{'_'.join(rest)}.md"


def page(command: str) -> str:
    """The whole page of a command."""
    said, sections = help_of(command).text, help_of(command).sections
    lines = [f"# {command}\n", f"{said}\n", "## Examples\n"]
    for example in examples().get(command, []):
        mark = (
            f"*Not run by the tests: {example['not_run']}.*"
            if "not_run" in example
            else "*Run by the tests.*"
        )
        lines.append(f"{example['about']} {mark}\n\n```sh\n{example['run'].strip()}\n```\n")
    for name in ("Arguments", "Options"):
        rows = [option_row(term, text) for term, text in sections.get(name, []) if term != "--help"]
        if rows:
            lines.append(f"## {name}\n\n{table(['', 'what it is', 'values'], rows)}\n")
    return "\n".join(lines)


def option_row(term: str, text: str) -> list[str]:
    """Names, meaning, and values: kind, default, limits."""
    names, _, kind = (
        re.sub(r"<(.*?)>", lambda m: m[1], term).partition(" ")
        if not term.startswith("-")
        else split_names(term)
    )
    notes = re.search(r"\s*\[([^\[\]]*(?:required|default: [^\[\]]*|<=?x|x>=?)[^\[\]]*)\]$", text)
    meaning = text[: notes.start()] if notes else text
    values = [plain_kind(kind)] if kind else []
    values += [part.strip() for part in notes[1].split(";")] if notes else []
    return [f"`{names}`", escape(meaning), escape(", ".join(values))]


def split_names(term: str) -> tuple[str, str, str]:
    """`-o, --out <path>` into its names and its kind."""
    found = re.match(r"((?:-[\w-]+(?:, | / )?)+)\s*(.*)$", term)
    assert found, term
    return found[1].strip().replace(", ", "`, `").replace(" / ", "`, `"), " ", found[2]


def plain_kind(kind: str) -> str:
    """A kind of value in one spelling, whatever typer calls it."""
    bare = re.sub(
        r"^list\[(.*)\]$", r"\1", kind.strip("<>").lower().removesuffix(" range").removesuffix("...")
    )
    return KINDS.get(bare, kind.strip("<>"))


def escape(text: str) -> str:
    """Text in a Markdown table."""
    return re.sub(r"(?<![\w`])([|<*])", r"\\\1", text)


def examples() -> dict[str, list[dict[str, str]]]:
    """Command: its examples, in order."""
    found: dict[str, list[dict[str, str]]] = {}
    for example in tomllib.loads((HERE / "examples.toml").read_text("utf-8"))["example"]:
        found.setdefault(example["command"], []).append(example)
    return found


def index(commands: list[str]) -> str:
    """The list of all commands."""
    lines = ["# Commands\n"]
    lines.append(
        "Every command takes `--help`. Bad data ends with one line and exit code 2; "
        "[SECURITY.md](../../../SECURITY.md) lists all exit codes.\n"
    )
    for program in MODULES:
        rows = [
            [
                f"[`{command}`]({page_of(command)})",
                escape(first_sentence(command)),
            ]
            for command in commands
            if command.split()[0] == program
        ]
        lines.append(
            f"## {program}\n\n{help_of(program).text}\n\n{table(['command', 'what it does'], rows)}\n"
        )
    return "\n".join(lines)


def first_sentence(command: str) -> str:
    """What a command does, in short."""
    return re.split(r"(?<=\.)\s|;", help_of(command).text)[0].rstrip(".") + "."


def main(folder: Path) -> None:
    """Writes the pages."""
    for name, text in pages().items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(text, "utf-8")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
