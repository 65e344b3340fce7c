"""The command line in this process, for tests."""

from __future__ import annotations

import sys
from collections.abc import Callable

import pytest

from avatar_export import cli
from avatar_export.commands import console

PLAIN = ("--no-preview", "--no-engine-files", "--no-reference")  # of `convert`: the normative files alone
QUIET = 1e6  # seconds: no lines of progress, however slow the machine is
Run = Callable[..., tuple[int, str, str]]
Refused = Callable[..., str]


@pytest.fixture
def run(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> Run:
    """(exit code, standard output, standard error) of one command."""

    def command(*arguments: object) -> tuple[int, str, str]:
        monkeypatch.setattr(console, "SECONDS", QUIET)
        monkeypatch.setattr(sys, "argv", ["avatar-export", *map(str, arguments)])
        capsys.readouterr()
        try:
            cli.main()
            code = 0
        except SystemExit as stop:
            code = int(stop.code or 0)
        captured = capsys.readouterr()
        return code, captured.out, captured.err

    return command


@pytest.fixture
def refused(run: Run) -> Refused:
    """What a command says that is refused: one line on standard error, without the frame of usage errors; code 2."""

    def command(*arguments: object) -> str:
        code, out, error = run(*arguments)
        assert (code, out) == (2, "") and error.count("\n") == 1, (code, out, error)
        return error

    return command
