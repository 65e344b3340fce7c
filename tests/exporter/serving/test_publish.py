"""Published folders and single pages, read as a browser and a crawler read them."""

from __future__ import annotations

import base64
import hashlib
import io
import json
import re
from collections.abc import Mapping
from dataclasses import replace
from fnmatch import fnmatch
from html.parser import HTMLParser
from pathlib import Path, PurePosixPath
from typing import Any

import pytest
from PIL import Image

from avatar_export.serving import publish
from avatar_export.serving.page import page_files
from avatar_export.serving.session import identity
from avatar_export.serving.sources import sources_of
from tests.exporter.serving.packs import HOSTILE, of, packed

URL = "https://example.org/people/"


class Seen(HTMLParser):
    """The elements of a page, as the standard parser sees them."""

    def __init__(self, page: str) -> None:
        super().__init__()
        self.tags: list[tuple[str, dict[str, str | None]]] = []
        self.text: dict[str, list[str]] = {}
        self._open: list[str] = []
        self.feed(page)
        self.close()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append((tag, dict(attrs)))
        if tag not in ("meta", "link", "img"):
            self._open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        self._open.pop()

    def handle_data(self, data: str) -> None:
        if self._open:
            self.text.setdefault(self._open[-1], []).append(data)

    def all(self, tag: str) -> list[dict[str, str | None]]:
        return [attributes for name, attributes in self.tags if name == tag]

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


def one(files: Mapping[str, bytes], pattern: str) -> bytes:
    [path] = [path for path in files if fnmatch(path, pattern)]
    return files[path]


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
    assert (said["live"], said["events"]) == (False, False)
    assert files[said["avatars"][0]["file"]] == packed("Head", "CC BY 4.0")
    assert files[said["avatars"][0]["preview"]][8:12] == b"WEBP"
    seen = Seen(files["index.html"].decode())
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
        assert avatar["id"] == own
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
        assert (
            metas["twitter:card"] == "summary_large_image" and metas["og:description"] == metas["description"]
        )
    assert "CC BY 4.0" in str(Seen(files["head/index.html"].decode()).metas()["og:description"])
    with Image.open(io.BytesIO(one(files, "previews/head.*.jpg"))) as image:
        assert (image.format, image.size) == ("JPEG", (1200, 630))
        assert len(image.convert("L").getcolors(1 << 16) or []) > 20, "the avatar is drawn"


@pytest.mark.parametrize("name", HOSTILE)
def test_hostile_names_stay_text(name: str) -> None:
    avatar = of("x", name, name)
    files = publish.site([avatar, of("y")], URL)
    plain = publish.site([of("x"), of("y")], URL)
    for path in ("index.html", "x/index.html"):
        seen, other = Seen(files[path].decode()), Seen(plain[path].decode())
        kinds = [tag for tag, _ in seen.tags if tag != "small"]
        assert kinds == [tag for tag, _ in other.tags], "no element more than for a harmless name"
        assert [set(a) for t, a in seen.tags if t != "small"] == [set(a) for _, a in other.tags]
    assert "".join(Seen(files["x/index.html"].decode()).text["title"]) == name
    assert "".join(Seen(files["index.html"].decode()).text["strong"]) == name + "Head"
    assert Seen(files["x/index.html"].decode()).metas()["og:title"] == name
    assert inline(Seen(files["x/index.html"].decode()))["avatars"][0]["name"] == name
    assert all(".." not in PurePosixPath(path).parts and not path.startswith("/") for path in files)
    seen = Seen(publish.single(avatar))
    assert inline(seen)["avatars"][0]["name"] == inline(seen)["avatars"][0]["license"] == name
    assert [tag for tag, _ in seen.tags] == [tag for tag, _ in Seen(publish.single(of("x"))).tags]


@pytest.mark.more
def test_an_avatar_without_a_preview_is_drawn() -> None:
    files = publish.site([replace(of("head"), preview=None)], URL)
    with Image.open(io.BytesIO(one(files, "previews/head.*.webp"))) as image:
        assert len(image.convert("L").getcolors(1 << 16) or []) > 20


def test_a_single_page_holds_everything() -> None:
    page = publish.single(of("head"))
    seen = Seen(page)
    files = page_files()
    files.pop("index.html")
    found = {data(address) for address in addresses(seen)}
    assert found == set(files.values()), "each file of the page, and nothing else"
    assert all(address.startswith("data:") for address in addresses(seen))
    said = inline(seen)
    assert data(said["avatars"][0]["file"]) == packed() and said["events"] is False
    assert "<" not in next(t for t in seen.text["script"] if t.startswith("{"))
    types = {address.partition(";")[0] for address in addresses(seen)}
    assert types == {"data:text/javascript", "data:text/css"}


@pytest.mark.parametrize("one_file", [True, False])
def test_the_title_is_the_name_that_the_page_shows(one_file: bool) -> None:
    page = (
        publish.single(of("head"), "Me")
        if one_file
        else publish.site([of("head")], URL, "Me")["index.html"].decode()
    )
    seen = Seen(page)
    assert seen.text["title"] == ["Me"] and inline(seen)["avatars"][0]["name"] == "Me"
    assert one_file or seen.metas()["og:title"] == "Me"


@pytest.mark.parametrize("name", ["con", "CON", "aux", "nul", "prn", "com1", "LPT9", "com\u00b9"])
def test_no_id_is_a_device_of_windows(name: str, tmp_path: Path) -> None:
    found = [source.id for source in sources_of([tmp_path / f"{name}.avatar", tmp_path / name])]
    assert found == [f"avatar-{name.lower().replace(chr(0xB9), '1')}", f"{found[0]}-2"]
    assert identity("console", ()) == "console" and identity("com10", ()) == "com10"
