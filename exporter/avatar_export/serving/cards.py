"""Link previews: the picture and the meta tags that messengers and social sites show for an address."""

from __future__ import annotations

import io
from collections.abc import Sequence
from textwrap import shorten

from PIL import Image

from avatar_export.measure.framing import preview_webp
from avatar_export.serving.session import Shown
from avatar_runtime.packs import decode_pack, placed

Meta = tuple[str, str, str]  # attribute, name, content
CARD = (1200, 630)  # pixels: the size that link previews are made for
GROUND = (236, 238, 240)  # sRGB behind the avatar
LONGEST = 160  # letters of the terms in a description
QUALITY = 88  # of JPEG


def still(avatar: Shown) -> bytes:
    """A WebP image of the avatar: the pack's own, or one that is drawn now."""
    return avatar.preview or preview_webp(placed(decode_pack(avatar.pack, avatar.id).avatar))


def card(webp: bytes) -> bytes:
    """A JPEG of CARD pixels with the image in its middle."""
    with Image.open(io.BytesIO(webp)) as image:
        picture = image.convert("RGBA")
    height = CARD[1]
    picture = picture.resize(
        (max(1, round(picture.width * height / picture.height)), height), Image.Resampling.LANCZOS
    )
    ground = Image.new("RGB", CARD, GROUND)
    ground.paste(picture, ((CARD[0] - picture.width) // 2, 0), picture)
    out = io.BytesIO()
    ground.save(out, "JPEG", quality=QUALITY, optimize=True)
    return out.getvalue()


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
