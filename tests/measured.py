"""Figures that tests measure on the way, printed once at the end of a run: the worst of each over all tests.

Where pytest-xdist shares the tests out, each worker sends what it measured to the process that prints.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import pytest

_WORST: dict[str, float] = {}
_LOWEST_IS_WORST = ("dB", "correlation")

Measure = Callable[[str, float], None]


def note(name: str, value: float) -> None:
    """Keep the worst value of `name`: the largest, of dB and correlations the least."""
    pick = min if name.endswith(_LOWEST_IS_WORST) else max
    _WORST[name] = pick(_WORST.get(name, value), value)


@pytest.fixture(scope="session")
def measured() -> Measure:
    """Call with a name that ends in its unit and a value; the worst is kept."""
    return note


def pytest_sessionfinish(session: pytest.Session) -> None:
    """A worker sends its figures."""
    output: dict[str, Any] | None = getattr(session.config, "workeroutput", None)
    if output is not None:
        output["measured"] = dict(_WORST)


@pytest.hookimpl(optionalhook=True)
def pytest_testnodedown(node: Any) -> None:
    """The figures of a worker that has ended arrive; one that crashed sends none."""
    found: Mapping[str, float] = getattr(node, "workeroutput", {}).get("measured", {})
    for name, value in found.items():
        note(name, value)


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """Print what this run measured."""
    if _WORST:
        terminalreporter.section("measured, worst of each")
        for name, value in sorted(_WORST.items()):
            terminalreporter.write_line(f"{value:10.3g}  {name}")
