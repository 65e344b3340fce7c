"""The toy as a system of the command line, and the command line itself."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from avatar_export.commands.program import parser_of
from avatar_trainer import cli
from avatar_trainer.commands.train import train_command
from avatar_trainer.systems.table import SYSTEMS
from tests.trainer import toy

Train = Callable[..., tuple[int, str, str]]


@pytest.fixture(scope="module", autouse=True)
def toy_is_a_system() -> Iterator[None]:
    """The toy is in the table and on the command line, for these tests only."""
    SYSTEMS["toy"] = toy.__name__
    commands = list(cli.app.registered_commands)
    cli.app.command("toy")(train_command("toy"))
    parser_of.cache_clear()
    yield
    cli.app.registered_commands = commands
    parser_of.cache_clear()
    del SYSTEMS["toy"]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return toy.capture_folder(tmp_path_factory.mktemp("capture") / "toy")


@pytest.fixture
def avatar_train(monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]) -> Train:
    """Runs the command; (exit code, standard output, standard error)."""

    def command(*arguments: object) -> tuple[int, str, str]:
        monkeypatch.setattr(sys, "argv", ["avatar-train", *map(str, arguments)])
        with pytest.raises(SystemExit) as end:
            cli.main()
        out, err = capfd.readouterr()
        code = end.value.code
        return (code if isinstance(code, int) else 0), out, err

    return command
