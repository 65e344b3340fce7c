"""Output of the command lines: progress on a terminal, tables, JSON.

Names come from files of others, so everything is cleaned before it reaches a terminal: see `clean`.
"""

from __future__ import annotations

import json
import re
import sys
import threading
import time
from collections.abc import Callable, Iterable
from contextlib import suppress
from typing import Any

from rich.console import Console
from rich.progress import Progress, SpinnerColumn, TextColumn, TimeElapsedColumn
from rich.table import Table

from avatar_export.notes.note import Note
from avatar_export.notes.text import text
from avatar_runtime.io.errors import printable

SECONDS = 10.0  # between two lines of progress where there is no terminal


class CleanConsole(Console):
    """A console that prints every text cleaned; tables are made of cleaned texts."""

    def print(self, *objects: Any, **options: Any) -> None:
        """As rich's, one line for each text."""
        super().print(*(printable(one) if isinstance(one, str) else one for one in objects), **options)


messages = CleanConsole(stderr=True, highlight=False, markup=False, soft_wrap=True)
output = CleanConsole(highlight=False, markup=False, soft_wrap=not sys.stdout.isatty())


def tell(notes: Iterable[Note]) -> None:
    """A line for each note, warnings first, on standard error."""
    for note in sorted(notes, key=lambda one: not one.doubtful):
        messages.print(f"{'warning' if note.doubtful else 'note'}: {text(note)}")


class Steps:
    """Progress of work that may be long: on a terminal a spinner, elsewhere a line every SECONDS on standard error.

    `with Steps() as step: step("reading")`.
    """

    def __init__(self, console: Console = messages) -> None:
        self._console = console
        self._text, self._began, self._over = "", time.monotonic(), threading.Event()
        self._bar = Progress(
            SpinnerColumn(),
            TextColumn("{task.description}", markup=False),
            TimeElapsedColumn(),
            console=console,
            transient=True,
            disable=not console.file.isatty(),
        )
        self._task = self._bar.add_task("")
        self._speaker = threading.Thread(target=self._speak, daemon=True)

    def __enter__(self) -> Callable[[str], None]:
        self._bar.start()
        if self._bar.disable:
            with suppress(RuntimeError):  # memory has no room for a thread: the work may still fit
                self._speaker.start()
        return self.step

    def __exit__(self, *_: object) -> None:
        self._over.set()
        self._bar.stop()
        if self._speaker.is_alive():
            self._speaker.join()

    def step(self, text: str) -> None:
        """What is done now."""
        self._text = printable(text)
        self._bar.update(self._task, description=self._text)

    def _speak(self) -> None:
        while not self._over.wait(SECONDS):
            self._console.print(f"{self._text or 'working'}, {time.monotonic() - self._began:.0f} s so far")


def facts_table(facts: dict[str, Any]) -> Table:
    """Two columns; nested keys are joined by a dot."""
    table = Table(show_header=False, box=None, pad_edge=False)
    for key, value in facts.items():
        for label, shown in _rows(key, value):
            table.add_row(printable(label), printable(shown))
    return table


def print_json(value: Any) -> None:
    """One JSON document on standard output; what `clean` replaces stands there as an escape of JSON."""
    text = json.dumps(value, indent=1, ensure_ascii=False)
    print(re.sub(r"[^\n -~]", lambda found: _escaped(found[0]), text))


def _escaped(character: str) -> str:
    return character if character.isprintable() else json.dumps(character)[1:-1]


def _rows(key: str, value: Any) -> list[tuple[str, str]]:
    if isinstance(value, dict):
        rows = [(f"{key}.{inner}", _text(v)) for inner, v in value.items()]
        return rows or [(key, "none")]
    return [(key, _text(value))]


def _text(value: Any) -> str:
    if isinstance(value, dict):
        return _text(value.get("path", ", ".join(f"{k} {_text(v)}" for k, v in value.items())))
    if isinstance(value, list | tuple):
        shown = ", ".join(map(_text, value[:12]))
        return f"{len(value)}: {shown}{', ...' if len(value) > 12 else ''}" if len(value) > 3 else shown
    return "none" if value is None else str(value)
