"""The first page of several avatars: a tile with a name for each, without a script.

Its look and its elements are those of the viewer page's own gallery (players/web/viewer/gallery.ts and viewer.css).
"""

from __future__ import annotations

import html
from collections.abc import Iterable

from avatar_export.serving.session import Shown

SHORT = 40  # letters; a longer licence stands on the avatar's own page
PAGE = """<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1, viewport-fit=cover">
<meta name="color-scheme" content="dark light">
<title>Avatars</title>
<link rel="icon" href="data:,">
<link rel="stylesheet" href="viewer.css">
</head>
<body>
<main id="gallery">
<h1>HEADING</h1>
<ul id="tiles">
TILES
</ul>
</main>
</body>
</html>
"""


def gallery(title: str, tiles: Iterable[tuple[Shown, str, str, float]]) -> str:
    """The page with a tile for each (avatar, address of its page, address and scale of its poster)."""
    shown = "\n".join(_tile(*tile) for tile in tiles)
    parts = PAGE.partition("HEADING")
    start, _, end = parts[2].partition("TILES")
    return f"{parts[0]}{html.escape(title)}{start}{shown}{end}"


def _tile(avatar: Shown, address: str, picture: str, scale: float) -> str:
    licence = avatar.license if avatar.license and len(avatar.license) <= SHORT else None
    terms = f"<small>{html.escape(licence)}</small>" if licence else ""
    return (
        f'<li><a href="{html.escape(address)}"><span class="picture">'
        f'<img src="{html.escape(picture)}" style="--scale:{scale:.4f}" alt="" loading="lazy"></span>'
        f"<strong>{html.escape(avatar.name)}</strong>{terms}</a></li>"
    )
