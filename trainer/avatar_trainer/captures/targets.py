"""A capture's images in memory: decoded ahead, kept as bytes within a bound, made smaller if a run asks for it."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt
import torch
from PIL import Image
from torch import Tensor

from avatar_runtime import Camera
from avatar_trainer.captures.image_files import person
from avatar_trainer.captures.model import Capture, Frame

U8 = npt.NDArray[np.uint8]
F32 = npt.NDArray[np.float32]
AHEAD = 4  # images decoded before they are asked for


@dataclass(frozen=True)
class Target:
    """The target image of a frame."""

    image: Tensor  # [H, W, 3] float32 0..1
    mask: Tensor  # [H, W] float32 0..1

    def over(self, background: Tensor) -> Tensor:
        """[H, W, 3] the person before a background [3]."""
        mask = self.mask[:, :, None]
        return self.image * mask + background * (1 - mask)


def resized(capture: Capture, size: int) -> Capture:
    """The capture with cameras of `size` pixels along the longer side; unchanged for 0 or a larger size."""
    longer = max(capture.width, capture.height)
    if size == 0 or size >= longer:
        return capture
    width, height = (max(1, round(side * size / longer)) for side in (capture.width, capture.height))
    frames = tuple(replace(f, camera=_resized(f.camera, width, height)) for f in capture.frames)
    return replace(capture, width=width, height=height, frames=frames)


def evenly(frames: Sequence[Frame], count: int) -> list[Frame]:
    """At most `count` of some frames, evenly spaced from the first to the last."""
    if len(frames) <= count:
        return list(frames)
    return [frames[i] for i in np.linspace(0, len(frames) - 1, count).round().astype(int)]


def read(frame: Frame) -> Target:
    """One frame's target at the size of its camera. Raises AvatarError for a file that cannot be read any more."""
    return _target(_decoded(frame))


class Targets:
    """Targets of frames, at the size of their cameras. Use it in a `with`: a thread decodes."""

    def __init__(self, megabytes: int) -> None:
        self._room = megabytes << 20
        self._kept: dict[str, U8] = {}
        self._coming: dict[str, Future[U8]] = {}
        self._pool = ThreadPoolExecutor(1, "decode")

    def __enter__(self) -> Targets:
        return self

    def __exit__(self, *_: object) -> None:
        self._pool.shutdown(cancel_futures=True)

    def expect(self, frames: Iterable[Frame]) -> None:
        """Begin to decode frames that will be asked for soon."""
        for frame in frames:
            if len(self._coming) < AHEAD and frame.name not in self._kept and frame.name not in self._coming:
                self._coming[frame.name] = self._pool.submit(_decoded, frame)

    def __call__(self, frame: Frame) -> Target:
        """The target of a frame. Raises AvatarError for a file that cannot be read any more."""
        rgba = self._kept.get(frame.name)
        if rgba is None:
            coming = self._coming.pop(frame.name, None)
            rgba = _decoded(frame) if coming is None else coming.result()
            if rgba.nbytes <= self._room:  # the first ones are kept: every epoch asks for each once
                self._room -= rgba.nbytes
                self._kept[frame.name] = rgba
        return _target(rgba)


def _decoded(frame: Frame) -> U8:
    """[H, W, 4] bytes: image and mask."""
    image, mask = _fitted(*person(frame.image, frame.mask, frame.over), frame)
    return np.rint(np.dstack([image, mask]) * 255).astype(np.uint8)


def _target(rgba: U8) -> Target:
    pixels = torch.from_numpy(rgba).to(torch.float32) / 255
    return Target(pixels[:, :, :3].contiguous(), pixels[:, :, 3].contiguous())


def _resized(camera: Camera, width: int, height: int) -> Camera:
    """The same view on fewer pixels; the values of a camera are relative to its image."""
    return replace(camera, width=width, height=height)


def _fitted(image: F32, mask: F32, frame: Frame) -> tuple[F32, F32]:
    """Image and mask at the camera's size, averaged over areas; the image weighted by the mask, so that the
    background does not bleed in."""
    size = frame.camera.width, frame.camera.height
    if mask.shape == size[::-1]:
        return image, mask
    small = _averaged(mask, size)
    planes = [_averaged(image[:, :, c] * mask, size) for c in range(3)]
    straight = np.dstack(planes) / np.maximum(small, 1e-6)[:, :, None]
    return np.clip(straight, 0, 1, dtype=np.float32), small


def _averaged(plane: F32, size: tuple[int, int]) -> F32:
    small = Image.fromarray(np.ascontiguousarray(plane, np.float32)).resize(size, Image.Resampling.BOX)
    clipped: F32 = np.clip(np.asarray(small), 0, 1, dtype=np.float32)
    return clipped
