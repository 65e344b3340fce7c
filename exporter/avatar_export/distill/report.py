"""report.html: how far a distilled avatar is from its dumps, frame by frame and part by part."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from html import escape

import numpy as np

from avatar_export.distill.make import BAKED, Distilled
from avatar_export.distill.measure import Errors
from avatar_export.measure.page import cards, listed, page, table, three
from avatar_export.notes.text import text
from avatar_runtime.avatar import F64, I64, Avatar

HALF = 0.5  # of the largest weight: frames above it exercise a driver
MOST_DRIVERS = 400  # rows of the table
FACTOR = 20  # of shown differences
STILL = 1e-12  # variance of a part that does not move


def report_html(result: Distilled) -> str:
    """One page that stands alone: no scripts, no files beside it, images inside."""
    title = f"{result.avatar.name}: distilled from dumps"
    body = [
        f"<h1>{escape(title)}</h1>",
        *_summary(result),
        "<h2>Error by frame</h2>",
        _frames(result),
        "<h2>What is not explained</h2>",
        "<p>The part of the motion of each attribute that the avatar does not repeat, over the measured frames. "
        "Regions are the joints that hold most of a Gaussian. Small: the RMS error (mm for positions).</p>",
        _regions(result),
        "<h2>How far each driver was exercised</h2>",
        _drivers(result),
        "<h2>Beyond the data</h2>",
        "<p>Random poses at and beyond the ranges that were seen. Reach: the largest way of a Gaussian, in heights of "
        "the figure. Growth: the largest factor of a scale.</p>",
        _sweep(result),
        "<h2>Worst frames</h2>",
        f"<p>Truth, distilled, and their difference, {FACTOR} times amplified.</p>",
        *_images(result.baked or result.errors),
    ]
    return page(title, body)


def _summary(result: Distilled) -> Iterator[str]:
    errors = result.errors
    alone = result.form == BAKED
    what = "baked, an upper bound" if alone else "held out"
    yield (
        f"<p>Form: <b>{escape(result.form)}</b>. {escape(text(result.reason))}. {len(result.frames.fitted)} frames "
        f"were learnt from, {len(result.frames.held_out)} held out.</p>"
    )
    figures = [
        (f"positions, RMS, {what}", f"{errors.rms:.3g} mm"),
        ("the same, weighted by share in the picture", f"{errors.seen:.3g} mm"),
        (f"foreground, mean, {what}", f"{errors.decibels:.1f} dB"),
        ("foreground, worst frame", f"{float(np.nanmin(errors.foreground_db)):.1f} dB"),
    ]
    if result.baked is not None:
        figures.append(
            ("foreground with bases in the clips: an upper bound", f"{result.baked.decibels:.1f} dB")
        )
    yield cards(figures)
    for label, notes in (("Mended", result.checked.mended), ("Doubtful", result.doubts)):
        if notes:
            yield f"<h3>{label}</h3>{listed(map(text, notes))}"


def _frames(result: Distilled) -> str:
    errors = result.errors
    take = result.task.dumps.drivers.take
    rows = [
        [
            f"{frame:05d} <small>{escape(result.task.dumps.take_name(int(take[frame])))}</small>",
            f"{rms:.3g}",
            f"{seen:.3g}",
            f"{decibels:.1f}",
        ]
        for frame, rms, seen, decibels in zip(
            errors.frames.tolist(), errors.rms_mm, errors.seen_mm, errors.foreground_db, strict=True
        )
    ]
    return table(("frame", "RMS, mm", "weighted RMS, mm", "foreground, dB"), rows)


def _regions(result: Distilled) -> str:
    errors = result.errors
    frames = max(len(errors.frames), 1)
    rows = []
    for name, members in regions(result.avatar).items():
        cells = [f"{escape(name)} <small>{len(members)} Gaussians</small>"]
        for part, left in errors.left.items():
            unit = 1e3 if part == "position" else 1.0
            rms = unit * float(np.sqrt(left[members].mean() / frames))
            cells.append(f"{_percent(left[members], errors.moved[part][members])}<small>{rms:.3g}</small>")
        rows.append(cells)
    return table(("region", *errors.left), rows)


def _percent(left: F64, moved: F64) -> str:
    if moved.mean() < STILL:
        return "–"
    return f"{100 * left.sum() / moved.sum():.2g} %"


def regions(avatar: Avatar) -> Mapping[str, I64]:
    """Name -> ids of the Gaussians that hang most on that joint; thirds of the height without joints."""
    joint = _joint(avatar)
    if joint is None or avatar.rig is None:
        height = avatar.gaussians.mean[:, 1]
        order = np.argsort(height, kind="stable")
        low, middle, high = np.array_split(order, 3)
        return {
            name: ids
            for name, ids in (("upper third", high), ("middle", middle), ("lower third", low))
            if len(ids)
        }
    return {
        name: np.flatnonzero(joint == index)
        for index, name in enumerate(avatar.rig.joint_names)
        if (joint == index).any()
    }


def _joint(avatar: Avatar) -> I64 | None:
    """[N] the joint with the largest weight."""
    rig, sparse, which = avatar.rig, avatar.skin, None
    if rig is None:
        return None
    if avatar.embedding is not None:
        sparse = rig.skin
        which = avatar.embedding.vertex_ids[
            np.arange(avatar.gaussians.count), avatar.embedding.barycentric.argmax(axis=1)
        ]
    if not sparse.entries:
        return None
    pointer = sparse.row_ptr.astype(np.int64)
    row = np.repeat(np.arange(sparse.rows), pointer[1:] - pointer[:-1])
    dense = np.zeros((sparse.rows, sparse.columns), np.float32)
    dense[row, sparse.column] = sparse.values["weight"]
    best: I64 = dense.argmax(axis=1).astype(np.int64)
    return best if which is None else best[which].astype(np.int64)


def _drivers(result: Distilled) -> str:
    drivers = result.checked.dumps.drivers
    values = drivers.drivers
    learnt, held = values[result.frames.fitted], values[result.frames.held_out]
    rows = []
    for index, name in enumerate(drivers.driver_names[:MOST_DRIVERS]):
        low, high = float(learnt[:, index].min()), float(learnt[:, index].max())
        often = (
            int((np.abs(learnt[:, index]) > HALF * np.abs(learnt[:, index]).max()).sum()) if high > low else 0
        )
        beyond = held[:, index].min() < low - 1e-6 or held[:, index].max() > high + 1e-6
        note = (
            "not exercised"
            if learnt[:, index].std() < 0.01
            else "held-out frames go beyond"
            if beyond
            else ""
        )
        rows.append(
            [escape(name), f"{low:.3g} to {high:.3g}", f"{learnt[:, index].std():.3g}", str(often), note]
        )
    untaught = () if result.task.skeleton is None else result.task.skeleton.untaught
    said = (
        f"<p>Joints that never moved against their parents: {escape(', '.join(untaught))}.</p>"
        if untaught
        else ""
    )
    if not rows:
        return f"{said}<p>There are no drivers.</p>"
    return said + table(("driver", "range seen", "deviation", "frames above half", ""), rows)


def _sweep(result: Distilled) -> str:
    sweep = result.sweep
    rows = [
        [f"{factor:g} times the range", f"{reach:.2f}", f"{growth:.3g}"]
        for factor, reach, growth in zip(sweep.factor, sweep.reach, sweep.scale, strict=True)
    ]
    return table(("poses", "reach, heights", "growth"), rows)


def _images(errors: Errors) -> Iterator[str]:
    for picture in errors.worst:
        shown = {
            "truth": picture.truth,
            "distilled": picture.distilled,
            f"difference × {FACTOR}": np.abs(picture.truth - picture.distilled) * np.float32(FACTOR),
        }
        yield three(f"frame {picture.frame:05d} · {picture.decibels:.1f} dB", shown)
