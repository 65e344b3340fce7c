"""Poses and expressions of the frames, refined while the avatar is trained: `TrainSettings.refine`.

In some epochs every training frame makes one step of `align` after its iteration, with the rendering that the
iteration made. Frames that are held out are refined by the same steps with the trained avatar as it is.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import torch
from torch import Tensor

from avatar_runtime import AvatarError
from avatar_trainer.captures.mesh_raster import intrinsics
from avatar_trainer.captures.model import Capture, Frame
from avatar_trainer.captures.targets import Targets
from avatar_trainer.loop.align import better
from avatar_trainer.loop.values import Values
from avatar_trainer.systems.drawing import DRAWING, Drawing, draw
from avatar_trainer.systems.protocol import System
from avatar_trainer.tensors import Rendered

ROUNDS, SHARE = (
    12,
    0.5,
)  # epochs in which the training frames make a step: at most so many, and this share of all
FIRST, LAST = (
    0.2,
    0.75,
)  # shares of the iterations between which they lie: the avatar learns first, and settles last
ALONE = 2  # first steps of a frame that move the head alone
INEXACT = 0.2  # of the expected deviation of a value: what a step can miss
SKEW = 1e-3  # pixels
STEPS = 8  # of a frame that is held out


class Refinement:
    """The present values of the training frames of a capture. Frames that share a pose share its values."""

    def __init__(self, capture: Capture, iterations: int) -> None:
        for frame in capture.frames:
            if abs(intrinsics(frame.camera)[0, 1]) > SKEW:
                raise AvatarError(
                    f"frame {frame.name}: a camera with skew cannot be refined; --refine off",
                    file=capture.folder,
                )
        self.tracked, self.values = capture, Values.of(capture)
        rows = {id(frame.pose): row for row, frame in reversed([*enumerate(capture.train)])}
        self._row = {f.name: rows[id(f.pose)] for f in capture.frames if id(f.pose) in rows}
        self._tracked = {frame.name: frame for frame in capture.frames}
        self._poses = [frame.pose for frame in capture.train]
        self._change = np.zeros((len(capture.train), self.values.count))
        self._steps = np.zeros(len(capture.train), np.int64)
        self._epochs = rounds(len(capture.train), iterations)

    def frame(self, frame: Frame) -> Frame:
        """A frame as it is refined now; one that is held out as it was tracked."""
        row, tracked = self._row.get(frame.name), self._tracked[frame.name]
        if row is None:
            return tracked
        camera = self.values.camera(tracked, self._change[row])
        return replace(tracked, pose=self._poses[row], camera=camera)

    def begin(self, iteration: int) -> None:
        """Before an iteration; between epochs with steps the mean change of all frames becomes 0, small ones shrink.

        What all frames have in common is the avatar's shape, not a fault of a frame; it would wander. If the changes of
        a value are as small in all frames as the steps are inexact, they are no faults of the tracker.
        """
        epoch, place = divmod(iteration - 1, len(self.tracked.train))
        if place or not min(self._epochs) < epoch <= max(self._epochs) + 1:
            return
        rows = self._rows()
        change = self._change[rows] - self._change[rows].mean(axis=0)
        if epoch in self._epochs:
            inexact, square = np.square(INEXACT * self.values.deviation), np.square(change).mean(axis=0)
            change *= 1 - np.minimum(inexact / np.maximum(square, 1e-12 * inexact), 1)
        for row, found in zip(rows, change, strict=True):
            self._change[row] = found.clip(*self.values.bounds(self.tracked.train[row].pose))
        self._place()

    def step(self, iteration: int, frame: Frame, rendered: Rendered, wanted: Tensor, mask: Tensor) -> None:
        """After an iteration: its frame's values, by its rendering and its image `wanted` over the same background."""
        if (iteration - 1) // len(self.tracked.train) not in self._epochs:
            return
        row, tracked = self._row[frame.name], self._tracked[frame.name]
        self._change[row] = better(
            self.values, tracked, self._change[row], rendered.colour, wanted, mask, self._steps[row] < ALONE
        )
        self._steps[row] += 1
        self._poses[row] = self.values.posed(self._tracked[frame.name].pose, self._change[row])

    def present(self) -> Capture:
        """The capture as it is refined now."""
        return replace(self.tracked, frames=tuple(self.frame(frame) for frame in self.tracked.frames))

    def held_out(
        self, system: System, frames: Sequence[Frame], targets: Targets, by: Drawing = DRAWING
    ) -> list[Frame]:
        """Some frames, those that are held out refined by the avatar as it is."""
        return [self._held_out(system, frame, targets, by) for frame in frames]

    def _held_out(self, system: System, frame: Frame, targets: Targets, by: Drawing) -> Frame:
        if frame.name in self._row:  # another camera's frame of a trained pose
            return self.frame(frame)
        tracked, target = self._tracked[frame.name], targets(frame)
        found, wanted, change = tracked, target.over(torch.zeros(3)), np.zeros(self.values.count)
        for count in range(STEPS):
            drawn = draw(system, found, by=by).colour
            change = better(self.values, tracked, change, drawn, wanted, target.mask, count < ALONE)
            found = self.values.moved(tracked, change)
        return found

    def state(self) -> dict[str, Any]:
        """Everything that `load_state` needs."""
        return {"change": torch.from_numpy(self._change), "steps": torch.from_numpy(self._steps)}

    def load_state(self, state: Any) -> None:
        """Continue from `state`. Raises AvatarError for one that does not fit the capture."""
        try:
            change, steps = (state[name].numpy() for name in ("change", "steps"))
            fits = (change.shape, steps.shape) == (self._change.shape, self._steps.shape)
            fits = fits and (change.dtype, steps.dtype) == (np.float64, np.int64)
        except (KeyError, TypeError, AttributeError):
            fits = False
        if not fits:
            raise AvatarError(
                "the checkpoint's refined poses do not fit the capture; --no-resume starts again"
            )
        self._change, self._steps = change.copy(), steps.copy()
        self._place()

    def _rows(self) -> list[int]:
        return sorted({*self._row.values()})

    def _place(self) -> None:
        for row in self._rows():
            self._poses[row] = self.values.posed(self.tracked.train[row].pose, self._change[row])


def rounds(frames: int, iterations: int) -> frozenset[int]:
    """The epochs, from 0, in which frames make a step: evenly spaced."""
    first, last = (round(share * iterations / frames) for share in (FIRST, LAST))
    count = min(ROUNDS, max(1, round(SHARE * iterations / frames)))
    return frozenset(np.linspace(first, max(first, last - 1), count).round().astype(int).tolist())
