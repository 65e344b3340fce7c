"""The page report.html: what was done, errors by kind and what to do, a contact sheet, a table. One file, no script."""

from __future__ import annotations

import html
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence

from avatar_export.batch.result import STATES, Result
from avatar_export.measure.page import page, table

MOST_NAMED = 20  # rows of one kind of error
COLUMNS = ("row", "state", "bundle", "pack", "PSNR", "time", "peak memory", "worker", "attempts", "message")


def html_report(results: Sequence[Result], previews: Mapping[str, str | None]) -> str:
    """The page; `previews`: row -> data: address of its image. Same arguments, same bytes."""
    failed = [result for result in results if result.state == "failed"]
    parts = [
        "<h1>Batch</h1>",
        f'<p class="{"good" if all(r.ok for r in results) else "bad"}">{_said(summary(results))}</p>',
        *(["<h2>Errors</h2>", *_errors(failed)] if failed else []),
        "<h2>Avatars</h2>",
        _sheet(results, previews),
        "<h2>Rows</h2>",
        table(COLUMNS, map(_cells, results), classes=map(_class, results)),
    ]
    return page("Batch", parts, CSS)


def summary(results: Sequence[Result]) -> str:
    """`3 rows: 2 done, 1 failed; 1.20 GB in all; CPU time 70 s`."""
    states = Counter(result.state for result in results)
    counted = ", ".join(f"{states[state]} {state}" for state in STATES if states[state])
    size = sum(sum(result.sizes.values()) for result in results)
    seconds = sum(result.cpu_seconds for result in results)
    return f"{len(results)} rows: {counted or 'nothing'}; {_bytes(size)} in all; CPU time {seconds:.0f} s"


def _errors(failed: Iterable[Result]) -> Iterable[str]:
    """A section for each kind: how many, what to do, and each row with its message."""
    kinds: dict[tuple[str, str], list[Result]] = {}
    for result in failed:
        kinds.setdefault((result.kind, result.remedy), []).append(result)
    for (kind, remedy), rows in sorted(kinds.items(), key=lambda item: (-len(item[1]), item[0])):
        yield f"<h3>{_said(kind)}: {len(rows)}</h3>\n<p>What to do: {_said(remedy)}.</p>"
        items = [f"<li><b>{_said(row.name)}</b>: {_said(row.message)}</li>" for row in rows[:MOST_NAMED]]
        if len(rows) > MOST_NAMED:
            items.append(f"<li>and {len(rows) - MOST_NAMED} more; the table below has all</li>")
        yield f"<ul>{''.join(items)}</ul>"


def _sheet(results: Sequence[Result], previews: Mapping[str, str | None]) -> str:
    figures = []
    for result in results:
        address = previews.get(result.name)
        why = "no preview" if result.ok else result.state
        image = f'<img alt="" src="{address}">' if address else f"<span>{_said(why)}</span>"
        figures.append(
            f'<figure class="{_class(result)}">{image}<figcaption>{_said(result.name)}</figcaption></figure>'
        )
    return f'<div class="sheet">{"".join(figures)}</div>'


def _cells(result: Result) -> list[str]:
    cells = (
        result.name,
        result.state,
        _bytes(result.sizes.get("bundle")),
        _bytes(result.sizes.get("pack")),
        "" if result.psnr is None else f"{result.psnr:.1f} dB",
        f"{result.seconds:.1f} s" if result.seconds else "",
        _bytes(result.peak_bytes or None),
        result.worker,
        str(result.attempts),
        result.message,
    )
    return [_said(cell) for cell in cells]


def _class(result: Result) -> str:
    return "good" if result.ok else "bad"


def _bytes(size: int | None) -> str:
    if size is None:
        return ""
    if size < 1e5:
        return f"{size / 1e3:.1f} kB"
    return f"{size / 1e9:.2f} GB" if size >= 1e9 else f"{size / 1e6:.1f} MB"


def _said(text: str) -> str:
    """Text of others on a page: on one line, without what a browser obeys or hides."""
    return html.escape("".join(c if c.isprintable() else "?" for c in text))


CSS = """
main { max-width: 80em; }
p.good { font-weight: bold; }
tr.bad, figure.bad { font-weight: normal; }
.sheet { display: grid; grid-template-columns: repeat(auto-fill, 144px); gap: 12px; }
.sheet img, .sheet span { display: grid; place-items: center; width: 144px; height: 144px; }
td { text-align: left; vertical-align: top; }
td:last-child { white-space: normal; }
"""
