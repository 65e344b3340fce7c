"""Figures that tests measure on the way: printed at the end of a run, the worst of each over all tests.

`pytest --write-results` also writes them to tests/results/accuracy.csv, each with the limit that its test asks for;
rows of figures that this run did not measure stay. docs/accuracy.md is made of that file. A plain run writes nothing.
Where pytest-xdist shares the tests out, each worker sends what it measured to the process that prints.
"""

from __future__ import annotations

import csv
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Protocol

import pytest

RESULTS = Path(__file__).parent / "results" / "accuracy.csv"
COLUMNS = ("figure", "worst", "limit")
_WORST: dict[str, float] = {}
_LIMITS: dict[str, float] = {}
_LOWEST_IS_WORST = ("dB", "correlation")


class Measure(Protocol):
    """Notes a figure: a name that ends in its unit, its value, and the limit that the test asks for, if it asks."""

    def __call__(self, name: str, value: float, limit: float | None = None) -> None: ...


def note(name: str, value: float, limit: float | None = None) -> None:
    """Keep the largest value of each name (of dB and correlations the least), and the loosest limit."""
    worst, loosest = (min, min) if name.endswith(_LOWEST_IS_WORST) else (max, max)
    _WORST[name] = float(worst(_WORST.get(name, value), value))  # a worker can send no NumPy number
    if limit is not None:
        _LIMITS[name] = float(loosest(_LIMITS.get(name, limit), limit))


@pytest.fixture(scope="session")
def measured() -> Measure:
    """Call with a name, a value and the limit; see `note`."""
    return note


def pytest_addoption(parser: pytest.Parser) -> None:
    """The option that asks for the file."""
    parser.addoption("--write-results", action="store_true", help=f"write measured figures to {RESULTS.name}")


def pytest_sessionfinish(session: pytest.Session) -> None:
    """A worker sends its figures."""
    output: dict[str, Any] | None = getattr(session.config, "workeroutput", None)
    if output is not None:
        output["measured"] = {name: (value, _LIMITS.get(name)) for name, value in _WORST.items()}


@pytest.hookimpl(optionalhook=True)
def pytest_testnodedown(node: Any) -> None:
    """The figures of a worker that has ended arrive; one that crashed sends none."""
    found: Mapping[str, tuple[float, float | None]] = getattr(node, "workeroutput", {}).get("measured", {})
    for name, (value, limit) in found.items():
        note(name, value, limit)


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter, config: pytest.Config) -> None:
    """Print what this run measured, and write it where that is asked."""
    if not _WORST:
        return
    terminalreporter.section("measured, worst of each")
    for name, value in sorted(_WORST.items()):
        limit = f"of {_LIMITS[name]:.3g}" if name in _LIMITS else ""
        terminalreporter.write_line(f"{value:10.3g} {limit:>12}  {name}")
    if config.getoption("--write-results"):
        write(RESULTS)
        terminalreporter.write_line(f"written: {RESULTS}")


def write(path: Path) -> None:
    """Put this run's figures into the file, in the order of their names."""
    rows: dict[str, dict[str, str]] = {}
    if path.exists():
        with path.open(newline="", encoding="utf-8") as file:
            rows = {row["figure"]: row for row in csv.DictReader(file)}
    for name, value in _WORST.items():
        limit = f"{_LIMITS[name]:.4g}" if name in _LIMITS else ""
        rows[name] = {"figure": name, "worst": f"{value:.3g}", "limit": limit}
    path.parent.mkdir(exist_ok=True)
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, COLUMNS, lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows[name] for name in sorted(rows))
