"""The report: one page that stands alone, with every image, figure and part."""

from __future__ import annotations

import base64
import io
import re
from dataclasses import replace

import numpy as np
import pytest
from PIL import Image

from avatar_export.measure.poses import poses
from avatar_export.measure.report import difference_factor, report_html
from avatar_export.measure.views import Shot, in_turn, views
from avatar_export.measure.yardstick import Measured, compare, pairs
from avatar_runtime.avatar import Avatar
from tests.avatars import full_avatar
from tests.pages import Page

SIZE = 32
PARTS = {"Gaussians <raw>": 12_345, "rig": 87_655}


def images_of(page: Page) -> list[np.ndarray]:
    data = [base64.b64decode((image["src"] or "").partition("base64,")[2]) for image in page.all("img")]
    return [np.asarray(Image.open(io.BytesIO(one)).convert("RGB")).astype(int) for one in data]


@pytest.fixture(scope="module")
def other() -> Avatar:
    source = full_avatar()
    sh = source.gaussians.sh.copy()
    sh[:, 0] += np.float32(0.05)
    return replace(source, gaussians=replace(source.gaussians, sh=sh))


@pytest.fixture(scope="module")
def shots() -> list[Shot]:
    """Seven shots, five of a kind `a` and two of a kind `b`."""
    found = zip(poses(full_avatar(), 7), "aaaaabb", strict=True)
    chosen = [replace(named, kind=kind) for named, kind in found]
    return in_turn(chosen, views(full_avatar(), SIZE, chosen))


@pytest.fixture(scope="module")
def measured(shots: list[Shot], other: Avatar) -> Measured:
    return compare(full_avatar(), [other], shots, "reference")[0]


@pytest.fixture(scope="module")
def text(shots: list[Shot], other: Avatar, measured: Measured) -> str:
    facts = {"licence": "<CC & BY>"}
    return report_html(full_avatar(), other, shots, measured, PARTS, title="A <head> & more", facts=facts)


def test_it_stands_alone_and_is_well_formed(text: str) -> None:
    page = Page(text)
    assert not page.open
    assert {tag for tag, _ in page.tags}.isdisjoint({"script", "link", "iframe", "object"})
    for _, attrs in page.tags:
        for name in ("src", "href"):
            assert (attrs.get(name) or "data:").startswith("data:")
    assert "http://" not in text and "https://" not in text and "url(" not in text
    assert "A &lt;head&gt; &amp; more" in text and "&lt;CC &amp; BY&gt;" in text


def test_images_are_source_pack_and_amplified_difference(
    text: str, shots: list[Shot], other: Avatar, measured: Measured
) -> None:
    images = images_of(Page(text))
    assert len(images) == 2 * 2 * 3, "the worst of each kind, and a typical one"
    named = re.findall("<h3>(.*?)</h3>", text)
    assert [named[0], named[2]] == [measured.shots[at] for _, _, at in measured.by_kind()]
    drawn = [shot for name in named for shot in shots if shot.name == name]
    factor = difference_factor(measured)
    assert f"difference × {factor}<" in text and f"{factor} times amplified" in text
    for index, pair in enumerate(pairs(full_avatar(), other, drawn, "reference")):
        want = (pair.source, pair.other, np.abs(pair.other - pair.source) * factor)
        for image, wanted in zip(images[3 * index : 3 * index + 3], want, strict=True):
            assert image.shape == (SIZE, SIZE, 3)
            bytes_wanted = 255 * np.clip(wanted, 0, 1)
            assert np.abs(image - bytes_wanted).mean() < 8  # lossy images
            assert image.mean() == pytest.approx(bytes_wanted.mean(), rel=0.2)


def test_figures_that_are_not_there(shots: list[Shot], other: Avatar, measured: Measured) -> None:
    nowhere = np.full_like(measured.inside, np.nan)
    bare = replace(measured, inside=nowhere, largest=nowhere, position_error=None)
    text = report_html(full_avatar(), other, shots, bare, {}, title="empty")
    assert "nan" not in text.partition("<h2>Images")[0] and "position error" not in text
    assert "PSNR of the whole image, mean" in text and "inside the outline, mean" not in text
    equal = replace(measured, inside=np.full_like(measured.inside, 150.0), whole=measured.whole * np.inf)
    assert "equal" in report_html(full_avatar(), other, shots, equal, {}, title="equal")
