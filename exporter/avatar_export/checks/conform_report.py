"""The result of `conform` for people: lines of a table, one self-contained HTML file, images of the differences."""

from __future__ import annotations

import base64
import html
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from avatar_export.checks.conform_coverage import Gap, gap_lines
from avatar_export.images import png
from avatar_export.measure.page import listed, page, table
from avatar_export.notes.note import Note, fact
from avatar_export.notes.text import text
from avatar_runtime.conformance import Expected, ImageRow, Reference, Report, Row

Pixels = npt.NDArray[np.uint8]
ENGINE_AGREES_DB = 65.0  # PSNR of profile engine against trainer that a GPU should reach
GAIN = 32  # a difference of 8/255 is white in the difference image
MOST_PERCENT = 999  # of a tolerance; larger values are shown as >999 %
COLUMNS = ("stage", "case", "array", "max error", "tolerance", "used", "flips", "verdict")


@dataclass(frozen=True)
class Line:
    """One line of the table: its cells as text, and whether it passed."""

    stage: str  # with its profile where it has one
    case: str
    array: str
    error: str
    tolerance: str
    used: str  # the largest share of its tolerance that an element uses
    flips: str
    passed: bool
    worst: str = ""  # if it fails: the worst element, its value, the expected value

    @property
    def cells(self) -> tuple[str, ...]:
        """The texts of the line, in the order of COLUMNS."""
        verdict = "holds" if self.passed else "FAILS"
        return (
            self.stage, self.case, self.array, self.error, self.tolerance, self.used, self.flips, verdict
        )  # fmt: skip


def all_lines(report: Report, reference: Reference) -> list[Line]:
    """A line for every array of every stage of every case, then for every image."""
    return [*(_line(row, reference) for row in report.rows), *map(_image_line, report.images)]


def stage_lines(report: Report, reference: Reference) -> list[Line]:
    """The worst line of each stage, in the order of the stages; then the worst of the images by profile."""
    worst: dict[str, tuple[tuple[bool, float], Line]] = {}
    rows = [((not row.passed, row.verdict.used), _line(row, reference)) for row in report.rows]
    images = [((not p.passed, p.difference), _image_line(p)) for p in report.images]
    for rank, line in (*rows, *images):
        if line.stage not in worst or rank > worst[line.stage][0]:
            worst[line.stage] = (rank, line)
    return [line for _, line in worst.values()]


def judged_lines(report: Report) -> list[str]:
    """`bind: mean, log_scale, quat_wxyz, sh_rotation`: the arrays of each stage that were judged."""
    arrays: dict[str, dict[str, None]] = {}
    for row in report.rows:
        arrays.setdefault(_stage(row), {})[row.array] = None
    return [f"{stage}: {', '.join(names)}" for stage, names in arrays.items()]


def facts(report: Report, reference: Reference, gaps: Iterable[Gap]) -> dict[str, Any]:
    """The whole result as JSON data; a number that is not finite becomes null."""
    return {
        "backend": report.backend,
        "made_by": reference.made_by,
        "passed": report.passed,
        "first_failure": report.first_failure,
        "stages": [_row_facts(row, _expected(reference, row)) for row in report.rows],
        "pictures": [_image_facts(image) for image in report.images],
        "engine_psnr_db": {c.case.name: c.engine_psnr_db for c in reference.cases if c.images},
        "not_tested": [
            {"kind": g.kind, "value": g.value, "same_as": list(g.same_as), "bundle": g.bundle} for g in gaps
        ],
        "notes": [*map(text, notes(report, reference))],
    }


def notes(report: Report, reference: Reference) -> list[Note]:
    """What the table does not say: what was skipped, and how far the two raster profiles differ."""
    found = []
    if report.skipped:
        found.append(fact("skipped", backend=report.backend, stages="; ".join(report.skipped)))
    if report.backend is None:
        return [*found, fact("no_images")]
    for case in reference.cases:
        name, db = case.case.name, case.engine_psnr_db
        if case.images and db is None:
            found.append(fact("profiles_same", case=name))
        elif case.images and db is not None:
            expected = None if db >= ENGINE_AGREES_DB else ENGINE_AGREES_DB
            found.append(fact("profiles_differ", case=name, db=db, expected=expected))
    return found


def verdict(report: Report) -> str:
    """The result in one sentence."""
    who = "the given output" if report.backend is None else f"backend {report.backend}"
    return f"{who} repeats the reference" if report.passed else f"{who} fails first at {report.first_failure}"


def worst_elements(lines: Iterable[Line]) -> list[str]:
    """The worst element of every line that fails, as text."""
    return [f"{line.stage}, case {line.case}: {line.worst}" for line in lines if line.worst]


def failed_images(report: Report) -> dict[str, Pixels]:
    """File name -> image [H, W, 3] of every case that fails: the reference, the drawn image, the difference."""
    bad = {row.case for row in report.rows if not row.passed}
    bad |= {image.case for image in report.images if not image.passed}
    return {
        f"{image.case}.{image.profile}.{kind}.png": pixels
        for image in report.images
        if image.case in bad
        for kind, pixels in _shown(image).items()
    }


def html_report(title: str, report: Report, reference: Reference, gaps: Iterable[Gap]) -> str:
    """The HTML page: verdict, worst line of each stage, what was not tested, images, all arrays.

    Same results, same bytes.
    """
    cases = {case.case.name: case.case.why for case in reference.cases}
    parts = [
        f"<h1>{html.escape(title)}</h1>",
        f'<p class="{"good" if report.passed else "bad"}">{html.escape(verdict(report))}.</p>',
        f"<p>Reference made by {html.escape(reference.made_by)} ({html.escape(reference.generator)}).</p>",
        _table(stage_lines(report, reference)),
        listed(map(text, notes(report, reference))),
        "<h2>Not tested by this avatar</h2>",
        listed(gap_lines(gaps)),
        "<h2>Images</h2>",
        *(_figure(image, cases.get(image.case, "")) for image in report.images),
        "<h2>Every array</h2>",
        _table(all_lines(report, reference)),
    ]
    return page(title, parts, CSS)


def _row_facts(row: Row, expected: Expected) -> dict[str, Any]:
    """`worst.tolerance` is the allowed error of that element: atol times its row's weight + rtol |want|."""
    found, element = row.verdict, row.verdict.worst
    named = {name: getattr(row, name) for name in ("case", "stage", "profile", "array", "passed")}
    numbers = {"error": _finite(found.error), "used": _finite(found.used), "flips": found.flips}
    allowed = {"most_flips": expected.most_flips, "atol": expected.atol, "rtol": expected.rtol}
    worst = element and {
        "index": list(element.index),
        **row.place,
        "got": _finite(element.got),
        "want": element.want,
        "tolerance": element.allowed,
    }
    return {**named, **numbers, **allowed, "worst": worst, "note": found.note}


def _image_facts(image: ImageRow) -> dict[str, Any]:
    named = {name: getattr(image, name) for name in ("case", "profile", "tolerance", "psnr_db", "passed")}
    return {**named, "difference": _finite(image.difference), "unit": 1 / 255}


def _finite(value: float) -> float | None:
    return value if np.isfinite(value) else None


def _line(row: Row, reference: Reference) -> Line:
    expected = _expected(reference, row)
    found = row.verdict
    flips = f"{found.flips} of {found.most_flips}" if found.flips or found.most_flips else ""
    return Line(
        _stage(row),
        row.case,
        row.array,
        found.note or f"{found.error:.2g}",
        _tolerance(expected),
        _percent(found.used),
        flips,
        row.passed,
        "" if row.passed else _worst(row),
    )


def _stage(row: Row) -> str:
    return row.stage if row.profile is None else f"{row.stage} {row.profile}"


def _percent(used: float) -> str:
    return f"{100 * used:.0f} %" if 100 * used <= MOST_PERCENT else f">{MOST_PERCENT} %"


def _worst(row: Row) -> str:
    """`mean[12, 0] of gaussian 3491: got 0.1, expected 0.2`."""
    element = row.verdict.worst
    if element is None:
        return ""
    names = {"gaussian": "Gaussian"}
    place = ", ".join(f"{names.get(name, name)} {value}" for name, value in row.place.items())
    of = f" of {'pixel ' if 'x' in row.place else ''}{place}" if place else ""
    return f"{row.array}{list(element.index)}{of}: got {element.got:.9g}, expected {element.want:.9g}"


def _image_line(image: ImageRow) -> Line:
    return Line(
        f"image {image.profile}",
        image.case,
        "colour, alpha",
        f"{_steps(image.difference)}/255",
        f"{_steps(image.tolerance)}/255",
        _percent(image.difference / image.tolerance),
        "",
        image.passed,
    )


def _steps(difference: float) -> str:
    """A difference in steps of 1/255."""
    return f"{difference:.1f}" if difference > 1 else f"{difference:.2g}"


def _expected(reference: Reference, row: Row) -> Expected:
    (case,) = (c for c in reference.cases if c.case.name == row.case)
    (step,) = (s for s in case.steps if (s.stage, s.profile) == (row.stage, row.profile))
    return step.outputs[row.array]


def _tolerance(expected: Expected) -> str:
    """`atol + rtol |x|`, without the terms that are zero."""
    weight = " w" if expected.weight else ""
    terms = [f"{expected.atol:.2g}{weight}"] if expected.atol else []
    terms += [f"{expected.rtol:.2g} |x|"] if expected.rtol else []
    return " + ".join(terms) or "equal"


def _shown(image: ImageRow) -> dict[str, Pixels]:
    off = np.abs(image.got.colour.astype(np.int16) - image.want.colour)
    return {
        "ref": image.want.colour,
        "got": image.got.colour,
        "diff": np.minimum(GAIN * off, 255).astype(np.uint8),
    }


def _table(lines: Iterable[Line]) -> str:
    lines = list(lines)
    cells = ([*map(html.escape, (*line.cells, line.worst))] for line in lines)
    return table(
        (*COLUMNS, "worst element"), cells, classes=["good" if line.passed else "bad" for line in lines]
    )


def _figure(image: ImageRow, why: str) -> str:
    images = "".join(
        f'<img alt="{kind}" title="{kind}" src="data:image/png;base64,{base64.b64encode(png(pixels)).decode()}">'
        for kind, pixels in _shown(image).items()
    )
    psnr = "equal" if image.psnr_db is None else f"{image.psnr_db:.1f} dB"
    text = (
        f"{image.case}, profile {image.profile}: {why}. Reference, drawn, difference x {GAIN}; up to "
        f"{_steps(image.difference)} of 255, {psnr}"
    )
    return f"<figure>{images}<figcaption>{html.escape(text)}</figcaption></figure>"


CSS = "img { display: inline; width: auto; image-rendering: pixelated; margin-right: 4px; }"
