"""What a run cost, printed at its end: wall time depends on what else the machine does, CPU time depends less on it."""

from __future__ import annotations

import resource
from collections.abc import Generator

import pytest


def _cpu_seconds() -> float:
    """User and system time of this process and of the ended processes that it started."""
    used = (resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
    return sum(u.ru_utime + u.ru_stime for u in used)


_at_last_report = _cpu_seconds()
_sums = {"wall": 0.0, "CPU": 0.0}


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport() -> Generator[None, pytest.TestReport, pytest.TestReport]:
    """Where a test runs: its report carries the CPU time since the report before."""
    global _at_last_report
    report, now = (yield), _cpu_seconds()
    report.cpu_seconds, _at_last_report = now - _at_last_report, now
    return report


def pytest_runtest_logreport(report: pytest.TestReport) -> None:
    """Where the reports of all workers arrive: each part of each test."""
    _sums["wall"] += report.duration
    _sums["CPU"] += getattr(report, "cpu_seconds", 0.0)


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """Print both sums."""
    terminalreporter.section("cost")
    terminalreporter.write_line(f"{_sums['wall']:10.1f}  seconds, all tests one after the other")
    terminalreporter.write_line(f"{_sums['CPU']:10.1f}  CPU seconds, the processes that tests start included")
