"""The table from pictures, and how good it is on people and skins that it was not made from."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from mediapipe.tasks.python.vision.face_landmarker import Blendshapes

from avatar_trainer.film.fit.landmark_map import COUNT, SKIN, seen_from
from avatar_trainer.head import Head
from tools.landmark_map import fit
from tools.landmark_map.faces import Faces

Array = npt.NDArray[Any]

FOLDS = 4
SHOWN = 220.0  # pixels of the face in reports
REGIONS = {
    "lips": (
        *(
            61,
            185,
            40,
            39,
            37,
            0,
            267,
            269,
            270,
            409,
            291,
            146,
            91,
            181,
            84,
            17,
            314,
            405,
            321,
            375,
            78,
            191,
            80,
            81,
        ),
        *(82, 13, 312, 311, 310, 415, 308, 95, 88, 178, 87, 14, 317, 402, 318, 324),
    ),
    "lids": (
        *(33, 246, 161, 160, 159, 158, 157, 173, 133, 155, 154, 153, 145, 144, 163, 7),
        *(263, 466, 388, 387, 386, 385, 384, 398, 362, 382, 381, 380, 374, 373, 390, 249),
    ),
    "brows": (70, 63, 105, 66, 107, 55, 65, 52, 53, 46, 300, 293, 334, 296, 336, 285, 295, 282, 283, 276),
    "nose": (1, 2, 4, 5, 6, 19, 94, 98, 97, 327, 326, 168, 195, 197, 48, 278, 64, 294, 129, 358, 115, 344),
    "oval": (
        *(10, 338, 297, 332, 284, 251, 389, 356, 454, 323, 361, 288, 397, 365, 379, 378, 400, 377, 152),
        *(148, 176, 149, 150, 136, 172, 58, 132, 93, 234, 127, 162, 21, 54, 103, 67, 109),
    ),
    "irises": tuple(range(468, COUNT)),
}


def score_names() -> tuple[str, ...]:
    """MediaPipe's names of its weights, as Apple spells them; `_neutral` first."""
    first, *rest = (shape.name.lower().split("_") for shape in Blendshapes)
    return ("_" + first[0], *(words[0] + "".join(map(str.capitalize, words[1:])) for words in rest))


def folds(faces: Faces) -> list[tuple[Array, Array]]:
    """Masks [N] of the pictures to learn from and to judge by, FOLDS times: no person and no skin is in both."""
    person, skin = faces.identity % FOLDS, faces.skin % FOLDS
    return [((person != k) & (skin != k), (person == k) & (skin == k)) for k in range(FOLDS)]


@dataclass(frozen=True)
class Judged:
    """M pictures by tables that were made without their people and their skins."""

    faces: Faces
    yaw: Array  # [M]
    before: Array  # [M, 478] complex errors, sizes of the face
    after: Array  # [M, 478] once corrected
    weights: Array  # [M, 51] predicted


def judged(seen: fit.Upright, faces: Faces, head: Head) -> Judged:
    """All folds, one after the other."""
    rows, before, after, weights = [], [], [], []
    for learn, judge in folds(faces):
        given, asked = seen.chosen(learn), seen.chosen(judge)
        corners, bary = fit.surface_points(given, faces.chosen(learn), head)
        error = fit.errors(asked, corners, bary)
        table = fit.correction(given.inputs, fit.errors(given, corners, bary))
        matrix = fit.ridge(given.inputs, faces.weights[learn].astype(np.float64))
        rows.append(np.flatnonzero(judge))
        before.append(error)
        after.append(error - fit.predicted(table, asked.inputs))
        weights.append(np.clip(asked.inputs @ matrix.T, 0, 1))
    order = np.concatenate(rows)
    own = faces.chosen(order)
    yaw, _ = seen_from(own.rotation, own.translation)
    return Judged(own, yaw, *map(np.concatenate, (before, after, weights)))


def tables(seen: fit.Upright, faces: Faces, head: Head, test: Judged) -> dict[str, Array]:
    """The file's arrays: what all pictures tell, and what the held-out ones tell of its errors."""
    corners, bary = fit.surface_points(seen, faces, head)
    correction = fit.correction(seen.inputs, fit.errors(seen, corners, bary))
    return {
        "triangle_corners": corners.astype(np.uint16),
        "barycentric": bary.astype(np.float32),
        "template": np.stack([seen.template.real, seen.template.imag], axis=1).astype(np.float32),
        "correction": correction.astype(np.float16),
        "covariance": fit.covariance(test.after).astype(np.float32),
        "variance_by_yaw": fit.variance_by_yaw(test.after, test.yaw).astype(np.float32),
        "film_share": fit.film_share(seen, faces, fit.errors(seen, corners, bary)).astype(np.float16),
        "weight_matrix": fit.ridge(seen.inputs, faces.weights.astype(np.float64)).astype(np.float16),
        "weight_variance": fit.weight_variance(test.weights, test.faces.weights).astype(np.float32),
        "names": np.array(head.expression_names),
        "score_names": np.array(score_names()),
    }


def report(test: Judged, made: dict[str, Array]) -> list[str]:
    """Lines on the held-out pictures."""
    lines = [
        f"{len(test.yaw)} pictures; mean error before and after, pixels of a face of {SHOWN:.0f}; largest cause"
    ]
    lines[0] = lines[0].removesuffix("; largest cause") + "; share that stays over a film"
    for name, rows in {"skin, all": tuple(range(SKIN)), **REGIONS}.items():
        a, b = (np.abs(x[:, list(rows)]).mean() * SHOWN for x in (test.before, test.after))
        lines.append(f"{name:<12}{a:6.2f}{b:6.2f}{made['film_share'][list(rows)].mean():6.2f}")
    columns = [list(made["score_names"]).index(name) for name in made["names"]]
    true, person = test.faces.weights, test.faces.identity
    theirs = correlations(test.faces.scores[:, columns], true, person)
    ours = correlations(test.weights, true, person)
    sigma = np.sqrt(((test.weights - true) ** 2).mean(axis=0))
    lines.append(
        "correlation within a person of MediaPipe's own weight and of the table's; deviation of the latter"
    )
    lines += [
        f"{n:<22}{a:6.2f}{b:6.2f}{c:6.2f}"
        for n, a, b, c in zip(made["names"], theirs, ours, sigma, strict=True)
    ]
    for name, mean in (("mean", np.nanmean), ("median", np.nanmedian)):
        lines.append(f"{name:<22}{mean(theirs):6.2f}{mean(ours):6.2f}{mean(sigma):6.2f}")
    return lines


def correlations(a: Array, b: Array, person: Array) -> Array:
    """[K] of the columns of a and b [N, K] after each person's mean is taken off."""
    x, y = np.array(a, np.float64), np.array(b, np.float64)
    for number in np.unique(person):
        own = person == number
        x[own] -= x[own].mean(axis=0)
        y[own] -= y[own].mean(axis=0)
    scale = np.sqrt((x * x).sum(axis=0) * (y * y).sum(axis=0))
    return np.where(scale > 1e-6, (x * y).sum(axis=0) / np.maximum(scale, 1e-6), np.nan)


def write(path: Path, faces: Faces, head: Head) -> list[str]:
    """Write the table and return the report on it."""
    seen = fit.upright(faces)
    found = fit.found(seen, faces, head)
    seen, faces = seen.chosen(found), faces.chosen(found)
    test = judged(seen, faces, head)
    made = tables(seen, faces, head, test)
    np.savez_compressed(path, **made)
    lost = f"{len(found)} pictures, {(~found).sum()} of them lost by MediaPipe"
    return [lost, *report(test, made), f"{path.name}: {path.stat().st_size} bytes"]
