"""Tables of engines, from engines.toml."""

from __future__ import annotations

import os
import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import Any

HERE = Path(__file__).resolve().parent
ENGINES_FOLDER = HERE.parent / "engines"


def engines() -> list[dict[str, Any]]:
    """The rows of engines.toml."""
    return _file()["engine"]


def _file() -> dict[str, list[dict[str, Any]]]:
    return tomllib.loads((HERE / "engines.toml").read_text("utf-8"))


def link(engine: dict[str, Any], page: Path) -> str:
    """The engine's name, linked to its page if it has one."""
    if "page" not in engine:
        return str(engine["name"])
    target = os.path.relpath((ENGINES_FOLDER / engine["page"]).resolve(), page.parent).replace(os.sep, "/")
    return f"[{engine['name']}]({target})"


def table(head: list[str], rows: list[list[str]]) -> str:
    """A Markdown table."""
    lines = [head, ["---"] * len(head), *rows]
    return (
        "\n".join("| " + " | ".join(line) + " |" for line in lines)
        .replace("| --- ", "|---")
        .replace("--- |", "---|")
    )


def summary(_: Path) -> str:
    """What moves where, in four rows."""
    rows = [[row["where"], row["moves"], row["run"]] for row in _file()["summary"]]
    return table(["where", "what moves", "run here?"], rows)


def moves(page: Path) -> str:
    """What moves where, and what of it was run."""
    rows = [[link(e, page), e["mesh"], e["gaussians"], e["ran"] or "nothing", e["never"]] for e in engines()]
    return table(["where", "mesh, shapes, clips", "Gaussians", "run here", "never run"], rows)


def imports(page: Path) -> str:
    """Which file each engine imports."""
    rows = [[link(e, page), e["files"], e["splats"], e["ids"]] for e in engines() if "files" in e]
    return table(
        [
            "engine",
            "mesh, morph targets, clips",
            "splats of the binding pose",
            "does the importer keep vertex ids?",
        ],
        rows,
    )


SECTIONS: dict[str, Callable[[Path], str]] = {"summary": summary, "moves": moves, "imports": imports}
