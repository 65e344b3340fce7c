"""How many examples a test with made-up input tries.

`make test` tries the same few on every run; `make fuzz` sets AVATAR_FUZZ to a factor and tries that many times as
many, new ones on every run.
"""

from __future__ import annotations

import os

from hypothesis import settings

FACTOR = float(os.environ.get("AVATAR_FUZZ", "0"))
SHARE = 0.3  # of the requested examples, outside of a fuzz run


def examples(count: int) -> int:
    """The number of examples of a test that asks for `count`."""
    return max(10, round(count * (FACTOR or SHARE)))


def load_profile() -> None:
    """The default of hypothesis's settings. No test fails because the machine was busy."""
    common = {"deadline": None, "max_examples": examples(100)}
    settings.register_profile("steady", derandomize=True, **common)
    settings.register_profile("fuzz", derandomize=False, print_blob=True, **common)
    settings.load_profile("fuzz" if FACTOR else "steady")
