"""Cases that several players read: written once for all workers, and not changed by a test."""

from __future__ import annotations

from pathlib import Path

import pytest

from avatar_export.packing.steps import Fineness
from avatar_export.packing.write import driving_facts, pack
from avatar_runtime.packs import decode_pack
from tests.conformance.avatars import AVATARS
from tests.conformance.cases import cases_of
from tests.players.core_cases import write_cases
from tests.players.played_cases import HEAD, vectors_of
from tests.players.program_cases import write_programs
from tests.players.unity_cases import write_unity_cases
from tests.session.shared_folder import made_once


@pytest.fixture(scope="session")
def core_cases(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of what the core of each player must find."""

    def make(folder: Path) -> Path:
        write_cases(folder)
        write_programs(folder / "programs.json")
        return folder

    return made_once(tmp_path_factory, "core_cases", make)


@pytest.fixture(scope="session")
def unity_cases(tmp_path_factory: pytest.TempPathFactory, core_cases: Path) -> Path:
    """The folder of the same and of what only the core of the Unity player is asked."""

    def make(folder: Path) -> Path:
        write_unity_cases(core_cases, folder)
        return folder

    return made_once(tmp_path_factory, "unity_cases", make)


@pytest.fixture(scope="session")
def kit(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The kit's avatars and cases, as packs: a folder for each."""

    def make(folder: Path) -> Path:
        for name, made in AVATARS.items():
            source = made()
            file = pack([source], Fineness(), driving_facts(source)).file
            avatar = decode_pack(file, name).avatar
            (folder / name).mkdir()
            for part, data in {HEAD: file, **vectors_of(avatar, cases_of(name, avatar))}.items():
                (folder / name / part).write_bytes(data)
        return folder

    return made_once(tmp_path_factory, "kit", make)
