"""The libraries of the add-on for Godot, built where they are not: `assemble("godot")` builds nothing itself."""

from __future__ import annotations

import pytest
from tools.godot import build


@pytest.fixture(scope="session")
def built_godot() -> None:
    """players/godot/bin, for its sources as they are: this machine's library, and others that are there."""
    there = {path.name for path in build.BIN.glob("lib*")}
    for target in build.TARGETS:
        if target == build.HERE or build.file_name(target) in there:
            build.build(target)
