"""How well films are tracked, film by film and stage by stage, and whether what must hold does.

Nothing here uses the tracker: a track is read as numbers, and its head is that of the head model.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache, cached_property
from pathlib import Path
from statistics import fmean
from typing import Any

import numpy as np
import numpy.typing as npt
from samples.films.truth import Truth
from samples.subjects.take import performed, posed_vertices

from avatar_trainer.head import BodyModel, Head, build_body_model, head_for, load_head_model, neck_height

Array = npt.NDArray[Any]

EVERY = 5  # of the frames, where vertices are compared
REACH, CHIN = 0.095, -0.065  # of the face: metres from the tip of the nose; `neck_height`
MOVES = 0.04  # deviation of a weight that moves
REFERENCE = 512  # pixels: errors are of an image as wide
GROUPS = {
    "jawOpen": ("jawOpen",),
    "blinks": ("eyeBlinkLeft", "eyeBlinkRight"),
    "smiles": ("mouthSmileLeft", "mouthSmileRight"),
}
# What must hold of the mean over all films: the figure, its limit, whether it must be at most that (or at least).
LIMITS = (
    ("pose", 2.0, True),
    ("vertices", 2.5, True),
    ("face share", 1.0, True),
    ("jawOpen", 0.85, False),
    ("blinks", 0.85, False),
    ("smiles", 0.85, False),
    ("median", 0.70, False),
)
COLUMNS = {  # figure: what it is, and how it is printed
    "pose": ("degrees, mean, after a constant rotation", "{:.2f}"),
    "absolute": ("degrees, mean, of the pose as it is", "{:.2f}"),
    "vertices": ("pixels, mean, of the face's true vertices", "{:.2f}"),
    "face": ("millimetres, mean, of the neutral face", "{:.2f}"),
    "mean head": ("millimetres, of the mean head", "{:.2f}"),
    "face share": ("face / mean head", "{:.2f}"),
    "jawOpen": ("correlation", "{:.2f}"),
    "blinks": ("correlation, mean of both", "{:.2f}"),
    "smiles": ("correlation, mean of both", "{:.2f}"),
    "median": ("correlation, median of all that move", "{:.2f}"),
    "focal": ("of the true one", "{:.2f}"),
}


@dataclass(frozen=True)
class Tracked:
    """A track, or a stage of one, as numbers."""

    data: Mapping[str, Array]

    @cached_property
    def head(self) -> Head:
        return head_for(self.data["identity"])

    @cached_property
    def body(self) -> BodyModel:
        return build_body_model(self.head)

    def vertices(self, frame: int) -> Array:
        """The head's vertices [V, 3] before the camera; its trunk turns with it."""
        names = tuple(str(name) for name in self.data["names"])
        take = performed(self.body, np.zeros(0), names, self.data["weights"][frame : frame + 1].astype(float))
        posed = posed_vertices(self.body, take, 0)
        placed: Array = posed @ self.data["rotation"][frame].T + self.data["translation"][frame]
        return placed

    @property
    def zoom(self) -> float:
        """Pixels of the track's images in one of the film."""
        return float(self.data.get("scale", 1))

    def projected(self, points: Array) -> Array:
        """Pixels [N, 2] of the film of points before the camera."""
        flat = float(self.data["focal"]) * points[:, :2] / points[:, 2:] + self.data["principal"]
        placed: Array = flat / self.zoom + self.data.get("corner", 0)
        return placed


def tracked(path: Path) -> Tracked:
    """A track file."""
    with np.load(path, allow_pickle=False) as file:
        return Tracked({name: file[name] for name in file.files})


def face_region(head: Head) -> Array:
    """Mask [V] of the face without ears, neck and what is inside."""
    tip = head.vertices[:, 2].argmax()
    near = np.linalg.norm(head.vertices - head.vertices[tip], axis=1) < REACH
    return near & head.in_part("face") & (neck_height(head.vertices) > CHIN) & (head.vertices[:, 2] > 0.03)


@cache
def mean_head() -> Head:
    """The head of all coefficients 0."""
    return load_head_model()


def similarity(source: Array, target: Array) -> tuple[float, Array, Array]:
    """(s, R, t) by which s R x + t is nearest to the target, over rows."""
    a, b = source - source.mean(axis=0), target - target.mean(axis=0)
    u, sizes, vt = np.linalg.svd(b.T @ a)
    sign = np.array([1, 1, np.sign(np.linalg.det(u @ vt))])
    turn = (u * sign) @ vt
    scale = float((sizes * sign).sum() / (a**2).sum())
    return scale, turn, target.mean(axis=0) - scale * turn @ source.mean(axis=0)


def degrees(rotations: Array) -> Array:
    """Angles [T] of rotations [T, 3, 3]."""
    cosine = (np.trace(rotations, axis1=-2, axis2=-1) - 1) / 2
    return np.degrees(np.arccos(np.clip(cosine, -1, 1)))


def figures(truth: Truth, tracked: Tracked) -> dict[str, float]:
    """All figures of one film by name."""
    rows, frames = matched(truth, tracked)
    region, neutral = face_region(mean_head()), tracked.head.vertices
    found = shape_errors(truth.neutral[region], neutral[region], mean_head().vertices[region])
    turn = similarity(neutral[region], truth.neutral[region])[1]
    # From the axes of the true head to those of the tracked one, in each frame; a constant says nothing about pose.
    off = np.einsum("kj,nlj,nlm->nkm", turn, tracked.data["rotation"][rows], truth.R[frames])
    u, _, vt = np.linalg.svd(off.mean(axis=0))
    found["absolute"] = float(degrees(off).mean())
    found["pose"] = float(degrees(off @ (u @ vt).T).mean())
    far = [
        np.linalg.norm(
            tracked.projected(tracked.vertices(row)[region]) - truth.projected(truth.vertices(k)[region]),
            axis=1,
        ).mean()
        for row, k in list(zip(rows, frames, strict=True))[::EVERY]
    ]
    found["vertices"] = float(np.mean(far)) * REFERENCE / truth.size
    found["focal"] = float(tracked.data["focal"]) / tracked.zoom / truth.focal
    return found | correlations(truth, tracked, rows, frames)


def matched(truth: Truth, tracked: Tracked) -> tuple[Array, Array]:
    """(rows of the track, frames of the film) at the same time, where a face was seen."""
    times = tracked.data["times"]
    frames = np.abs(truth.times[None] - times[:, None]).argmin(axis=1)
    near = np.abs(truth.times[frames] - times) < 0.5 / truth.fps
    rows = np.flatnonzero(near & tracked.data["seen"].astype(bool))
    return rows, frames[rows]


def shape_errors(truth: Array, found: Array, mean: Array) -> dict[str, float]:
    """Millimetres of the neutral face, beside those of the mean head, each fitted in place and size."""
    errors = []
    for shape in (found, mean):
        scale, turn, shift = similarity(shape, truth)
        errors.append(1e3 * float(np.linalg.norm(scale * shape @ turn.T + shift - truth, axis=1).mean()))
    return {"face": errors[0], "mean head": errors[1], "face share": errors[0] / errors[1]}


def correlations(truth: Truth, tracked: Tracked, rows: Array, frames: Array) -> dict[str, float]:
    """Of weights over time: the groups, and the median of all that move."""
    names = [str(name) for name in tracked.data["names"]]
    every = {}
    for k, name in enumerate(truth.names):
        real = truth.weights[frames, k]
        if real.std() >= MOVES:
            given = tracked.data["weights"][rows, names.index(name)]
            every[name] = float(np.corrcoef(real, given)[0, 1]) if given.std() > 1e-6 else 0.0
    groups = {
        group: float(np.mean([every[name] for name in members if name in every] or [np.nan]))
        for group, members in GROUPS.items()
    }
    return groups | {"median": float(np.median(list(every.values())))}


def table(rows: Mapping[tuple[str, str], Mapping[str, float]]) -> Iterator[str]:
    """Lines: a row for each film and stage, then the means of each stage and what holds."""
    head = f"{'film':8s} {'stage':14s}" + "".join(f"{name:>11s}" for name in COLUMNS)
    yield head
    for (film, stage), values in rows.items():
        yield f"{film:8s} {stage:14s}" + _cells(values)
    means = {}
    for stage in dict.fromkeys(stage for _, stage in rows):
        chosen = [values for (_, s), values in rows.items() if s == stage]
        means[stage] = {name: mean([values[name] for values in chosen]) for name in COLUMNS}
        yield f"{'mean':8s} {stage:14s}" + _cells(means[stage])
    yield ""
    for name, limit, most in LIMITS:
        finals = {film: values[name] for (film, stage), values in rows.items() if stage == "all"}
        value = means["all"][name]
        misses = [film for film, v in finals.items() if (v > limit if most else v < limit)]
        holds = "holds" if (value <= limit if most else value >= limit) else "MISSED"
        what = COLUMNS[name][0]
        yield (
            f"{name:11s} {value:6.2f} (at {'most' if most else 'least'} {limit:.2f}) {holds:7s} {what}; "
            f"{len(finals) - len(misses)} of {len(finals)} films"
            + (f", not {', '.join(misses)}" if misses else "")
        )


def mean(values: Sequence[float]) -> float:
    """Of those that are known."""
    known = [value for value in values if not np.isnan(value)]
    return fmean(known) if known else float("nan")


def _cells(values: Mapping[str, float]) -> str:
    return "".join(f"{COLUMNS[name][1].format(values[name]):>11s}" for name in COLUMNS)


def track_of(tracks: Path, name: str) -> Path | None:
    """The track of a film, or None."""
    places = (tracks / f"{name}.npz", *(tracks / name / inside / "track.npz" for inside in ("", "capture")))
    return next((place for place in places if place.is_file()), None)
