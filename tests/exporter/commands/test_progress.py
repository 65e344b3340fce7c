"""Long work says that it goes on, where there is no terminal, too."""

from __future__ import annotations

import re
import threading
from typing import Any

import pytest

from avatar_export.commands import console
from avatar_export.commands.console import Steps
from tests.commands import Run

LINE = re.compile(r"reading\?, [0-9]+ s so far")


def test_a_line_comes_every_few_seconds_on_standard_error(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """During one long step, too; none after the end."""
    assert console.SECONDS == 10
    monkeypatch.setattr(console, "SECONDS", 0.05)
    lines: list[str] = []
    with Steps() as step:
        step("reading\n")
        while len(lines) < 3:
            threading.Event().wait(0.05)
            captured = capsys.readouterr()
            assert captured.out == ""
            lines += captured.err.splitlines()
    capsys.readouterr()
    threading.Event().wait(0.2)
    assert capsys.readouterr() == ("", "") and all(LINE.fullmatch(line) for line in lines)


def test_a_command_says_it(
    run: Run, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    said: list[str] = []

    def inspect(*_: object) -> dict[str, Any]:
        while not said:
            threading.Event().wait(0.05)
            said.extend(capsys.readouterr().err.splitlines())
        return {}

    monkeypatch.setattr("avatar_export.summary.inspect", inspect)
    monkeypatch.setattr("tests.commands.QUIET", 0.05)
    assert run("inspect", "x")[0] == 0 and said[0] == "reading, 0 s so far"
