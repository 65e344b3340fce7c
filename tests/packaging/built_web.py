"""The npm package of the web player, built where it is not: `assemble("web")` builds nothing itself."""

from __future__ import annotations

import subprocess
from pathlib import Path

import pytest
from filelock import FileLock
from tools.web_sample import sample

from avatar_export.players.assemble import assemble
from avatar_export.players.web import SAMPLE, web_files
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
            (WEB / SAMPLE).write_bytes(sample())


@pytest.fixture(scope="session")
def web_package(built_web: None, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of the package as npm unpacks it."""
    folder = tmp_path_factory.mktemp("web") / "avatar-export-player"
    for name, data in assemble("web").items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_bytes(data)
    return folder
