"""`avatar-train check CAPTURE`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from avatar_export.commands.console import Steps, output
from avatar_trainer.captures.describe import describe
from avatar_trainer.captures.load import check_pixels, load


def check(capture: Annotated[Path, typer.Argument(help="Folder of the captured frames.")]) -> None:
    """Read a whole capture, images too, and say what is in it."""
    with Steps() as step:
        step("reading")
        scene = load(capture)
        step("decoding images")
        check_pixels(scene)
    output.print(describe(scene))
