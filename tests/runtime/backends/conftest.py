"""Contexts of both kinds of OpenGL, and sample avatars of every system."""

from __future__ import annotations

from collections.abc import Iterator

import moderngl
import pytest

from avatar_export.readers.table import read
from avatar_runtime.avatar import Avatar
from avatar_runtime.backends.gl.context import own_context
from tests.shared_data import shared

SAMPLES = (
    *("blendshapes_avatar", "lam_avatar", "splatting_head_avatar"),
    *("splatting_head_sh3_avatar", "body_avatar", "lam_original"),
)


@pytest.fixture(scope="module", params=[False, True], ids=["desktop", "es"])
def context(request: pytest.FixtureRequest) -> Iterator[moderngl.Context]:
    made = own_context(es=request.param)
    yield made
    made.release()


@pytest.fixture(scope="session")
def lam_original() -> Avatar:
    return read(shared("lam/p2-1.zip"))


@pytest.fixture(params=SAMPLES)
def sample(request: pytest.FixtureRequest) -> Avatar:
    """Each sample in turn, and LAM's own avatar where it is present."""
    avatar: Avatar = request.getfixturevalue(request.param)
    return avatar
