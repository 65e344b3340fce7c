"""Output of the command lines: progress on a terminal, tables, JSON."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable
from typing import Any

from rich.console import Console
from rich.progress import Progress, SpinnerColumn, TextColumn, TimeElapsedColumn
from rich.table import Table

messages = Console(stderr=True, highlight=False, markup=False, soft_wrap=True)
output = Console(highlight=False, markup=False, soft_wrap=not sys.stdout.isatty())


class Steps:
    """A spinner on a terminal, nothing elsewhere; `with Steps() as step: step("reading")`."""

    def __enter__(self) -> Callable[[str], None]:
        self._bar = Progress(
            SpinnerColumn(), TextColumn("{task.description}"), TimeElapsedColumn(), console=messages, transient=True,
            disable=not sys.stderr.isatty(),
        )  # fmt: skip
        self._bar.start()
        task = self._bar.add_task("")
        return lambda text: self._bar.update(task, description=text)

    def __exit__(self, *_: object) -> None:
        self._bar.stop()


def facts_table(facts: dict[str, Any]) -> Table:
    """Two columns; nested keys are joined by a dot."""
    table = Table(show_header=False, box=None, pad_edge=False)
    for key, value in facts.items():
        for label, text in _rows(key, value):
            table.add_row(label, text)
    return table


def print_json(value: Any) -> None:
    """One JSON document on standard output."""
    print(json.dumps(value, indent=1, ensure_ascii=False))


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
    return "none" if value is None else "".join(c if c.isprintable() else "?" for c in str(value))
