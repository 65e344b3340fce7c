"""Folders that any web server or file host serves, and pages that are one file.

One avatar: the folder is its page. Several: the folder's index.html is a gallery, and each avatar has a folder of its
own with its page, because link previews are read without running a script. Links name index.html, since not every
file host looks for it. All addresses are relative, so the folder may lie anywhere.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from avatar_export.serving import cards, page
from avatar_export.serving.gallery import gallery
from avatar_export.serving.session import Shown, compact, session
from avatar_export.version import GENERATOR
from avatar_runtime.io.errors import AvatarError
from avatar_runtime.io.staging import followed, heal, staged

MARK = "avatar-export-site.json"  # by which a published folder is known as ours
RESERVED = ("packs", "previews", "viewer")  # folders; no avatar has such an id
Files = dict[str, bytes]


def single(avatar: Shown, title: str | None = None) -> str:
    """One HTML page with the viewer and the pack in it, which opens from a disk.

    Raises AvatarError if the viewer page is not installed.
    """
    files = page.page_files()
    index = files.pop(page.INDEX).decode()
    preview = page.data_address("preview.webp", avatar.preview) if avatar.preview else None
    pack = page.data_address("pack.avatar", avatar.pack)
    said = session([avatar], [pack], [preview], live=False, events=False)
    metas = cards.metas(avatar.name, cards.description([avatar]), None, None)
    index = page.with_files_at(index, {name: page.data_address(name, data) for name, data in files.items()})
    return page.with_head(index, title or avatar.name, metas, page.session_element(said))


def site(avatars: Sequence[Shown], url: str | None = None, title: str | None = None) -> Files:
    """The files of a published folder by their paths; with `url`, its future address, pages have link previews.

    Raises AvatarError if the viewer page is not installed, and for an avatar that cannot be drawn.
    """
    viewer = page.page_files()
    index = viewer.pop(page.INDEX).decode()
    files: Files = {MARK: f"{compact({'format': 'avatar-export-site', 'generator': GENERATOR})}\n".encode()}
    files |= {f"viewer/{name}": data for name, data in viewer.items()}
    for avatar in avatars:
        files |= _own_files(avatar, url)
    if len(avatars) == 1:
        return files | _player(index, viewer, avatars[0], "", url, title)
    for avatar in avatars:
        files |= _player(index, viewer, avatar, f"{avatar.id}/", url, None)
    heading = title or f"{len(avatars)} avatars"
    tiles = [(avatar, f"{avatar.id}/{page.INDEX}", f"previews/{avatar.id}.webp") for avatar in avatars]
    metas = cards.metas(heading, cards.description(avatars), url, _card_address(url, avatars[0]))
    files[page.INDEX] = page.with_head(gallery(heading, tiles), heading, metas).encode()
    return files


def _own_files(avatar: Shown, url: str | None) -> Files:
    picture = cards.still(avatar)
    files = {f"packs/{avatar.id}.avatar": avatar.pack, f"previews/{avatar.id}.webp": picture}
    return files | ({f"previews/{avatar.id}.jpg": cards.card(picture)} if url else {})


def _player(
    index: str, viewer: Mapping[str, bytes], avatar: Shown, folder: str, url: str | None, title: str | None
) -> Files:
    """The page of one avatar in `folder`, which is "" or ends with a slash."""
    up = "../" if folder else ""
    packs, previews = [f"{up}packs/{avatar.id}.avatar"], [f"{up}previews/{avatar.id}.webp"]
    said = session([avatar], packs, previews, live=False, events=False)
    own = None if url is None else f"{url}{folder}"
    heading = title or avatar.name
    metas = cards.metas(heading, cards.description([avatar]), own, _card_address(url, avatar))
    html = page.with_head(
        page.with_files_at(index, {name: f"{up}viewer/{name}" for name in viewer}), heading, metas
    )
    return {f"{folder}{page.INDEX}": html.encode(), f"{folder}session.json": compact(said).encode()}


def _card_address(url: str | None, avatar: Shown) -> str | None:
    return None if url is None else f"{url}previews/{avatar.id}.jpg"


def refuse_other(out: Path, force: bool) -> None:
    """Raises AvatarError if `out` exists and is neither empty nor a published folder, which `force` replaces."""
    if not out.exists() or (out.is_dir() and not any(out.iterdir())):
        return
    if not (out / MARK).is_file():
        raise AvatarError("exists and is not a published folder; it is not replaced", file=out)
    if not force:
        raise AvatarError("exists; pass --force to replace it", file=out)


def write_site(out: Path, files: Mapping[str, bytes], force: bool) -> None:
    """Writes a published folder completely or not at all. Raises AvatarError as `refuse_other`, and for a full disk."""
    out = followed(out)
    heal(out)
    refuse_other(out, force)
    with staged(out, force=force) as partial:
        for name, data in files.items():
            path = partial / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(data)
        refuse_other(out, force)
