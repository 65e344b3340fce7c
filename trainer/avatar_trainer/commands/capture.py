"""`avatar-train capture VIDEO -o OUT`: from a film of a face to a capture."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from avatar_export.commands import console
from avatar_runtime import AvatarError
from avatar_schema import extras


def capture(
    video: Annotated[Path, typer.Argument(help="A film of one face: MP4, MOV, WebM, MKV or AVI.")],
    out: Annotated[
        Path, typer.Option("--out", "-o", help="Folder to write; a run that was stopped there goes on.")
    ],
    focal: Annotated[
        float | None, typer.Option(help="Focal length in pixels of the upright film, if you know it.", min=1)
    ] = None,
    fov: Annotated[
        float | None,
        typer.Option(
            help="Field of view of the film's longer side in degrees, if you know it.", min=5, max=150
        ),
    ] = None,
    rotation: Annotated[
        int | None,
        typer.Option(
            help="Degrees clockwise that make the film upright: 0, 90, 180 or 270. Default: as the file says."
        ),
    ] = None,
    crop: Annotated[
        str | None, typer.Option(help="X,Y,W,H: the part of the upright film to use, pixels.")
    ] = None,
    first: Annotated[float, typer.Option(help="Second at which to begin.", min=0)] = 0.0,
    last: Annotated[
        float | None, typer.Option(help="Second at which to end. Default: 60 s after the first.")
    ] = None,
    fps: Annotated[
        float | None,
        typer.Option(help="Frames a second to use, at most the film's. Default: 30 at most.", min=1, max=120),
    ] = None,
    size: Annotated[int, typer.Option(help="Pixels of the capture's images.", min=64, max=2048)] = 512,
    seed: Annotated[int, typer.Option(help="Seed of all random numbers.", min=0)] = 0,
    name: Annotated[
        str | None, typer.Option(help="Name of the person or the avatar. Default: that of the film's file.")
    ] = None,
    licence: Annotated[str, typer.Option(help="On what terms the avatar may be used.")] = "",
    consent: Annotated[str, typer.Option(help="What the person shown has agreed to.")] = "",
    author: Annotated[str, typer.Option(help="Who filmed.")] = "",
) -> None:
    """Track the face of a film and write a capture: images, masks, cameras, expressions, a body model."""
    if focal is not None and fov is not None:
        raise AvatarError("name --focal or --fov, not both", field="--fov")
    try:
        from avatar_trainer.film.capture import FilmSettings, Texts, make_capture
    except ImportError as error:
        raise AvatarError(f"needs {error.name}: {extras.how_to_install('video')}", field="capture") from None
    settings = FilmSettings(focal, fov, rotation, _crop(crop), first, last, fps, size, seed)
    with console.Steps() as step:
        made = make_capture(
            video, out, settings, Texts(name or video.stem, licence, consent, author), step, console.tell
        )
    console.output.print(f"{made}: written")


def _crop(text: str | None) -> tuple[int, int, int, int] | None:
    if text is None:
        return None
    try:
        x, y, w, h = (int(part) for part in text.split(","))
    except ValueError:
        raise AvatarError(f"{text[:80]!r}: expected X,Y,W,H in pixels", field="--crop") from None
    return x, y, w, h
