"""Players put together, for all workers once, as a user gets them. No test may change these folders."""

from __future__ import annotations

from pathlib import Path

import pytest

from avatar_export.players.assemble import assemble
from tests.session.shared_folder import made_once


def assembled(factory: pytest.TempPathFactory, player: str) -> Path:
    """The folder of a player."""

    def make(folder: Path) -> Path:
        for name, content in assemble(player).items():
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            (folder / name).write_bytes(content)
        return folder

    return made_once(factory, f"assembled_{player}", make)


@pytest.fixture(scope="session")
def unity_package(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The UPM package."""
    return assembled(tmp_path_factory, "unity")


@pytest.fixture(scope="session")
def unreal_plugin(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The plugin."""
    return assembled(tmp_path_factory, "unreal")
