"""A synthetic head whose images show what it states."""

from __future__ import annotations

from pathlib import Path

import pytest
from samples.capture import shots
from samples.capture.head import write_head
from samples.capture.shots import Noise

from tests.session.shared_folder import made_once

SIZE, FRAMES = 64, 6


@pytest.fixture(scope="session")
def head_take(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A capture of the own layout, 64 x 64; treat it as read-only."""

    def make(folder: Path) -> Path:
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(shots, "RAYS", 192)
            write_head(folder, SIZE, FRAMES, Noise())
        return folder

    return made_once(tmp_path_factory, "head_take", make)
