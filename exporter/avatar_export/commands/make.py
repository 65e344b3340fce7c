"""`avatar-export make`: a film of a face in, an avatar out."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from avatar_export.commands import arguments
from avatar_export.commands.console import output, tell
from avatar_export.commands.declared import command
from avatar_export.drop.hosts import project_at
from avatar_export.making.options import Film, Wanted
from avatar_export.making.run import StepFailed, expect_libraries
from avatar_export.making.run import make as run
from avatar_export.making.steps import Plan
from avatar_export.notes.note import fact
from avatar_runtime.io.errors import AvatarError


@command
def make(
    video: Annotated[Path, typer.Argument(help="A film of one face, as a phone writes it.")],
    out: Annotated[Path, typer.Option("--out", "-o", help="Folder to write; what is there is continued.")],
    wanted: Wanted,
    film: Film,
    into: Annotated[
        Path | None, typer.Option(help="Folder of a project that gets the avatar, as by `drop`.")
    ] = None,
    accept_misfit: Annotated[
        bool, typer.Option("--accept-misfit", help="Go on with a capture that the check refuses.")
    ] = False,
    force: Annotated[
        bool,
        typer.Option("--force", help="Make again what another film or other options would change."),
    ] = False,
) -> None:
    """Make an avatar of a film of a face: track it, check, train, and write bundle, pack and page.

    Killed at any moment, the same command goes on. Film yourself, or someone who has agreed.
    """
    arguments.exclude({"--focal": film.focal, "--fov": film.fov})
    expect_libraries()
    if not video.is_file():
        raise AvatarError(
            "no such file" if not video.exists() else "is not a file; pass the film", file=video
        )
    if into is not None:
        project_at(into)
    plan = Plan(video, out, film, wanted, accept_misfit)
    try:
        plan = run(plan, into, force=force, say=lambda line: output.print(line))
    except StepFailed as failed:
        raise typer.Exit(failed.code) from None
    output.print(f"{out / plan.pack}: for players; `avatar-export view {out / plan.pack}` shows it")
    output.print(f"{out / 'page'}: for a web server")
    output.print(f"{out / 'bundle'}: for other programs, with rig.glb and rig.usdc")
    said = {"--consent TEXT": plan.wanted.consent, "--licence TEXT": plan.wanted.license}
    unsaid = [option for option, text in said.items() if not text]
    tell([fact("not_stated", options=unsaid)] if unsaid else [])
