"""The committed vectors, read."""

from __future__ import annotations

from functools import cache

from avatar_runtime.bundle import opener
from avatar_runtime.conformance import Reference, decode
from tests.conformance.cases import DATA


@cache
def committed(avatar: str) -> Reference:
    """Reference vectors of the avatar of that name."""
    return decode(opener(DATA / avatar))
