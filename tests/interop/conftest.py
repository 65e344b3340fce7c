"""The avatars whose files other people's readers are asked about."""

from __future__ import annotations

from collections.abc import Mapping

import pytest

from avatar_runtime.avatar import Avatar
from tests.asm_faces import asm_avatar
from tests.avatars import full_avatar, surface_avatar

SAMPLES = ("blendshapes", "lam", "splatting_head", "splatting_head_sh3", "body")
NAMES = ("full", "surface", "asm", *SAMPLES)


@pytest.fixture(scope="session")
def avatars(request: pytest.FixtureRequest) -> Mapping[str, Avatar]:
    """NAMES -> avatar: three tiny ones made for tests, and the samples."""
    samples = {name: request.getfixturevalue(f"{name}_avatar") for name in SAMPLES}
    return {"full": full_avatar(), "surface": surface_avatar(), "asm": asm_avatar(), **samples}


@pytest.fixture(scope="session", params=NAMES)
def avatar(request: pytest.FixtureRequest, avatars: Mapping[str, Avatar]) -> Avatar:
    """Each of them."""
    return avatars[request.param]
