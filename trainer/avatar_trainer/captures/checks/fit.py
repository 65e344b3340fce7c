"""Whether the images of a capture show the mesh that it states: silhouettes inside masks, colours that stay.

The capture is measured as it is stated and in every other usual reading. It is found wrong only if another reading
fits clearly better: masks hold hair, shoulders and clothes, so no measure alone says that a capture is wrong.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from avatar_runtime import F64, I64, posed_mesh
from avatar_runtime.stages import joints
from avatar_trainer.captures import image_files
from avatar_trainer.captures.checks.colours import Colours, centre_of, change, sample, visible
from avatar_trainer.captures.checks.readings import STATED, Reading, readings
from avatar_trainer.captures.checks.silhouette import (
    Overlap,
    Seen,
    SurfacePoints,
    cells_of,
    overlap,
    project,
    spread,
)
from avatar_trainer.captures.model import Capture

FRAMES = 16  # that are looked at, evenly spaced
MOVED = 0.5  # pixels by which another reading must move a point, on average, for its colour to be compared
# Another reading fits clearly better if its silhouette does ...
BETTER_UNION = 1.5  # times the share of silhouette and mask that both have
BETTER_INSIDE = 0.15  # more of the silhouette inside the mask, and
GOOD_INSIDE = 0.7  # at least so much
TINY = 0.05  # a silhouette below this share of the mask is wrong wherever it lies
# ... or if its colours do, and its silhouette is not worse.
BETTER_COLOUR = 2.0  # times smaller change of colours
AS_GOOD_UNION = 0.8
PERSON = 0.9  # of a mask where colours are compared
FAR = 1e3  # pixels: the distance of a point that one of two readings does not see
MOST_CHANGE = 0.5  # of colours by a reading that can be right
LOST = 0.2  # of the silhouette inside the masks: below this, mesh and masks are not of the same thing


@dataclass
class Fit:
    """How one reading fits, over all frames that were looked at."""

    reading: Reading
    colours: Colours
    moved: F64  # [P] pixels from the stated places, summed
    overlap: Overlap
    images: int = 0


@dataclass(frozen=True)
class Misfit:
    """A reading that fits clearly better than what is stated."""

    reading: Reading
    stated: Overlap
    better: Overlap
    stated_change: float | None  # of colours, see `colours.change`
    better_change: float | None

    def __str__(self) -> str:
        found = f"seem to be {self.reading.what}. {_capital(self.reading.mend)}."
        now, then = self.stated, self.better
        if now.inside < then.inside - BETTER_INSIDE or now.mesh < TINY * now.mask:
            covers = now.both / max(now.mask, 1)
            return (
                f"{found} As stated, {now.inside:.0%} of the mesh's silhouette lies inside the masks and covers "
                f"{covers:.0%} of them; so read, {then.inside:.0%} and {then.both / max(then.mask, 1):.0%}"
            )
        times = (self.stated_change or 0) / max(self.better_change or 0, 1e-9)
        return f"{found} So read, points of the mesh keep their colours {times:.0f} times better from image to image"


def measured(capture: Capture) -> list[Fit]:
    """The fit of every reading, that of STATED first. Raises AvatarError for a damaged image."""
    points = spread(capture.rig.vertices, capture.rig.triangles)
    count = len(points.triangles)
    fits = [
        Fit(reading, Colours.none(count), np.zeros(count), Overlap(0, 0, 0)) for reading in readings(capture)
    ]
    for index in looked_at(len(capture.frames)):
        _add_image(fits, capture, index, points)
    return fits


def looked_at(count: int) -> list[int]:
    """At most FRAMES of `count` frames, evenly spaced."""
    found: list[int] = np.unique(np.linspace(0, count - 1, min(FRAMES, count)).round().astype(int)).tolist()
    return found


def misfit(fits: Sequence[Fit]) -> Misfit | None:
    """The reading that fits clearly better than STATED and best of all; else None."""
    found = [wrong for fit in fits[1:] if (wrong := _clearly_better(fits[0], fit)) is not None]
    return max(found, key=_goodness, default=None)


def lost(fits: Sequence[Fit]) -> bool:
    """Whether mesh and masks hardly meet, as stated."""
    return fits[0].overlap.inside < LOST


def _add_image(fits: Sequence[Fit], capture: Capture, index: int, points: SurfacePoints) -> None:
    frame = capture.frames[index]
    image, matte = image_files.person(frame.image, frame.mask, frame.over)
    cells, person = cells_of(matte), np.dstack([image, matte])
    posed: dict[tuple[int, bool], tuple[F64, F64]] = {}
    stated: Seen | None = None
    for fit in fits:
        view, pose = fit.reading.of(capture, index)
        row = fit.reading.row(index, len(capture.frames))
        key = (row, fit.reading.pose is STATED.pose)
        if key not in posed:
            vertices = posed_mesh(capture.rig, pose, joints.joints(capture.rig, pose)).astype(np.float64)
            posed[key] = points.at(vertices), points.normals(vertices)
        at, normals = posed[key]
        seen = project(at, view)
        stated = stated or seen
        fit.overlap += overlap(seen.cells(*cells.shape), ~cells if fit.reading.inverted else cells)
        chosen = visible(seen, at, normals, centre_of(view))
        found = sample(person, seen.place[chosen])
        shown = found[:, 3] > PERSON
        fit.colours.add(chosen[shown], found[shown, :3])
        apart = np.linalg.norm(seen.place - stated.place, axis=1)
        fit.moved += np.where(np.isfinite(apart), apart, FAR)
        fit.images += 1


def _clearly_better(stated: Fit, other: Fit) -> Misfit | None:
    now, then = stated.overlap, other.overlap
    moved: I64 = np.flatnonzero(other.moved > MOVED * other.images)
    before, after = change(stated.colours, moved), change(other.colours, moved)
    found = Misfit(other.reading, now, then, before, after)
    worse = before is not None and after is not None and after > before
    outside = now.inside < then.inside - BETTER_INSIDE
    covers = then.union > BETTER_UNION * now.union and then.inside > GOOD_INSIDE
    if covers and ((outside and not worse) or now.mesh < TINY * now.mask):
        return found
    if before is None or after is None or other.reading.inverted:
        return None
    constant = after * BETTER_COLOUR < before and after < MOST_CHANGE
    return found if constant and then.union > AS_GOOD_UNION * now.union else None


def _goodness(found: Misfit) -> float:
    """Larger for a better reading: the silhouette first, then the colours."""
    return found.better.union - min(found.better_change or 0.0, 1.0)


def _capital(text: str) -> str:
    return text[:1].upper() + text[1:]
