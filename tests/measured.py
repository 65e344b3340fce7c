"""Figures that tests measure on the way, printed once at the end of a run: the worst of each over all tests."""

from __future__ import annotations

from collections.abc import Callable

import pytest

_WORST: dict[str, float] = {}
_LOWEST_IS_WORST = ("dB", "correlation")

Measure = Callable[[str, float], None]


@pytest.fixture(scope="session")
def measured() -> Measure:
    """Call with a name that ends in its unit and a value; the largest (of dB and correlations the least) is kept."""

    def note(name: str, value: float) -> None:
        pick = min if name.endswith(_LOWEST_IS_WORST) else max
        _WORST[name] = pick(_WORST.get(name, value), value)

    return note


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """Print what this run measured."""
    if _WORST:
        terminalreporter.section("measured, worst of each")
        for name, value in sorted(_WORST.items()):
            terminalreporter.write_line(f"{value:10.3g}  {name}")
