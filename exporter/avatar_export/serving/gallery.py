"""The first page of several avatars: a tile with a name for each, without a script."""

from __future__ import annotations

import html
from collections.abc import Iterable

from avatar_export.serving.session import Shown

PAGE = """<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>Avatars</title>
<link rel="icon" href="data:,">
<style>
:root { color-scheme: light dark; font-family: system-ui, sans-serif; }
body { margin: 2rem auto; max-width: 70rem; padding: 0 1rem; }
ul { display: grid; gap: 1rem; list-style: none; padding: 0; }
ul { grid-template-columns: repeat(auto-fill, minmax(12rem, 1fr)); }
a { border: 1px solid #8886; border-radius: .5rem; display: block; overflow: hidden; }
a { color: inherit; text-decoration: none; }
a:hover, a:focus-visible { outline: 2px solid #2a8; }
img { aspect-ratio: 1; background: #8882; display: block; height: auto; object-fit: contain; width: 100%; }
strong, small { display: block; margin: .5rem .75rem; overflow-wrap: anywhere; }
</style>
</head>
<body>
<h1>HEADING</h1>
<ul>
TILES
</ul>
</body>
</html>
"""


def gallery(title: str, tiles: Iterable[tuple[Shown, str, str]]) -> str:
    """The page with a tile for each (avatar, address of its page, address of its picture)."""
    shown = "\n".join(_tile(avatar, address, picture) for avatar, address, picture in tiles)
    parts = PAGE.partition("HEADING")
    start, _, end = parts[2].partition("TILES")
    return f"{parts[0]}{html.escape(title)}{start}{shown}{end}"


def _tile(avatar: Shown, address: str, picture: str) -> str:
    terms = f"<small>{html.escape(avatar.license)}</small>" if avatar.license else ""
    return (
        f'<li><a href="{html.escape(address)}"><img src="{html.escape(picture)}" alt="" loading="lazy">'
        f"<strong>{html.escape(avatar.name)}</strong>{terms}</a></li>"
    )
