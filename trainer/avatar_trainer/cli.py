"""The command line `avatar-train`: registers the commands of `commands/`."""

from __future__ import annotations

import typer

from avatar_export import cli
from avatar_export.commands import program
from avatar_trainer.commands.asm import app as asm
from avatar_trainer.commands.batch import batch
from avatar_trainer.commands.capture import capture
from avatar_trainer.commands.check import check
from avatar_trainer.commands.compare import compare
from avatar_trainer.commands.evaluate import evaluate
from avatar_trainer.commands.export import export
from avatar_trainer.commands.rules import rules
from avatar_trainer.commands.settings import settings
from avatar_trainer.commands.stability import stability
from avatar_trainer.commands.train import train_command
from avatar_trainer.systems.table import SYSTEMS

app = typer.Typer(
    help=f"Trains animatable avatars made of 3D Gaussians ({', '.join(SYSTEMS)}) from captured frames.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
)
for _name in SYSTEMS:
    app.command(_name)(train_command(_name))
app.add_typer(asm, name="asm")
for _command in (batch, capture, check, evaluate, export, compare, stability, rules, settings):
    app.command()(_command)
app.callback(help=app.info.help)(program.root)


def main() -> None:
    """Entry point."""
    program.run(app, "avatar-train", avatar_export=cli.app)
