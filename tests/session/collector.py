"""Python's collector of garbage passes over what imports have made, and comes in larger portions.

A process of tests holds a million such objects to its end, each of which it would visit again and again.
"""

from __future__ import annotations

import gc

import pytest

PORTIONS = (10_000, 20, 10)  # see gc.set_threshold


@pytest.hookimpl(trylast=True)
def pytest_collection_finish() -> None:
    """Before the first test, when all test modules are imported."""
    gc.collect()
    gc.freeze()
    gc.set_threshold(*PORTIONS)
