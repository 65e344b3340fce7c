"""The fit of a whole film: keyframes, every frame, smoothing; and again by fewer stages, to see what each gains."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np

from avatar_runtime import F64, I64, AvatarError
from avatar_trainer.film.fit import fitting, landmark_map
from avatar_trainer.film.fit.gaze import with_gaze
from avatar_trainer.film.fit.pose import Fit
from avatar_trainer.film.fit.smooth import smoothed
from avatar_trainer.film.look import spread_out
from avatar_trainer.film.pictures import Pictures
from avatar_trainer.film.track import FILE, Looked, Track

KEYFRAMES = 48


def follow(
    looked: Looked,
    places: F64,
    size: int,
    lens: tuple[float, F64],
    pictures: Pictures,
    seed: int,
    said: Callable[[str], None],
    stage: str = fitting.STAGES[-1],
) -> tuple[Fit, F64]:
    """(the fit of the frames with a face, their landmarks' mean distances from it in pixels).

    `places` [T, 478, 2] landmarks in pixels of the capture's images, `size` of these; `lens`: focal length and
    principal point, pixels. `stage`: the last of `fitting.STAGES` that is done.
    """
    rows = np.flatnonzero(looked.seen)
    seen = fitting.Seen(
        places[rows], looked.scores[rows].astype(np.float64), looked.rotation[rows], (size, size)
    )
    surface = fitting.Surface.of_model(landmark_map.load(), seed)
    keys: I64 = np.searchsorted(rows, spread_out(looked, KEYFRAMES))
    found = fitting.fit_keyframes(
        surface,
        seen.of(keys),
        pictures.grey(rows[keys]),
        pictures.masks(rows[keys]),
        *lens,
        said,
        stage,
    )
    fit = fitting.fit_frames(
        surface,
        found,
        seen,
        lambda some: pictures.grey(rows[some]),
        lambda count: said(f"tracking: frame {count} of {len(rows)}"),
    )
    told = fitting.prior_of(seen, fit, surface.known, 1.0).weights
    fit = smoothed(replace(fit, weights=with_gaze(fit, surface.head, seen.places, told)), rows)
    away = fitting.landmarks_of(seen, fit, surface.known).places - fit.pixels(
        fit.in_camera(surface.landmarks.posed(fit.identity, fit.weights))
    )
    return fit, np.linalg.norm(away, axis=-1).mean(axis=1)


def followed_again(capture: Path, work: Path, stage: str) -> Track:
    """The track of a capture that a film became, as it is if the fit ends with `stage`."""
    track, looked = Track.load(capture / FILE), Looked.load(work / Looked.FILE)
    if looked is None:
        raise AvatarError("is damaged or missing; make the capture again", file=work / Looked.FILE)
    fit, _ = follow(
        looked,
        track.landmarks.astype(np.float64),
        track.width,
        (track.focal, track.principal),
        Pictures(work),
        0,
        lambda _: None,
        stage,
    )
    return track.with_fit(fit)
