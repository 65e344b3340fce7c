"""The readers of packs as judges: programs that read packs, each after its length, and write a line of JSON each."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path

from tests.players.unity import compile_csharp, core_sources
from tests.players.web import WEB, node
from tests.session.native import NATIVE, SANITIZED, build


def native(flags: tuple[str, ...]) -> list[str]:
    """The native player."""
    return [str(build("judge", [NATIVE / "tests" / "judge.cpp"], flags))]


def unity(folder: Path) -> list[str]:
    """The Unity player's core, which mono runs without Unity; compiled in `folder`."""
    judge = Path(__file__).with_name("JudgePacks.cs")
    return ["mono", str(compile_csharp([*core_sources(), judge], folder / "judge.exe"))]


JUDGES: dict[str, Callable[[Path], list[str]]] = {  # what starts each; a folder for what is compiled
    "python": lambda _: [sys.executable, "-m", "tests.players.hostile.judge_python"],
    "web": lambda _: [node(), str(WEB / "tests" / "judge.mjs")],
    "native": lambda _: native(("-O2",)),
    "unity": unity,
}
GUARDED = {**JUDGES, "native": lambda _: native(SANITIZED)}  # memory, too
