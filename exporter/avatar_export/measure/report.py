"""A page that shows what a pack lost: images beside each other, figures, and the bytes of each part."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from html import escape

import numpy as np

from avatar_export.measure.page import cards, page, table, three
from avatar_export.measure.views import Shot
from avatar_export.measure.yardstick import LARGEST_DB, Measured, Pair, pairs
from avatar_runtime.avatar import Avatar

SHOWN = 0.15  # brightness that the typical error has in the images of differences
FACTORS = (1, 2, 5, 10, 20, 50, 100, 200, 500, 1000)


def report_html(
    source: Avatar,
    other: Avatar,
    shots: Sequence[Shot],
    measured: Measured,
    parts: Mapping[str, int],
    *,
    title: str,
    facts: Mapping[str, str] | None = None,
) -> str:
    """One HTML page that stands alone: no scripts, no files beside it, images inside.

    `measured` is of `other` against `source` in `shots`; the worst and a typical shot of each kind are drawn once more.
    `parts`: bytes of each part of the file, in the order of the table. `facts`: label -> text, shown above the tables.
    """
    factor = difference_factor(measured)
    body = [
        f"<h1>{escape(title)}</h1>",
        _explanation(measured),
        _cards(measured, sum(parts.values())),
        *([_facts(facts)] if facts else []),
        "<h2>Error by kind of poses</h2>",
        _figures(measured),
        "<h2>Bytes by part</h2>",
        _parts(parts),
        "<h2>Images</h2>",
        "<p>The worst image of each kind of poses, and a typical one. Each row shows the source, the pack, and their "
        f"difference: the absolute difference of each colour channel, <b>{factor} times amplified</b>. Black means no "
        "error.</p>",
        *_images(source, other, shots, measured, factor),
    ]
    return page(title, body)


def difference_factor(measured: Measured) -> int:
    """By how much differences are amplified, 1 to 1000, so that the typical error inside the mask is visible."""
    wanted = SHOWN * 10 ** (measured.mean / 20)  # the root of the mean squared error is 10^(-dB / 20)
    return max((factor for factor in FACTORS if factor <= wanted), default=FACTORS[0])


def _explanation(measured: Measured) -> str:
    width, height = measured.size
    return (
        f"<p>The pack was played against its source in {len(measured.shots)} poses that the search for its steps did "
        f"not see, at {width} × {height} pixels with backend <code>{escape(measured.backend)}</code>. PSNR compares "
        "the colours over black before any rounding; higher is better. If every colour is off by one step of an 8-bit "
        "image (1/255), the PSNR is 48.1 dB. “Inside the outline” counts only pixels that the source covers by more "
        "than half. The mean is that of the kind of poses that comes out worst.</p>"
    )


def _cards(measured: Measured, total: int) -> str:
    found = [
        ("size", _size(total)),
        (f"PSNR {measured.region}, mean", _db(measured.mean)),
        (f"PSNR {measured.region}, worst", _db(measured.worst)),
    ]
    if measured.worst_pixel is not None:
        found.append(("largest error of a pixel", f"{255 * measured.worst_pixel:.0f} of 255"))
    if measured.position_error is not None:
        found.append(("largest position error", _length(float(np.nanmax(measured.position_error)))))
    return cards(found)


def _facts(facts: Mapping[str, str]) -> str:
    rows = "".join(
        f"<tr><td>{escape(label)}</td><td>{escape(text)}</td></tr>" for label, text in facts.items()
    )
    return f'<div class="scroll"><table class="facts"><tbody>{rows}</tbody></table></div>'


def _figures(measured: Measured) -> str:
    rows = [
        (
            escape(kind),
            str(measured.kinds.count(kind)),
            _db(mean),
            f"{_db(float(measured.judged[at]))}<small>{escape(measured.shots[at])}</small>",
        )
        for kind, mean, at in measured.by_kind()
    ]
    return f"<p>PSNR {measured.region}.</p>" + table(("poses", "images", "mean", "worst"), rows)


def _parts(parts: Mapping[str, int]) -> str:
    total = sum(parts.values())
    rows = []
    for name, size in parts.items():
        share = size / total if total else 0.0
        bar = f'<span class="bar" style="width:{share:.2%}"></span>'
        rows.append((escape(name), f"{size:,}", f"{share:.1%}", bar))
    foot = f"<tfoot><tr><td>all</td><td>{total:,}</td><td></td><td></td></tr></tfoot>"
    return table(("part", "bytes", "share", ""), rows, foot)


def _images(
    source: Avatar, other: Avatar, shots: Sequence[Shot], measured: Measured, factor: int
) -> Iterator[str]:
    chosen = []
    for kind, mean, worst in measured.by_kind():
        others = [at for at, one in enumerate(measured.kinds) if one == kind and at != worst]
        chosen += [worst, *sorted(others, key=lambda at: abs(float(measured.judged[at]) - mean))[:1]]
    for at, pair in zip(
        chosen, pairs(source, other, [shots[at] for at in chosen], measured.backend), strict=True
    ):
        yield f"<h3>{escape(measured.shots[at])}</h3>"
        yield _row(pair, measured, at, factor)


def _row(pair: Pair, measured: Measured, at: int, factor: int) -> str:
    with np.errstate(all="ignore"):
        difference = np.abs(pair.other - pair.source) * np.float32(factor)
    shown = {"source": pair.source, "pack": pair.other, f"difference × {factor}": difference}
    view = f"{measured.kinds[at]} · {_db(float(measured.judged[at]))} {measured.region}"
    return three(view, shown, f" of {measured.shots[at]}")


def _db(value: float | None) -> str:
    if value is None or np.isnan(value):
        return "–"
    if abs(value) >= LARGEST_DB:
        return "equal" if value > 0 else "broken"
    return f"{value:.1f} dB"


def _length(metres: float) -> str:
    if not np.isfinite(metres):
        return "broken"
    return f"{metres * 1e3:.3g} mm" if metres >= 1e-4 or metres == 0 else f"{metres * 1e6:.3g} µm"


def _size(count: int) -> str:
    return f"{count / 1e6:.2f} MB" if count >= 1e6 else f"{count / 1e3:.1f} kB"
