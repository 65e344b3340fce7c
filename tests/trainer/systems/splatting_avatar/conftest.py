"""A sheet that was filmed."""

from __future__ import annotations

import pytest

from avatar_trainer.captures.model import Capture
from tests.trainer.systems.splatting_avatar import scene


@pytest.fixture(scope="module")
def capture(tmp_path_factory: pytest.TempPathFactory) -> Capture:
    return scene.taught(tmp_path_factory.mktemp("sheet"))
