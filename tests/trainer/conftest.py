"""The toy's capture, and the command line in this process."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from avatar_export.commands import console
from avatar_trainer import cli
from avatar_trainer.captures.load import load
from avatar_trainer.captures.model import Capture
from tests.commands import QUIET
from tests.trainer import toy


@pytest.fixture(scope="session")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The toy's capture; treat it as read-only."""
    return toy.capture_folder(tmp_path_factory.mktemp("capture") / "toy")


@pytest.fixture(scope="session")
def toy_capture(folder: Path) -> Capture:
    return load(folder)


@pytest.fixture
def avatar_train(
    monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> Callable[..., tuple[int, str, str]]:
    """Runs the command; (exit code, standard output, standard error)."""

    def command(*arguments: object) -> tuple[int, str, str]:
        monkeypatch.setattr(console, "SECONDS", QUIET)
        monkeypatch.setattr(sys, "argv", ["avatar-train", *map(str, arguments)])
        with pytest.raises(SystemExit) as end:
            cli.main()
        out, err = capfd.readouterr()
        code = end.value.code
        return (code if isinstance(code, int) else 0), out, err

    return command
