"""The web player without a GPU: packs, checks, poses, cameras, recordings, judged in Node by what Python computes."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.players.web import WEB, run_node_test

TESTS = sorted(path.name for path in (WEB / "tests" / "core").glob("*.test.mjs"))
MADE_UP = {"hostile.test.mjs": pytest.mark.hypothesis}  # which `make fuzz` repeats with more


@pytest.mark.parametrize("name", [pytest.param(name, marks=MADE_UP.get(name, ())) for name in TESTS])
def test_node_finds_what_python_computes(name: str, core_cases: Path) -> None:
    run_node_test(f"core/{name}", AVATAR_CASES=str(core_cases))
