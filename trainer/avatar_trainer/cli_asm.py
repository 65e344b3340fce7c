"""`avatar-train asm`: bone-driven faces (arXiv 2304.09423), fitted to scans and to pictures."""

from __future__ import annotations

import typer

app = typer.Typer(
    help="ASM: bone-driven faces, fitted to scans and pictures.",
    no_args_is_help=True,
    rich_markup_mode=None,
)


@app.callback()
def asm() -> None:
    """ASM: bone-driven faces, fitted to scans and pictures."""
