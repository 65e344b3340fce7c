"""The report: one page that stands alone, with every image, figure and part."""

from __future__ import annotations

import base64
import io
import re
from dataclasses import replace
from html.parser import HTMLParser

import numpy as np
import pytest
from PIL import Image

from avatar_export.measure.poses import poses
from avatar_export.measure.report import difference_factor, report_html
from avatar_export.measure.views import views
from avatar_export.measure.yardstick import Measured, Yardstick
from avatar_runtime.avatar import Avatar
from tests.avatars import full_avatar

SIZE = 32
PARTS = {"Gaussians <raw>": 12_345, "rig": 87_655}


class Page(HTMLParser):
    """Tags with their attributes, and whether every tag that opens is closed."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.tags: list[tuple[str, dict[str, str | None]]] = []
        self.open: list[str] = []
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append((tag, dict(attrs)))
        if tag not in ("meta", "img", "br"):
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def images(self) -> list[np.ndarray]:
        """The pixels of every image."""
        sources = [attrs["src"] or "" for tag, attrs in self.tags if tag == "img"]
        data = [base64.b64decode(source.removeprefix("data:image/webp;base64,")) for source in sources]
        return [np.asarray(Image.open(io.BytesIO(one)).convert("RGB")).astype(int) for one in data]


@pytest.fixture(scope="module")
def other() -> Avatar:
    source = full_avatar()
    sh = source.gaussians.sh.copy()
    sh[:, 0] += np.float32(0.05)
    return replace(source, gaussians=replace(source.gaussians, sh=sh))


@pytest.fixture(scope="module")
def yardstick() -> Yardstick:
    chosen = poses(full_avatar())[3:5]
    return Yardstick(full_avatar(), chosen, views(full_avatar(), SIZE, chosen), "reference")


@pytest.fixture(scope="module")
def measured(yardstick: Yardstick, other: Avatar) -> Measured:
    return yardstick.measure(other)


@pytest.fixture(scope="module")
def text(yardstick: Yardstick, other: Avatar, measured: Measured) -> str:
    return report_html(
        yardstick, other, measured, PARTS, title="A <head> & more", facts={"licence": "<CC & BY>"}
    )


def test_it_stands_alone_and_is_well_formed(text: str) -> None:
    page = Page(text)
    assert not page.open
    assert {tag for tag, _ in page.tags}.isdisjoint({"script", "link", "iframe", "object"})
    for _, attrs in page.tags:
        for name in ("src", "href"):
            assert (attrs.get(name) or "data:").startswith("data:")
    assert "http://" not in text and "https://" not in text and "url(" not in text


def test_text_from_an_avatar_is_escaped(text: str) -> None:
    assert "A &lt;head&gt; &amp; more" in text and "&lt;CC &amp; BY&gt;" in text
    assert "Gaussians &lt;raw&gt;" in text


def test_images_are_source_pack_and_amplified_difference(
    text: str, yardstick: Yardstick, other: Avatar, measured: Measured
) -> None:
    images = Page(text).images()
    assert len(images) == 2 * 3 * 3
    factor = difference_factor(measured)
    assert f"difference × {factor}<" in text and f"{factor} times amplified" in text
    for index, pair in enumerate(yardstick.pairs(other)):
        want = (pair.source, pair.other, np.abs(pair.other - pair.source) * factor)
        for image, wanted in zip(images[3 * index : 3 * index + 3], want, strict=True):
            assert image.shape == (SIZE, SIZE, 3)
            bytes_wanted = 255 * np.clip(wanted, 0, 1)
            assert np.abs(image - bytes_wanted).mean() < 8  # lossy images
            assert image.mean() == pytest.approx(bytes_wanted.mean(), rel=0.2)


def test_figures_and_bytes_stand_in_tables(text: str, measured: Measured) -> None:
    for value in (*measured.inside.ravel(), *measured.whole.ravel()):
        assert f"{value:.1f} dB" in text
    rows = [re.sub("<[^>]*>", " ", row).split() for row in re.findall("<tr>.*?</tr>", text)]
    assert ["Gaussians", "&lt;raw&gt;", "12,345", "12.3%"] in rows
    assert ["rig", "87,655", "87.7%"] in rows and ["all", "100,000"] in rows
    assert "100.0 kB" in text


@pytest.mark.parametrize(("decibel", "factor"), [(150, 1000), (60, 100), (40, 10), (3, 1), (-150, 1)])
def test_the_factor_makes_a_typical_error_visible(measured: Measured, decibel: float, factor: int) -> None:
    at = replace(measured, inside=np.full_like(measured.inside, decibel))
    assert difference_factor(at) == factor


def test_figures_that_are_not_there(yardstick: Yardstick, other: Avatar, measured: Measured) -> None:
    bare = replace(measured, inside=np.full_like(measured.inside, np.nan), position_error=None)
    text = report_html(yardstick, other, bare, {}, title="empty")
    assert "nan" not in text.partition("<h2>Images")[0] and "position error" not in text
    equal = replace(measured, inside=np.full_like(measured.inside, 150.0), whole=measured.whole * np.inf)
    assert "equal" in report_html(yardstick, other, equal, {}, title="equal")
