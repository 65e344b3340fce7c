"""What a terminal shows while a batch runs, read as a person reads it: from the screen that rich draws."""

from __future__ import annotations

import io
import threading
from collections.abc import Callable, Iterator

import pytest
from rich.console import Console

from avatar_export.batch.result import Result
from avatar_export.commands.batch import BatchProgress
from avatar_export.commands.console import CleanConsole
from tests.exporter.batch.screen import Screen


class Shown:
    """A terminal of 80 columns, and what a batch of five rows shows on it."""

    def __init__(self) -> None:
        self.screen, self._written = Screen(), io.StringIO()
        self.console: Console = CleanConsole(
            file=self._written, force_terminal=True, width=80, highlight=False, markup=False, soft_wrap=True
        )
        self.progress = BatchProgress(5, self.console)

    def lines(self) -> list[str]:
        """Without spinner and clock."""
        self.progress._bar.refresh()
        return self.rest()

    def rest(self) -> list[str]:
        """What is there now."""
        self.screen.write(self._written.getvalue())
        self._written.seek(0)
        self._written.truncate()
        return [" ".join(word for word in line.split() if word.isascii() and "0:00:0" not in word)
                for line in self.screen.lines()]  # fmt: skip


@pytest.fixture
def shown() -> Iterator[Shown]:
    shown = Shown()
    with shown.progress:
        yield shown


def test_a_line_for_all_and_one_a_worker(shown: Shown) -> None:
    assert shown.lines() == ["0 of 5 rows"]
    shown.progress.note("dashboard: http://127.0.0.1:1/status")
    shown.progress.started("anna", "0")
    shown.progress.started("ben", "1")
    assert shown.lines() == [
        "dashboard: http://127.0.0.1:1/status",
        "0 of 5 rows",
        "worker 0: anna",
        "worker 1: ben",
    ]
    shown.progress.ended(Result("anna", "done"))
    assert shown.lines()[1:] == ["1 of 5 rows", "worker 0: waits", "worker 1: ben"]
    shown.progress.started("carla", "0")
    assert shown.lines()[1:] == ["1 of 5 rows", "worker 0: carla", "worker 1: ben"]


def test_a_failure_stays_above(shown: Shown) -> None:
    shown.progress.started("anna", "0")
    shown.progress.ended(Result("anna", "failed", "input", "is wrong", "mend it"))
    assert shown.lines() == ["anna: failed: is wrong; mend it", "1 of 5 rows, 1 failed", "worker 0: waits"]


def test_a_worker_that_lost_its_row_has_no_line(shown: Shown) -> None:
    shown.progress.started("anna", "0")
    shown.progress.started("ben", "1")
    shown.progress.started("anna", "2")
    assert shown.lines() == ["0 of 5 rows", "worker 1: ben", "worker 2: anna"]


def test_a_worker_that_tries_another_row_keeps_its_line(shown: Shown) -> None:
    for name, worker in (("anna", "0"), ("ben", "0"), ("anna", "1")):
        shown.progress.started(name, worker)
    assert shown.lines() == ["0 of 5 rows", "worker 0: ben", "worker 1: anna"]


def test_near_the_end_idle_workers_have_no_line(shown: Shown) -> None:
    for name, worker in (("a", "0"), ("b", "1"), ("c", "0"), ("d", "1"), ("e", "0")):
        shown.progress.started(name, worker)
    for name in "abd":
        shown.progress.ended(Result(name, "done"))
    assert shown.lines() == ["3 of 5 rows", "worker 0: c, e"]
    shown.progress.ended(Result("c", "done"))
    assert shown.lines() == ["4 of 5 rows", "worker 0: e"]
    shown.progress.ended(Result("e", "done"))
    shown.progress.started("e", "0")  # told late
    assert shown.lines() == ["5 of 5 rows"]


def test_nothing_is_left_at_the_end() -> None:
    shown = Shown()
    with shown.progress:
        shown.progress.started("anna", "0")
        shown.progress.note("a line")
    assert shown.rest() == ["a line"]


@pytest.mark.parametrize("stop", [KeyboardInterrupt, SystemExit])
def test_a_stop_says_how_to_go_on(stop: Callable[[], BaseException]) -> None:
    shown = Shown()
    with pytest.raises((KeyboardInterrupt, SystemExit)), shown.progress:
        shown.progress.ended(Result("anna", "done"))
        raise stop()
    assert shown.rest() == ["stopped: 1 of 5 rows came to their end; --resume does what is missing"]


def test_without_a_terminal_a_line_comes_every_few_seconds(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("avatar_export.commands.console.SECONDS", 0.05)
    written = io.StringIO()
    with BatchProgress(
        2, CleanConsole(file=written, force_terminal=False, width=80, soft_wrap=True)
    ) as progress:
        while "\n" not in written.getvalue():
            threading.Event().wait(0.05)
        progress.ended(Result("anna", "done"))
        while "1 of 2 rows, 0 s so far" not in written.getvalue():
            threading.Event().wait(0.05)
    assert written.getvalue().startswith("0 of 2 rows, 0 s so far\n")


def test_without_a_terminal_each_row_is_a_line() -> None:
    written = io.StringIO()
    console = CleanConsole(file=written, force_terminal=False, width=80, soft_wrap=True)
    with BatchProgress(2, console) as progress:
        progress.started("anna", "0")
        progress.ended(Result("anna", "done", seconds=1.25))
        progress.ended(Result("ben\x1b[2J", "failed", "input", "is wrong", "mend it"))
    assert written.getvalue() == "1/2 anna: done, 1.2 s\nben?[2J: failed: is wrong; mend it\n"
