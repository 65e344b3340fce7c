"""What a map from drivers to the weights of residual bases would gain, if the format had a rule for it: `--map`."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from unittest.mock import patch

import numpy as np
from samples.dumps import write_dumps

from avatar_export.distill import make, measure, residual
from avatar_export.distill.learn import Task
from avatar_export.distill.solve import folds
from avatar_export.levels.level import measured_contribution
from avatar_runtime.avatar import F64
from bench.distill import boxes

WIDTHS = (0.5, 1.0, 2.0, 4.0, 8.0)  # tried, times the median distance of two frames' drivers
RIDGES = (1e-4, 1e-3, 1e-2, 1e-1, 1.0)  # tried
LARGE = 9.0  # times the bytes: no base is cut, so that nothing but the map is measured


def driven_map() -> None:
    """Learn the wrinkled head, its bases and their map from the training takes; print dB on held-out random poses."""
    head = boxes.head_blendshapes()
    random = boxes.randoms(head, 216, 48, 8.0)
    takes = [boxes.clip_only(head, 216, 72)["clip"], random["random"], random["held_random"]]
    with TemporaryDirectory() as folder:
        dumps = write_dumps(head, takes, Path(folder) / "dumps", change=boxes.network(head), held_out=[2])
        result = make.distill(dumps, accept_error=True)
        task, linear = result.task, result.tried[0].avatar
        seen, held = result.frames.fitted, result.frames.held_out  # the first frames, and the others
        all_frames, skeleton = task.dumps.drivers, task.skeleton
        assert skeleton is not None
        first = replace(
            all_frames,
            world_from_joint=all_frames.world_from_joint[seen],
            drivers=all_frames.drivers[seen],
            take=all_frames.take[seen],
        )
        learnt = Task.of(replace(task.dumps, drivers=first), task.layout, seen, skeleton.at(seen))
        share, known = measured_contribution(linear), replace(linear, clips=linear.clips[:2])
        with patch.object(residual, "LARGER", LARGE):
            based = residual.with_bases(learnt, known, share, lambda _: None)
        weights = np.concatenate([clip.expression_weights for clip in based.clips]).astype(np.float64)
        weights = weights[:, len(linear.expressions) :]
        mapped = _mapped(first.drivers, weights, all_frames.drivers[held], folds(first.take))
        clip = linear.clips[2]
        every = np.concatenate([clip.expression_weights, mapped.astype(np.float32)], axis=1)
        played = replace(based, clips=(*based.clips, replace(clip, expression_weights=every)))
        alone, driven = (measure.errors(task, avatar, held).decibels for avatar in (linear, played))
    print(
        f"neural, held-out random poses: drivers alone {alone:.2f} dB, with a map of the bases {driven:.2f} dB"
    )


def _mapped(known: F64, weights: F64, asked: F64, parts: list[np.ndarray]) -> F64:
    """[A, K] weights at `asked` [A, D], by Gaussian radial bases about `known` [F, D], which have `weights` [F, K].

    Width and ridge are those with the least error on the frames of each of `parts`, left out.
    """
    rows = np.arange(len(known))
    typical = float(np.median(np.linalg.norm(known[:, None] - known, axis=2)))

    def made(at: np.ndarray, points: F64, width: float, ridge: float) -> F64:
        near, far = (
            np.exp(-np.square(np.linalg.norm(x[:, None] - known[at], axis=2) / (width * typical)) / 2)
            for x in (known[at], points)
        )
        result: F64 = far @ np.linalg.solve(near + ridge * np.eye(len(at)), weights[at])
        return result

    def cost(width: float, ridge: float) -> float:
        left_out = [(np.setdiff1d(rows, part), part) for part in parts]
        return sum(
            float(np.square(made(at, known[part], width, ridge) - weights[part]).sum())
            for at, part in left_out
        )

    best = min(((width, ridge) for width in WIDTHS for ridge in RIDGES), key=lambda pair: cost(*pair))
    return made(rows, asked, *best)
