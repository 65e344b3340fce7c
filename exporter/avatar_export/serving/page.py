"""The viewer page: its files, and how one page is made of it with other contents of the head.

players/web builds the files of `viewer_page`. The page asks for its own files by attributes `src` and `href` of
index.html only, and has one element `title` and one image `poster`: so everything can be inlined, and a published page
says its name and shows its picture before a script runs.
"""

from __future__ import annotations

import base64
import html
import re
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from avatar_export.serving.poster import Poster
from avatar_export.serving.session import compact
from avatar_runtime.io.errors import AvatarError

FOLDER = Path(__file__).resolve().parents[1] / "viewer_page"
INDEX = "index.html"
TYPES = {  # suffix: content type
    ".html": "text/html; charset=utf-8",
    ".js": "text/javascript; charset=utf-8",
    ".css": "text/css; charset=utf-8",
    ".json": "application/json; charset=utf-8",
    ".wasm": "application/wasm",
    ".avatar": "application/octet-stream",
    ".task": "application/octet-stream",
    ".gz": "application/gzip",
    ".webp": "image/webp",
    ".jpg": "image/jpeg",
    ".png": "image/png",
    ".svg": "image/svg+xml",
}
TITLE = re.compile("<title>[^<]*</title>")
POSTER = re.compile('<img id="poster"[^>]*>')
REFERENCE = re.compile(r"""\b(src|href)=(["'])(?:\./)?([^"'/:#?]+)\2""")


def page_files() -> dict[str, bytes]:
    """The files of the viewer page by name. Raises AvatarError where the page was not installed."""
    files = (
        {p.name: p.read_bytes() for p in sorted(FOLDER.glob("*")) if p.suffix in TYPES}
        if FOLDER.is_dir()
        else {}
    )
    if INDEX not in files:
        raise AvatarError("the viewer page is missing; install avatar-export again", file=FOLDER / INDEX)
    return files


def content_type(name: str) -> str:
    """The content type of a file by its suffix, which must be one of TYPES."""
    return TYPES[Path(name).suffix]


def with_head(page: str, title: str, metas: Iterable[tuple[str, str, str]] = (), more: str = "") -> str:
    """`page` with the plain text `title`, a line for each meta (attribute, name, content), and the HTML `more`."""
    lines = [f"<title>{html.escape(title)}</title>"]
    lines += [
        f'<meta {attribute}="{html.escape(name)}" content="{html.escape(content)}">'
        for attribute, name, content in metas
    ]
    head = "\n".join([*lines, *([more] if more else [])])
    return TITLE.sub(lambda _: head, page, count=1)


def with_poster(page: str, name: str, address: str, poster: Poster) -> str:
    """`page` with the picture of the avatar `name` at an address, over what the avatar was trained over."""
    style = f"--aspect:{poster.aspect:.4f};--scale:{poster.scale:.4f}"
    image = f'<img id="poster" class="framed" style="{style}" alt="{html.escape(name)}" src="{html.escape(address)}">'
    if poster.background is not None:
        parts = " ".join(str(round(255 * part)) for part in poster.background)
        page = page.replace("</head>", f"<style>:root{{--stage:rgb({parts})}}</style>\n</head>", 1)
    return POSTER.sub(lambda _: image, page, count=1)


def with_files_at(page: str, addresses: Mapping[str, str]) -> str:
    """`page` with other addresses of the files that its attributes name."""

    def moved(found: re.Match[str]) -> str:
        attribute, quote, name = found.groups()
        if name not in addresses:
            return found[0]
        return f"{attribute}={quote}{html.escape(addresses[name])}{quote}"

    return REFERENCE.sub(moved, page)


def data_address(name: str, data: bytes) -> str:
    """A `data:` address with the contents of a file; base64 holds no character that HTML or JSON knows."""
    return f"data:{content_type(name).replace(' ', '')};base64,{base64.b64encode(data).decode()}"


def session_element(session: Mapping[str, Any]) -> str:
    """The session inside the page. No text in it can end the element: `<` is written as JSON's own escape."""
    text = compact(session).replace("<", "\\u003c").replace("\u2028", "\\u2028").replace("\u2029", "\\u2029")
    return f'<script type="application/json" id="session">{text}</script>'
