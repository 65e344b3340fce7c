"""Link previews: the meta tags that messengers and social sites read at an address."""

from __future__ import annotations

from collections.abc import Sequence
from textwrap import shorten

from avatar_export.serving.poster import CARD
from avatar_export.serving.session import Shown

Meta = tuple[str, str, str]  # attribute, name, content
LONGEST = 160  # letters of the terms in a description


def description(avatars: Sequence[Shown]) -> str:
    """One sentence, and the terms where one avatar states them."""
    if len(avatars) > 1:
        return f"{len(avatars)} animatable avatars of 3D Gaussians."
    terms = (
        shorten(f"Licence: {avatars[0].license}", LONGEST, placeholder=" ...") if avatars[0].license else ""
    )
    return f"An animatable avatar of 3D Gaussians.{terms and f' {terms}'}"


def metas(title: str, said: str, url: str | None, picture: str | None) -> list[Meta]:
    """The tags of a page at the absolute address `url` with the absolute address of its `picture`; None: no card."""
    own: list[Meta] = [("name", "description", said)]
    if url is None or picture is None:
        return own
    return [
        *own,
        ("property", "og:type", "website"),
        ("property", "og:title", title),
        ("property", "og:description", said),
        ("property", "og:url", url),
        ("property", "og:image", picture),
        ("property", "og:image:type", "image/jpeg"),
        ("property", "og:image:width", str(CARD[0])),
        ("property", "og:image:height", str(CARD[1])),
        ("property", "og:image:alt", title),
        ("name", "twitter:card", "summary_large_image"),
    ]
