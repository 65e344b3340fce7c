"""The toy as a system of the command line, and the command line itself."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from avatar_export.commands.program import parser_of
from avatar_trainer import cli
from avatar_trainer.commands.train import train_command
from avatar_trainer.systems.table import SYSTEMS
from tests.trainer import toy


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
