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
from avatar_export.serving.poster import Poster, card, poster
from avatar_export.serving.session import Shown, session
from avatar_export.serving.site_folder import addressed
from avatar_export.serving.talk import talk_files

Files = dict[str, bytes]


@dataclass(frozen=True)
class _Place:
    """Where the files of an avatar lie in a published folder."""

    pack: str
    picture: str
    poster: Poster
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
    pack = page.data_address("pack.avatar", avatar.pack)
    called = replace(avatar, name=title or avatar.name)
    said = session([called], [pack], [None], present=True)
    metas = cards.metas(called.name, cards.description([avatar]), None, None)
    index = page.with_files_at(index, {name: page.data_address(name, data) for name, data in files.items()})
    drawn = poster(avatar)
    index = page.with_poster(index, called.name, page.data_address("poster.webp", drawn.webp), drawn)
    return page.with_head(index, called.name, metas, page.session_element(said))


def site(
    avatars: Sequence[Shown], url: str | None = None, title: str | None = None, *, talk: bool = False
) -> Files:
    """The files of a published folder by their paths; with `url`, its future address, pages have link previews.

    `talk`: also the files that let a visitor's camera drive the avatars.

    Raises AvatarError if the viewer page is not installed, and for an avatar that cannot be drawn.
    """
    viewer = page.page_files()
    index = viewer.pop(page.INDEX).decode()
    files: Files = {}
    stored = {name: _store(files, f"viewer/{name}", data) for name, data in viewer.items()}
    tracker = (
        {name: _store(files, f"talk/{name}", data) for name, data in talk_files().items()} if talk else None
    )
    places = [_own_files(files, avatar, url is not None) for avatar in avatars]
    if len(avatars) == 1:
        files[page.INDEX] = _player(index, stored, tracker, avatars[0], places[0], "", url, title)
        return files
    for avatar, place in zip(avatars, places, strict=True):
        folder = f"{avatar.id}/"
        files[folder + page.INDEX] = _player(index, stored, tracker, avatar, place, folder, url, None)
    heading = title or f"{len(avatars)} avatars"
    pages = [f"{avatar.id}/{page.INDEX}" for avatar in avatars]
    pictures = [(place.picture, place.poster.scale) for place in places]
    tiles = ((a, own, *picture) for a, own, picture in zip(avatars, pages, pictures, strict=True))
    metas = cards.metas(heading, cards.description(avatars), url, places[0].card_below(url))
    index = page.with_files_at(gallery(heading, tiles), stored)
    files[page.INDEX] = page.with_head(index, heading, metas).encode()
    return files


def _own_files(files: Files, avatar: Shown, carded: bool) -> _Place:
    """Stores the files of an avatar; `carded`: also the picture of link previews."""
    drawn = poster(avatar)
    return _Place(
        _store(files, f"packs/{avatar.id}.avatar", avatar.pack),
        _store(files, f"previews/{avatar.id}.webp", drawn.webp),
        drawn,
        _store(files, f"previews/{avatar.id}.jpg", card(drawn)) if carded else None,
    )


def _store(files: Files, path: str, data: bytes) -> str:
    """Adds a file, and returns the path that it has."""
    own = addressed(path, data)
    files[own] = data
    return own


def _player(
    index: str,
    viewer: Mapping[str, str],
    tracker: Mapping[str, str] | None,
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
    all_avatars = up + page.INDEX if folder else None
    talk = None if tracker is None else {name: up + path for name, path in tracker.items()}
    said = session(
        [called], [up + place.pack], [up + place.picture], present=True, gallery=all_avatars, talk=talk
    )
    own = None if url is None else f"{url}{folder}"
    metas = cards.metas(called.name, cards.description([avatar]), own, place.card_below(url))
    html = page.with_files_at(index, {name: up + path for name, path in viewer.items()})
    html = page.with_poster(html, called.name, up + place.picture, place.poster)
    return page.with_head(html, called.name, metas, page.session_element(said)).encode()
