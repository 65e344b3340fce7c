"""Published folders and single pages, read as a browser and a crawler read them."""

from __future__ import annotations

import base64
import hashlib
import io
import json
import re
from functools import cache
from pathlib import PurePosixPath
from typing import Any

import pytest
from PIL import Image

from avatar_export.serving import publish
from avatar_export.serving.page import page_files
from tests.exporter.serving.packs import HOSTILE, of, packed
from tests.pages import Page

URL = "https://example.org/people/"


class Seen(Page):
    def metas(self) -> dict[str | None, str | None]:
        return {m.get("property", m.get("name")): m.get("content") for m in self.all("meta")}


def addresses(seen: Seen) -> list[str]:
    found = [attributes.get(key) for _, attributes in seen.tags for key in ("src", "href")]
    return [address for address in found if address and not address.startswith(("#", "data:,"))]


def hashed(path: str, data: bytes) -> bool:
    """Whether a path names its contents: NAME.HASH.SUFFIX."""
    return hashlib.sha256(data).hexdigest().startswith(path.split(".")[-2]) and len(path.split(".")[-2]) == 16


def inline(seen: Seen) -> Any:
    [element] = [a for a in seen.all("script") if a.get("id") == "session"]
    assert element["type"] == "application/json"
    [text] = [t for t in seen.text["script"] if t.startswith("{")]
    return json.loads(text)


def data(address: str) -> bytes:
    return base64.b64decode(address.partition(";base64,")[2], validate=True)


def test_one_avatar_is_the_page_itself() -> None:
    files = publish.site([of("head", license="CC BY 4.0")])
    assert {re.sub(r"[.][0-9a-f]{16}[.]", ".", path) for path in files} == {
        *("index.html", "packs/head.avatar", "previews/head.webp"),
        *(f"viewer/{name}" for name in page_files() if name != "index.html"),
    }
    assert all(hashed(path, data) for path, data in files.items() if path != "index.html")
    said = inline(Seen(files["index.html"].decode()))
    assert (said["live"], said["events"], said["present"], said["gallery"]) == (False, False, True, None)
    assert files[said["avatars"][0]["file"]] == packed("Head", "CC BY 4.0")
    assert files[said["avatars"][0]["preview"]][8:12] == b"WEBP"
    seen = Seen(files["index.html"].decode())
    [poster] = [image for image in seen.all("img") if image.get("id") == "poster"]
    assert (poster["src"], poster["alt"]) == (said["avatars"][0]["preview"], "Head")
    assert seen.text["title"] == ["Head"] and "og:title" not in seen.metas()
    assert all(address in files for address in addresses(seen)) and len(addresses(seen)) >= 2


def test_several_avatars_make_a_gallery_and_have_pages_of_their_own() -> None:
    files = publish.site([of("head"), of("body", "Body")], None, "Two <people>")
    seen = Seen(files["index.html"].decode())
    assert seen.text["title"] == seen.text["h1"] == ["Two <people>"]
    assert [a["href"] for a in seen.all("a")] == ["head/index.html", "body/index.html"]
    assert [t for t in seen.text["strong"]] == ["Head", "Body"]
    assert not seen.all("script") and all(address in files for address in addresses(seen))
    for own, name in (("head", "Head"), ("body", "Body")):
        page = Seen(files[f"{own}/index.html"].decode())
        assert page.text["title"] == [name]
        [avatar] = inline(page)["avatars"]
        assert avatar["id"] == own and inline(page)["gallery"] == "../index.html"
        for address in (*addresses(page), avatar["file"], avatar["preview"]):
            assert address.startswith("../") and address.removeprefix("../") in files


def test_link_previews_are_absolute_and_jpeg() -> None:
    files = publish.site([of("head", license="CC BY 4.0"), of("body", "Body")], URL)
    for page, own, title, picture in (
        ("index.html", "", "2 avatars", "head"),
        ("head/index.html", "head/", "Head", "head"),
        ("body/index.html", "body/", "Body", "body"),
    ):
        metas = Seen(files[page].decode()).metas()
        assert metas["og:title"] == title and metas["og:url"] == URL + own
        card = str(metas["og:image"]).removeprefix(URL)
        assert re.fullmatch(rf"previews/{picture}\.[0-9a-f]{{16}}\.jpg", card) and hashed(card, files[card])
        assert metas["twitter:card"] == "summary_large_image"
        assert metas["og:description"] == metas["description"]
    assert "CC BY 4.0" in str(Seen(files["head/index.html"].decode()).metas()["og:description"])
    with Image.open(io.BytesIO(next(data for path, data in files.items() if path.endswith(".jpg")))) as image:
        assert (image.format, image.size) == ("JPEG", (1200, 630))
        assert len(image.convert("L").getcolors(1 << 16) or []) > 20, "the avatar is drawn"


@cache
def harmless() -> tuple[publish.Files, str]:
    return publish.site([of("x"), of("y")], URL), publish.single(of("x"))


@pytest.mark.parametrize("name", HOSTILE)
def test_hostile_names_stay_text(name: str) -> None:
    avatar = of("x", name, name)
    files, (plain, plain_single) = publish.site([avatar, of("y")], URL), harmless()
    for path in ("index.html", "x/index.html"):
        kinds = [
            [(tag, set(names)) for tag, names in Seen(one[path].decode()).tags if tag != "small"]
            for one in (files, plain)
        ]
        assert kinds[0] == kinds[1], "no element and no attribute more than for a harmless name"
    own = Seen(files["x/index.html"].decode())
    assert "".join(own.text["title"]) == own.metas()["og:title"] == inline(own)["avatars"][0]["name"] == name
    assert "".join(Seen(files["index.html"].decode()).text["strong"]) == name + "Head"
    assert all(".." not in PurePosixPath(path).parts and not path.startswith("/") for path in files)
    seen = Seen(publish.single(avatar))
    assert inline(seen)["avatars"][0]["name"] == inline(seen)["avatars"][0]["license"] == name
    assert [tag for tag, _ in seen.tags] == [tag for tag, _ in Seen(plain_single).tags]


def test_a_single_page_holds_everything() -> None:
    seen = Seen(publish.single(of("head")))
    files = {name: data for name, data in page_files().items() if name != "index.html"}
    found = {data(address) for address in addresses(seen)}
    [poster] = found - set(files.values())
    assert set(files.values()) < found and poster[8:12] == b"WEBP"
    assert {address.partition(";")[0].partition("/")[2] for address in addresses(seen)} == {
        "javascript",
        "css",
        "webp",
    }
    said = inline(seen)
    assert data(said["avatars"][0]["file"]) == packed() and said["events"] is False
    assert "<" not in next(t for t in seen.text["script"] if t.startswith("{"))
