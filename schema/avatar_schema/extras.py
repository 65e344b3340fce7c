"""How the libraries of an extra are installed: what every message about a missing one says."""

from __future__ import annotations

import re
from collections.abc import Iterator
from importlib.metadata import PackageNotFoundError, requires
from pathlib import Path

DISTRIBUTIONS = ("avatar-export-runtime", "avatar-export")  # a checkout installs as the second alone
CHECKOUT = Path(__file__).parents[2]
OURS = re.compile(rf"({'|'.join(DISTRIBUTIONS)})\[([\w,-]+)\]")


def how_to_install(extra: str) -> str:
    """The command that brings the libraries of an extra.

    In a checkout it keeps an editable install editable: plain `pip install ".[gl]"` would put a copy in its place.
    Elsewhere it names the libraries, so that no index is asked for a name of ours.
    """
    if (CHECKOUT / "pyproject.toml").is_file():
        here = "." if Path.cwd() == CHECKOUT else str(CHECKOUT)
        return f'pip install -e "{here}[{extra}]"'
    libraries = [f'"{line}"' for line in dict.fromkeys(_libraries(extra))]
    return f"pip install {' '.join(libraries)}"


def _libraries(extra: str) -> Iterator[str]:
    """What the installed distributions ask for under `extra`; the name of the extra if none of them has it."""
    lines = [line for name in DISTRIBUTIONS for line in _requires(name)]
    found = [
        line.partition(";")[0].strip() for line in lines if f'extra == "{extra}"' in line.replace("'", '"')
    ]
    for line in found or [extra]:
        ours = OURS.match(line)
        if ours is None:
            yield line
        else:
            yield from (
                library for inner in ours[2].split(",") if inner != extra for library in _libraries(inner)
            )


def _requires(name: str) -> list[str]:
    try:
        return requires(name) or []
    except PackageNotFoundError:
        return []
