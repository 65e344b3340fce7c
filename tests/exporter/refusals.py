"""Refusals of bad input: changes that spoil it, and the one line that names what is wrong."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

from avatar_runtime.io.errors import AvatarError


def refused(says: str, call: Callable[..., object], *given: Any, **options: Any) -> AvatarError:
    """The error of one line that `call` ends with; the pattern `says` is in it."""
    with pytest.raises(AvatarError, match=says) as caught:
        call(*given, **options)
    line = str(caught.value)
    assert "\n" not in line and len(line) < 1000
    return caught.value


def put(*at: Any) -> Callable[[Any], None]:
    """Puts the last of `at` to where the others lead."""

    def change(document: Any) -> None:
        owner: Any = document
        for step in at[:-2]:
            owner = owner[step]
        owner[at[-2]] = at[-1]

    return change
