"""What the commands of this folder share."""

from __future__ import annotations

import argparse
import os
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

Row = tuple[str, float, str]  # name, value, unit


def cpu_seconds() -> float:
    """CPU seconds up to now, those of the processes included that ended. Other work on the machine disturbs it less
    than wall time.
    """
    spent = os.times()
    return spent.user + spent.system + spent.children_user + spent.children_system


def parsed(doc: str | None, *texts: str, **numbers: int) -> dict[str, Any]:
    """The command line: FOLDER, options of `texts`, which are None by default, and of whole `numbers`."""
    parser = argparse.ArgumentParser(description=doc, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    for name, default in numbers.items():
        parser.add_argument(f"--{name}", type=int, default=default)
    for name in texts:
        parser.add_argument(f"--{name}")
    return vars(parser.parse_args())


def show(measure: Callable[..., Iterable[Row]], given: dict[str, Any]) -> None:
    """Prints the rows that `measure` gives."""
    for name, value, unit in measure(**given):
        print(f"{name:36s} {value:12.4g} {unit}", flush=True)
