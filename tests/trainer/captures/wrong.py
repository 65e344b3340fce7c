"""Captures that can be read and are wrong: each is a right one with a usual mistake."""

from __future__ import annotations

import json
import os
import shutil
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from PIL import Image

Array = npt.NDArray[Any]
Document = dict[str, Any]
AXES = np.diag([1.0, -1.0, -1.0, 1.0])
Z_UP = np.array([[1.0, 0, 0, 0], [0, 0, -1, 0], [0, 1, 0, 0], [0, 0, 0, 1]])


@dataclass(frozen=True)
class Mistake:
    """One mistake, for a capture.json; `says` is what the check must say of it."""

    what: str
    change: Callable[[Document], object]
    says: str
    faces_only: bool = False  # bodies have no expressions


def made(take: Path, mistake: Mistake, folder: Path) -> Path:
    """A copy of the capture `take` in `folder`, with the mistake; images are links."""
    shutil.copytree(take, folder, copy_function=_linked)
    file = folder / "capture.json"
    document = json.loads(file.read_text())
    mistake.change(document)
    file.unlink()
    file.write_text(json.dumps(document))
    return folder


def _linked(source: str, target: str) -> None:
    os.link(source, target)


def _cameras(change: Callable[[Array, Array, Document], tuple[Array, Array]]) -> Callable[[Document], None]:
    def all_cameras(document: Document) -> None:
        for frame in document["frames"]:
            camera = frame["camera"]
            view = np.eye(4)
            view[:3, :3], view[:3, 3] = camera["R"], camera["t"]
            k, view = change(np.array(camera["K"]), view, document)
            camera.update(K=k.tolist(), R=view[:3, :3].tolist(), t=view[:3, 3].tolist())

    return all_cameras


def _lengths(factor: float) -> Callable[[Document], None]:
    return _cameras(lambda k, m, _: (k, m * np.array([[1, 1, 1, factor]])))


def _pixels(factor: float) -> Callable[[Document], None]:
    return _cameras(lambda k, m, _: (np.diag([factor, factor, 1]) @ k, m))


def _fractions(k: Array, view: Array, document: Document) -> tuple[Array, Array]:
    return np.diag([1 / document["width"], 1 / document["height"], 1]) @ k, view


def _transposed(k: Array, view: Array, _: Document) -> tuple[Array, Array]:
    result = view.copy()
    result[:3, :3] = view[:3, :3].T
    return k, result


def _position(k: Array, view: Array, _: Document) -> tuple[Array, Array]:
    result = view.copy()
    result[:3, 3] = -view[:3, :3].T @ view[:3, 3]
    return k, result


def _frames(change: Callable[[Document], object]) -> Callable[[Document], None]:
    def all_frames(document: Document) -> None:
        for frame in document["frames"]:
            change(frame)

    return all_frames


def _degrees(frame: Document) -> None:
    frame["joints"] = {name: np.degrees(turn).tolist() for name, turn in frame["joints"].items()}


def _images(order: Callable[[list[Any]], list[Any]]) -> Callable[[Document], None]:
    def reordered(document: Document) -> None:
        frames = document["frames"]
        pairs = order([(frame["image"], frame["mask"]) for frame in frames])
        for frame, (image, mask) in zip(frames, pairs, strict=True):
            frame.update(image=image, mask=mask)

    return reordered


def _only_first(document: Document) -> None:
    document["frames"] = document["frames"][:1]


def _not_a_list(document: Document) -> None:
    document["frames"] = document["frames"][0]


def invert_masks(take: Path) -> Path:
    """Write 255 minus each mask of a capture that `made` made."""
    for file in (take / "masks").iterdir():
        mask = 255 - np.asarray(Image.open(file))
        file.unlink()
        Image.fromarray(mask).save(file)
    return take


MISTAKES = (
    Mistake("cameras of OpenGL", _cameras(lambda k, m, _: (k, AXES @ m)), "cameras of OpenGL"),
    Mistake("translations in millimetres", _lengths(1000), "translations in millimetres"),
    Mistake("translations in centimetres", _lengths(100), "translations in centimetres"),
    Mistake("lengths times 4 (IMavatar)", _lengths(4), "4 times as large"),
    Mistake("K in fractions of the image", _cameras(_fractions), "K in fractions of the image"),
    Mistake("K of images twice as large", _pixels(2), "K of images twice as large"),
    Mistake("K of images half as large", _pixels(0.5), "K of images half as large"),
    Mistake("world from camera", _cameras(lambda k, m, _: (k, np.linalg.inv(m))), "world from camera"),
    Mistake(
        "NeRF's transform_matrix", _cameras(lambda k, m, _: (k, np.linalg.inv(m) @ AXES)), "transform_matrix"
    ),
    Mistake("R transposed", _cameras(_transposed), "rotations of world from camera"),
    Mistake("the camera's position as t", _cameras(_position), "position in the world as t"),
    Mistake("a world with z up", _cameras(lambda k, m, _: (k, m @ Z_UP)), "world with z up"),
    Mistake("joints in degrees", _frames(_degrees), "in degrees", faces_only=True),
    Mistake(
        "weights in percent",
        _frames(lambda f: f.update(expression=[100 * x for x in f["expression"]])),
        "percent",
        faces_only=True,
    ),
    Mistake(
        "expression names reversed",
        lambda d: d["expressions"].reverse(),
        "reverse order of their names",
        faces_only=True,
    ),
    Mistake(
        "`joint` for `joints`", _frames(lambda f: f.update(joint=f.pop("joints"))), "did you mean joints"
    ),
    Mistake("images in reverse order", _images(lambda pairs: pairs[::-1]), "reverse order of the images"),
    Mistake("images one frame off", _images(lambda pairs: [*pairs[1:], pairs[0]]), "one frame off"),
    Mistake("one frame in the list", _only_first, "leaves 1 to train on; training needs at least 2 frames"),
    Mistake("one frame for the list", _not_a_list, "is one frame; a list of frames is needed"),
)
