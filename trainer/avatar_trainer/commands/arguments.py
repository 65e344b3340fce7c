"""Arguments and options that several commands of avatar-train take."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

Run = Annotated[Path, typer.Argument(help="Folder that a training wrote.", metavar="OUT")]
Captured = Annotated[
    Path | None, typer.Option("--capture", help="Where the capture is now, if it was moved.")
]
