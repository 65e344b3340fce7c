"""A page that shows what a pack lost: images beside each other, figures, and the bytes of each part."""

from __future__ import annotations

import base64
from collections.abc import Iterator, Mapping, Sequence
from html import escape

import numpy as np
import numpy.typing as npt

from avatar_export.measure.framing import webp
from avatar_export.measure.views import Shot
from avatar_export.measure.yardstick import LARGEST_DB, Measured, Pair, pairs
from avatar_runtime.avatar import F32, Avatar

SHOWN = 0.15  # brightness that the typical error has in the images of differences
FACTORS = (1, 2, 5, 10, 20, 50, 100, 200, 500, 1000)
CSS = """
:root { color-scheme: light dark; --page: #f6f6f4; --card: #fff; --ink: #1c1d1f; --soft: #66696f; --line: #dcdcd8;
  --bar: #3f76c4; }
@media (prefers-color-scheme: dark) {
  :root { --page: #15161a; --card: #1e2025; --ink: #e8e8ea; --soft: #9a9da5; --line: #33363d; --bar: #6a9ce0; } }
* { box-sizing: border-box; }
body { margin: 0; padding: clamp(12px, 3vw, 40px); background: var(--page); color: var(--ink);
  font: 16px/1.5 system-ui, sans-serif; }
main { max-width: 1080px; margin: 0 auto; }
h1 { font-size: 1.7rem; line-height: 1.2; margin: 0 0 .3em; overflow-wrap: anywhere; }
h2 { font-size: 1.2rem; margin: 2.2em 0 .6em; }
h3 { font-size: 1rem; margin: 1.8em 0 .5em; overflow-wrap: anywhere; }
p { max-width: 46em; margin: .5em 0; }
.soft, figcaption, .view, th small, td small { color: var(--soft); }
.cards { display: grid; grid-template-columns: repeat(auto-fit, minmax(150px, 1fr)); gap: 10px; margin: 1.2em 0; }
.cards div { background: var(--card); border: 1px solid var(--line); border-radius: 8px; padding: 10px 14px; }
.cards b { display: block; font-size: 1.35rem; font-variant-numeric: tabular-nums; }
.scroll { overflow-x: auto; background: var(--card); border: 1px solid var(--line); border-radius: 8px; }
table { border-collapse: collapse; width: 100%; font-variant-numeric: tabular-nums; font-size: .94rem; }
th, td { padding: 6px 12px; text-align: right; border-top: 1px solid var(--line); white-space: nowrap; }
thead th { border-top: 0; vertical-align: bottom; }
th:first-child, td:first-child { text-align: left; font-weight: 400; white-space: normal; min-width: 9em; }
thead th:first-child, tfoot td, tfoot td:first-child { font-weight: 600; }
th { white-space: normal; }
.facts td { text-align: left; white-space: normal; }
.facts tr:first-child td, tbody:first-child tr:first-child td { border-top: 0; }
td small { display: block; }
@media (max-width: 600px) { th, td { padding: 6px 8px; } table { font-size: .85rem; }
  th:first-child, td:first-child { min-width: 7em; } }
.share { width: 34%; min-width: 60px; }
.bar { display: block; height: .7em; border-radius: 3px; background: var(--bar); min-width: 1px; }
.view { margin: .7em 0 .25em; font-size: .92rem; }
.three { display: grid; grid-template-columns: repeat(3, 1fr); gap: 6px; }
figure { margin: 0; min-width: 0; }
figcaption { font-size: .84rem; text-align: center; padding-top: 2px; }
img { display: block; width: 100%; height: auto; border-radius: 6px; background: #000; }
"""
POLICY = "default-src 'none'; img-src data:; style-src 'unsafe-inline'"


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
    return (
        "<!doctype html>\n"
        '<html lang="en"><head><meta charset="utf-8">\n'
        f'<meta http-equiv="Content-Security-Policy" content="{POLICY}">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f"<title>{escape(title)}</title>\n<style>{CSS}</style></head>\n"
        "<body><main>\n" + "\n".join(body) + "\n</main></body></html>\n"
    )


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
    cards = [
        ("size", _size(total)),
        (f"PSNR {measured.region}, mean", _db(measured.mean)),
        (f"PSNR {measured.region}, worst", _db(measured.worst)),
    ]
    if measured.worst_pixel is not None:
        cards.append(("largest error of a pixel", f"{255 * measured.worst_pixel:.0f} of 255"))
    if measured.position_error is not None:
        cards.append(("largest position error", _length(float(np.nanmax(measured.position_error)))))
    return (
        '<div class="cards">'
        + "".join(f'<div><span class="soft">{a}</span><b>{b}</b></div>' for a, b in cards)
        + "</div>"
    )


def _facts(facts: Mapping[str, str]) -> str:
    rows = "".join(
        f"<tr><td>{escape(label)}</td><td>{escape(text)}</td></tr>" for label, text in facts.items()
    )
    return f'<div class="scroll"><table class="facts"><tbody>{rows}</tbody></table></div>'


def _figures(measured: Measured) -> str:
    rows = [
        f"<tr><td>{escape(kind)}</td><td>{measured.kinds.count(kind)}</td><td>{_db(mean)}</td>"
        f"<td>{_db(float(measured.told[at]))}<small>{escape(measured.shots[at])}</small></td></tr>"
        for kind, mean, at in measured.by_kind()
    ]
    return (
        f"<p>PSNR {measured.region}.</p>"
        '<div class="scroll"><table><thead><tr><th>poses</th><th>images</th><th>mean</th><th>worst</th></tr></thead>'
        f"<tbody>{''.join(rows)}</tbody></table></div>"
    )


def _parts(parts: Mapping[str, int]) -> str:
    total = sum(parts.values())
    rows = []
    for name, size in parts.items():
        share = size / total if total else 0.0
        rows.append(
            f"<tr><td>{escape(name)}</td><td>{size:,}</td><td>{share:.1%}</td>"
            f'<td class="share"><span class="bar" style="width:{share:.2%}"></span></td></tr>'
        )
    return (
        '<div class="scroll"><table><thead><tr><th>part</th><th>bytes</th><th>share</th><th></th></tr></thead>'
        f"<tbody>{''.join(rows)}</tbody>"
        f"<tfoot><tr><td>all</td><td>{total:,}</td><td></td><td></td></tr></tfoot></table></div>"
    )


def _images(
    source: Avatar, other: Avatar, shots: Sequence[Shot], measured: Measured, factor: int
) -> Iterator[str]:
    chosen = []
    for kind, mean, worst in measured.by_kind():
        others = [at for at, one in enumerate(measured.kinds) if one == kind and at != worst]
        chosen += [worst, *sorted(others, key=lambda at: abs(float(measured.told[at]) - mean))[:1]]
    for at, pair in zip(
        chosen, pairs(source, other, [shots[at] for at in chosen], measured.backend), strict=True
    ):
        yield f"<h3>{escape(measured.shots[at])}</h3>"
        yield _row(pair, measured, at, factor)


def _row(pair: Pair, measured: Measured, at: int, factor: int) -> str:
    with np.errstate(all="ignore"):
        difference = np.abs(pair.other - pair.source) * np.float32(factor)
    shown = {"source": pair.source, "pack": pair.other, f"difference × {factor}": difference}
    figures = "".join(
        f'<figure><img alt="{escape(f"{label} of {measured.shots[at]}")}" loading="lazy" src="{_data_uri(image)}">'
        f"<figcaption>{label}</figcaption></figure>"
        for label, image in shown.items()
    )
    return (
        f'<p class="view">{measured.kinds[at]} · {_db(float(measured.told[at]))} {measured.region}</p>'
        f'<div class="three">{figures}</div>'
    )


def _data_uri(image: F32) -> str:
    return "data:image/webp;base64," + base64.b64encode(webp(_bytes(image))).decode("ascii")


def _bytes(image: F32) -> npt.NDArray[np.uint8]:
    return (np.clip(np.nan_to_num(image), 0, 1) * 255 + 0.5).astype(np.uint8)


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
