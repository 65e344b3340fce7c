"""The npm package of the web player, built where it is not: `assemble("web")` builds nothing itself."""

from __future__ import annotations

import subprocess

import pytest
from filelock import FileLock

from avatar_export.players.web import web_files
from avatar_runtime.io.errors import AvatarError
from tests.players.web import WEB, node


@pytest.fixture(scope="session")
def built_web() -> None:
    """players/web/dist, for its sources as they are; one worker builds it. See `need`."""
    with FileLock(WEB / "node_modules" / ".built_web.lock"):
        try:
            web_files()
        except AvatarError:
            subprocess.run([node(), "build.mjs", "package"], cwd=WEB, check=True)
