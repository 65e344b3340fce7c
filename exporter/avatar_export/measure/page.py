"""Parts of the pages with results: they stand alone, without scripts, and have their images inside."""

from __future__ import annotations

import base64
from collections.abc import Iterable, Mapping, Sequence
from html import escape
from itertools import zip_longest

import numpy as np

from avatar_export.measure.framing import webp
from avatar_runtime.avatar import F32

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
td:has(.bar) { width: 34%; min-width: 60px; }
.bar { display: block; height: .7em; border-radius: 3px; background: var(--bar); min-width: 1px; }
.bad { color: #b00020; font-weight: bold; }
.view { margin: .7em 0 .25em; font-size: .92rem; }
.three { display: grid; grid-template-columns: repeat(3, 1fr); gap: 6px; }
figure { margin: 0; min-width: 0; }
figcaption { font-size: .84rem; text-align: center; padding-top: 2px; }
img { display: block; width: 100%; height: auto; border-radius: 6px; background: #000; }
"""
POLICY = "default-src 'none'; img-src data:; style-src 'unsafe-inline'"


def page(title: str, body: Iterable[str], css: str = "") -> str:
    """The whole document; `css` are rules of its own."""
    return (
        '<!doctype html>\n<html lang="en"><head><meta charset="utf-8">\n'
        f'<meta http-equiv="Content-Security-Policy" content="{POLICY}">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f"<title>{escape(title)}</title>\n<style>{CSS}{css}</style></head>\n"
        "<body><main>\n" + "\n".join(body) + "\n</main></body></html>\n"
    )


def cards(figures: Iterable[tuple[str, str]]) -> str:
    """Figures with their labels."""
    boxes = (
        f'<div><span class="soft">{escape(label)}</span><b>{figure}</b></div>' for label, figure in figures
    )
    return f'<div class="cards">{"".join(boxes)}</div>'


def table(
    head: Iterable[str], rows: Iterable[Sequence[str]], foot: str = "", classes: Iterable[str] = ()
) -> str:
    """A table of cells in HTML; `classes` of the rows."""
    top = "".join(f"<th>{escape(cell)}</th>" for cell in head)
    body = "".join(
        f"<tr{kind and f' class={kind}'}>{''.join(f'<td>{cell}</td>' for cell in row)}</tr>\n"
        for row, kind in zip_longest(rows, classes, fillvalue="")
    )
    head_row = f"<thead><tr>{top}</tr></thead>"
    return f'<div class="scroll"><table>{head_row}<tbody>{body}</tbody>{foot}</table></div>'


def listed(texts: Iterable[str]) -> str:
    """A list of texts."""
    return f"<ul>{''.join(f'<li>{escape(text)}</li>' for text in texts)}</ul>"


def three(view: str, shown: Mapping[str, F32], of: str = "") -> str:
    """Images [H, W, 3] beside each other, by label; `of` is what they show."""
    figures = "".join(
        f'<figure><img alt="{escape(f"{label}{of}")}" loading="lazy" src="{_uri(image)}">'
        f"<figcaption>{label}</figcaption></figure>"
        for label, image in shown.items()
    )
    return f'<p class="view">{view}</p><div class="three">{figures}</div>'


def _uri(image: F32) -> str:
    pixels = (np.clip(np.nan_to_num(image), 0, 1) * 255 + 0.5).astype(np.uint8)
    return "data:image/webp;base64," + base64.b64encode(webp(pixels)).decode("ascii")
