"""The web player without a GPU: packs, checks, poses, cameras, recordings, judged in Node by what Python computes."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.players.web import WEB, run_node_test

TESTS = ("cameras", "heights", "hostile", "packs", "poses", "programs", "recordings")


def test_all_tests_of_the_core_are_listed() -> None:
    assert {path.name for path in (WEB / "tests" / "core").glob("*.test.mjs")} == {
        f"{name}.test.mjs" for name in TESTS
    }


MADE_UP = {"hostile": pytest.mark.hypothesis}  # which `make fuzz` repeats with more


@pytest.mark.parametrize("name", [pytest.param(name, marks=MADE_UP.get(name, ())) for name in TESTS])
def test_node_finds_what_python_computes(name: str, core_cases: Path) -> None:
    run_node_test(f"core/{name}.test.mjs", AVATAR_CASES=str(core_cases))
