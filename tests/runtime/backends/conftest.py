"""Sample avatars of every system that the fast backends are held against the reference on."""

from __future__ import annotations

import pytest

from avatar_export.readers.table import read
from avatar_runtime.avatar import Avatar
from tests.shared_data import shared

SAMPLES = (
    "blendshapes_avatar",
    "lam_avatar",
    "splatting_head_avatar",
    "splatting_head_sh3_avatar",
    "body_avatar",
    "lam_original",
)


@pytest.fixture(scope="session")
def lam_original() -> Avatar:
    return read(shared("lam/p2-1.zip"))


@pytest.fixture(params=SAMPLES)
def sample(request: pytest.FixtureRequest) -> Avatar:
    """Each sample in turn, and LAM's own avatar where it is present."""
    avatar: Avatar = request.getfixturevalue(request.param)
    return avatar
