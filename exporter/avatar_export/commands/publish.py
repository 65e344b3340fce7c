"""`avatar-export publish`: avatars as a folder for any web server, or as one HTML file."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Annotated

import typer

from avatar_export.commands import arguments
from avatar_export.commands.console import Steps, output, tell
from avatar_export.commands.declared import command
from avatar_export.commands.view import Sources
from avatar_export.notes.note import Note, fact
from avatar_export.options import Clips
from avatar_export.serving import publish as publishing
from avatar_export.serving import site_folder
from avatar_export.serving.sources import sources_of
from avatar_runtime.io.text_files import refuse_existing, write_text

URL = re.compile(r"https?://[^\s/?#\"'<>\\]+(?:/[^\s?#\"'<>\\]*)?", re.IGNORECASE)
LARGE = 25_000_000  # bytes of one HTML file, above which mail and chat often refuse it


@command
def publish(
    sources: Sources,
    out: Annotated[
        Path, typer.Option("--out", "-o", help="Folder to write; with --single, the file NAME.html.")
    ],
    url: Annotated[
        str | None,
        typer.Option(help="Address where the folder will lie, https://... Pages then have link previews."),
    ] = None,
    title: Annotated[str | None, typer.Option(help="Title of the page. Default: the avatar's name.")] = None,
    single: Annotated[
        bool, typer.Option("--single", help="Write one HTML file, which opens by double-click.")
    ] = False,
    talk: Annotated[
        bool,
        typer.Option(
            "--talk", help="Let a visitor's camera drive the avatars: adds 7.5 MB, loaded on a click."
        ),
    ] = False,
    clip: Clips = (),
    force: arguments.Force = False,
) -> None:
    """Write avatars as web pages: a folder for any web server or file host, or one HTML file.

    Several avatars make a gallery. Each gets the clips of --clip, for which a pack is packed anew. The pages load
    nothing from elsewhere and need no program on the server.
    """
    address = None if url is None else _absolute(url)
    if single and url is not None:
        raise typer.BadParameter("--single has no address; leave out --url", param_hint="--url")
    if single and len(sources) > 1:
        raise typer.BadParameter("one file holds one avatar", param_hint="--single")
    if single and talk:
        raise typer.BadParameter("a page from a disk gets no camera; leave out --single", param_hint="--talk")
    if single:
        refuse_existing(out, force)
    else:
        site_folder.expect_replaceable(out, force)
    notes: list[Note] = []
    with Steps() as step:
        found = sources_of(sources, site_folder.FOLDERS)
        avatars = [source.load(step, clip, notes.append) for source in found]
        step("writing")
        if single:
            page = publishing.single(avatars[0], title)
            write_text(out, page, force=force)
            size = len(page.encode())
        else:
            files = publishing.site(avatars, address, title, talk=talk)
            kept = site_folder.write_site(out, files, force)
            changed = {"verb": "published", "cure": "delete it to get a new one"}
            notes += [fact("changed_since", path=path, **changed) for path in kept]
            size = sum(map(len, files.values()))
    unlicensed = [avatar.name for avatar in avatars if avatar.license is None]
    notes += [fact("no_licence", avatar=name, option="`convert --licence`") for name in unlicensed]
    if single and size > LARGE:
        notes.append(fact("large_page"))
    tell(notes)
    if single:
        output.print(f"{out}: {size / 1e6:.2f} MB; open it by double-click")
        return
    count = f"{len(avatars)} avatars, " if len(avatars) > 1 else ""
    output.print(f"{out}: {count}{size / 1e6:.2f} MB; copy the folder to a web server or file host")


def _absolute(url: str) -> str:
    """An absolute address of a folder, with a slash at its end. Raises a usage error for anything else, which repeats
    no password."""
    if "@" in url.partition("//")[2].partition("/")[0] or ("@" in url and not URL.fullmatch(url)):
        raise typer.BadParameter(
            "holds a name or a password before an @, and every page would show it; leave it out",
            param_hint="--url",
        )
    if not URL.fullmatch(url):
        raise typer.BadParameter(
            f"{url!r} is not an address such as https://example.org/head/", param_hint="--url"
        )
    return url if url.endswith("/") else f"{url}/"
