"""Folders that any web server or file host serves, and pages that are one file.

One avatar: the folder is its page. Several: the folder's index.html is a gallery, and each avatar has a folder of its
own with its page, because link previews are read without running a script. Links name index.html, since not every
file host looks for it. All addresses are relative, so the folder may lie anywhere.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from avatar_export.serving import cards, page
from avatar_export.serving.gallery import gallery
from avatar_export.serving.session import Shown, session
from avatar_export.serving.site_folder import addressed

Files = dict[str, bytes]


@dataclass(frozen=True)
class _Place:
    """Where the files of an avatar lie in a published folder."""

    pack: str
    preview: str
    card: str | None  # JPEG of link previews

    def card_below(self, url: str | None) -> str | None:
        """The card's absolute address; None without one."""
        return None if url is None or self.card is None else url + self.card


def single(avatar: Shown, title: str | None = None) -> str:
    """One HTML page with the viewer and the pack in it, which opens from a disk.

    Raises AvatarError if the viewer page is not installed.
    """
    files = page.page_files()
    index = files.pop(page.INDEX).decode()
    preview = page.data_address("preview.webp", avatar.preview) if avatar.preview else None
    pack = page.data_address("pack.avatar", avatar.pack)
    called = replace(avatar, name=title or avatar.name)
    said = session([called], [pack], [preview], live=False, events=False)
    metas = cards.metas(called.name, cards.description([avatar]), None, None)
    index = page.with_files_at(index, {name: page.data_address(name, data) for name, data in files.items()})
    return page.with_head(index, called.name, metas, page.session_element(said))


def site(avatars: Sequence[Shown], url: str | None = None, title: str | None = None) -> Files:
    """The files of a published folder by their paths; with `url`, its future address, pages have link previews.

    Raises AvatarError if the viewer page is not installed, and for an avatar that cannot be drawn.
    """
    viewer = page.page_files()
    index = viewer.pop(page.INDEX).decode()
    files: Files = {}
    stored = {name: _store(files, f"viewer/{name}", data) for name, data in viewer.items()}
    places = [_own_files(files, avatar, url is not None) for avatar in avatars]
    if len(avatars) == 1:
        files[page.INDEX] = _player(index, stored, avatars[0], places[0], "", url, title)
        return files
    for avatar, place in zip(avatars, places, strict=True):
        folder = f"{avatar.id}/"
        files[folder + page.INDEX] = _player(index, stored, avatar, place, folder, url, None)
    heading = title or f"{len(avatars)} avatars"
    pages = [f"{avatar.id}/{page.INDEX}" for avatar in avatars]
    tiles = zip(avatars, pages, [place.preview for place in places], strict=True)
    metas = cards.metas(heading, cards.description(avatars), url, places[0].card_below(url))
    files[page.INDEX] = page.with_head(gallery(heading, tiles), heading, metas).encode()
    return files


def _own_files(files: Files, avatar: Shown, carded: bool) -> _Place:
    """Stores the files of an avatar; `carded`: also the picture of link previews."""
    picture = cards.still(avatar)
    return _Place(
        _store(files, f"packs/{avatar.id}.avatar", avatar.pack),
        _store(files, f"previews/{avatar.id}.webp", picture),
        _store(files, f"previews/{avatar.id}.jpg", cards.card(picture)) if carded else None,
    )


def _store(files: Files, path: str, data: bytes) -> str:
    """Adds a file, and returns the path that it has."""
    own = addressed(path, data)
    files[own] = data
    return own


def _player(
    index: str,
    viewer: Mapping[str, str],
    avatar: Shown,
    place: _Place,
    folder: str,
    url: str | None,
    title: str | None,
) -> bytes:
    """The page of one avatar in `folder`, which is "" or ends with a slash. It holds its session: both change in one
    step."""
    up = "../" if folder else ""
    called = replace(avatar, name=title or avatar.name)
    said = session([called], [up + place.pack], [up + place.preview], live=False, events=False)
    own = None if url is None else f"{url}{folder}"
    metas = cards.metas(called.name, cards.description([avatar]), own, place.card_below(url))
    html = page.with_files_at(index, {name: up + path for name, path in viewer.items()})
    return page.with_head(html, called.name, metas, page.session_element(said)).encode()
