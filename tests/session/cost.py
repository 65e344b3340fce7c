"""What a run cost, printed at its end: wall time depends on what else the machine does, CPU time hardly does."""

from __future__ import annotations

import resource
from typing import Any

import pytest

_SUMS = {"tests": 0.0, "CPU": 0.0}


def _cpu_seconds() -> float:
    """User and system time of this process and of the ended processes that it started."""
    used = (resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
    return sum(u.ru_utime + u.ru_stime for u in used)


def pytest_runtest_logreport(report: pytest.TestReport) -> None:
    """Each part of each test, also those of workers."""
    _SUMS["tests"] += report.duration


def pytest_sessionfinish(session: pytest.Session) -> None:
    """A worker sends its CPU time."""
    output: dict[str, Any] | None = getattr(session.config, "workeroutput", None)
    if output is not None:
        output["cpu_seconds"] = _cpu_seconds()


@pytest.hookimpl(optionalhook=True)
def pytest_testnodedown(node: Any) -> None:
    """The CPU time of a worker that has ended arrives."""
    _SUMS["CPU"] += getattr(node, "workeroutput", {}).get("cpu_seconds", 0.0)


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter, config: pytest.Config) -> None:
    """Print both sums."""
    workers = getattr(config.option, "numprocesses", None) or 0
    cpu = _SUMS["CPU"] if workers else _cpu_seconds()
    terminalreporter.section("cost")
    terminalreporter.write_line(f"{_SUMS['tests']:10.1f}  seconds, all tests one after the other")
    terminalreporter.write_line(f"{cpu:10.1f}  CPU seconds of {workers or 'no'} workers")
