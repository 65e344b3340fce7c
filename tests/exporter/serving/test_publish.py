"""Published folders and single pages, read as a browser and a crawler read them."""

from __future__ import annotations

import base64
import io
import json
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path, PurePosixPath
from typing import Any

import pytest
from PIL import Image

from avatar_export.serving import publish
from avatar_export.serving.page import page_files
from avatar_runtime.io.errors import AvatarError
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


def inline(seen: Seen) -> Any:
    [element] = [a for a in seen.all("script") if a.get("id") == "session"]
    assert element["type"] == "application/json"
    [text] = [t for t in seen.text["script"] if t.startswith("{")]
    return json.loads(text)


def data(address: str) -> bytes:
    return base64.b64decode(address.partition(";base64,")[2], validate=True)


def test_one_avatar_is_the_page_itself() -> None:
    files = publish.site([of("head", licence="CC BY 4.0")])
    assert set(files) == {
        *("index.html", "session.json", "packs/head.avatar", "previews/head.webp", publish.MARK),
        *(f"viewer/{name}" for name in page_files() if name != "index.html"),
    }
    said = json.loads(files["session.json"])
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
        said = json.loads(files[f"{own}/session.json"])
        [avatar] = said["avatars"]
        assert avatar["id"] == own
        for address in (*addresses(page), avatar["file"], avatar["preview"]):
            assert address.startswith("../") and address.removeprefix("../") in files


def test_link_previews_are_absolute_and_jpeg() -> None:
    files = publish.site([of("head", licence="CC BY 4.0"), of("body", "Body")], URL)
    for page, own, title, picture in (
        ("index.html", "", "2 avatars", "head"),
        ("head/index.html", "head/", "Head", "head"),
        ("body/index.html", "body/", "Body", "body"),
    ):
        metas = Seen(files[page].decode()).metas()
        assert metas["og:title"] == title and metas["og:url"] == URL + own
        assert metas["og:image"] == f"{URL}previews/{picture}.jpg"
        assert (
            metas["twitter:card"] == "summary_large_image" and metas["og:description"] == metas["description"]
        )
    assert "CC BY 4.0" in str(Seen(files["head/index.html"].decode()).metas()["og:description"])
    with Image.open(io.BytesIO(files["previews/head.jpg"])) as image:
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
    assert json.loads(files["x/session.json"])["avatars"][0]["name"] == name
    assert all(".." not in PurePosixPath(path).parts and not path.startswith("/") for path in files)
    seen = Seen(publish.single(avatar))
    assert inline(seen)["avatars"][0]["name"] == inline(seen)["avatars"][0]["license"] == name
    assert [tag for tag, _ in seen.tags] == [tag for tag, _ in Seen(publish.single(of("x"))).tags]


@pytest.mark.more
def test_an_avatar_without_a_preview_is_drawn() -> None:
    files = publish.site([replace(of("head"), preview=None)], URL)
    with Image.open(io.BytesIO(files["previews/head.webp"])) as image:
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


def test_an_existing_folder_is_replaced_only_if_it_is_ours(tmp_path: Path) -> None:
    out, files = tmp_path / "site", publish.site([of("head")])
    out.mkdir()
    publish.write_site(out, files, False)
    assert {p.relative_to(out).as_posix(): p.read_bytes() for p in out.rglob("*") if p.is_file()} == files
    with pytest.raises(AvatarError, match="exists; pass --force"):
        publish.write_site(out, files, False)
    publish.write_site(out, {publish.MARK: b"{}"}, True)
    assert [p.name for p in out.iterdir()] == [publish.MARK] and [p.name for p in tmp_path.iterdir()] == [
        "site"
    ]
    (tmp_path / "photos").mkdir()
    (tmp_path / "photos" / "me.jpg").write_bytes(b"x")
    (tmp_path / "file").write_bytes(b"x")
    for name in ("photos", "file"):
        with pytest.raises(AvatarError, match="is not a published folder; it is not replaced"):
            publish.write_site(tmp_path / name, files, True)
    assert (tmp_path / "photos" / "me.jpg").read_bytes() == b"x"


def test_a_failure_leaves_what_was_there(tmp_path: Path) -> None:
    out = tmp_path / "site"
    publish.write_site(out, {publish.MARK: b"{}", "index.html": b"old"}, False)
    too_long = {publish.MARK: b"{}", "index.html": b"new", "x" * 300: b""}
    with pytest.raises(AvatarError, match="site: cannot be written"):
        publish.write_site(out, too_long, True)
    assert (out / "index.html").read_bytes() == b"old"
    assert [p.name for p in tmp_path.iterdir()] == ["site"]
