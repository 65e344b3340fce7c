"""`avatar-export drop`: an avatar and its player into the project of an engine."""

from __future__ import annotations

from collections import Counter
from pathlib import Path
from typing import Annotated

import typer

from avatar_export.commands.console import Steps, output, tell
from avatar_export.commands.declared import command
from avatar_export.convert_options import SourceOptions
from avatar_export.drop import dropping
from avatar_export.drop.contents import Source
from avatar_export.drop.placing import KEEP, NEW, REMOVE, SAME, UPDATE
from avatar_export.notes.note import fact
from avatar_export.options import Option
from avatar_export.packing.choices import level_parts

DONE = {NEW: "new", UPDATE: "updated", SAME: "unchanged", REMOVE: "removed", KEEP: "kept"}


@command
def drop(
    source: Annotated[
        Path, typer.Argument(help="A bundle, a pack, or the output of training (see `systems`).")
    ],
    into: Annotated[
        Path,
        typer.Option(help="Folder of the project: Unity, Unreal, Godot, npm, or a folder with web pages."),
    ],
    dry_run: Annotated[
        bool, typer.Option("--dry-run", help="List what would change, and change nothing.")
    ] = False,
    force: Annotated[
        bool, typer.Option("--force", help="Replace files of player and avatar that you changed.")
    ] = False,
    levels: Annotated[
        tuple[float, ...] | None,
        Option(
            "Levels of detail, as of `pack`; 1 leaves the coarser ones out. Default for engines: 1,0.5,0.25.",
            text=level_parts,
        ),
    ] = None,
    *,
    options: SourceOptions,
) -> None:
    """Put an avatar and the player for it into the project of an engine, and say what to do next there.

    Run again, it updates both. What you changed stays, and is named. A pack is taken as it is; anything else is packed
    as the engine wants it.
    """
    with Steps() as step:
        done = dropping.drop(
            Source(source, options), into, levels=levels, force=force, dry_run=dry_run, progress=step
        )
    output.print(f"{into}: {done.project.text()}; {done.support}")
    if dry_run:
        for path, word in sorted(done.words.items()):
            if word != SAME:
                output.print(f"{word:6}  {path}")
    else:
        _print(done)
    cure = {"verb": "dropped", "cure": "--force replaces it"}
    tell(fact("changed_since", path=path, **cure) for path in done.kept)
    tell(done.notes)
    if not dry_run:
        output.print("Next:")
        for number, text in enumerate(done.steps, 1):
            output.print(f"{number}. {text}")


def _print(done: dropping.Dropped) -> None:
    """One line for the player, one for the avatar."""
    inside = f"{done.player}/"
    words = [word for path, word in done.words.items() if path == done.player or path.startswith(inside)]
    if done.player:
        counts = ", ".join(f"{count} {DONE[word]}" for word, count in Counter(words).items())
        output.print(f"  player  {done.player}: {counts}")
    output.print(f"  avatar  {done.asset}: {DONE[done.words[done.asset]]}")
