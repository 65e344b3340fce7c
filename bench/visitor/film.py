"""A head as a webcam sees it: drawn by `gl`, with the frame's number in its lowest rows, as a y4m file."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from PIL import Image

from avatar_export.measure.framing import framing
from avatar_runtime import Player
from avatar_runtime.avatar import Avatar
from avatar_runtime.camera import Camera
from avatar_runtime.driving.driver import Driver
from avatar_runtime.driving.frame import frame_of
from bench.visitor.takes import FPS

Array = npt.NDArray[Any]

SIZE = 448  # pixels
FOV = np.radians(50.0)  # from bottom to top, of a usual webcam
DISTANCE = 0.6  # metres
WALL = (0.55, 0.56, 0.58)
BITS, CELL = 12, 16  # of a frame's number, and pixels of a bit


def drawn(avatar: Avatar, channels: Array, backend: str = "gl") -> list[Array]:
    """u8 [SIZE, SIZE, 3] of every row of channels [F, 61]; equal rows are drawn once."""
    player, driver = Player(avatar, backend), Driver(avatar)
    framed = framing(avatar)
    part = framed["head"] or framed["whole"]
    camera = Camera.orbit(np.array(part["target"]), DISTANCE + part["size"][2] / 2, 0, 0, FOV, SIZE, SIZE)
    known: dict[bytes, Array] = {}
    for row in channels:
        if row.tobytes() not in known:
            frame = player.frame(driver.pose(frame_of(0, row)), camera, background=WALL)
            known[row.tobytes()] = frame.rgb8()
    return [known[row.tobytes()] for row in channels]


def numbered(image: Array, number: int) -> Array:
    """The image with its number: white and black squares from the lower left, the lowest bit first."""
    result = image.copy()
    for bit in range(BITS):
        result[-CELL:, bit * CELL : (bit + 1) * CELL] = 255 * (number >> bit & 1)
    return result


def write_y4m(path: Path, images: list[Array], fps: int = FPS) -> None:
    """What Chromium's fake camera plays, again and again."""
    height, width = images[0].shape[:2]
    with path.open("wb") as file:
        file.write(f"YUV4MPEG2 W{width} H{height} F{fps}:1 Ip A1:1 C420jpeg\n".encode())
        for number, image in enumerate(images):
            y, cb, cr = np.moveaxis(
                np.asarray(Image.fromarray(numbered(image, number)).convert("YCbCr")), 2, 0
            )
            file.write(b"FRAME\n" + y.tobytes() + cb[::2, ::2].tobytes() + cr[::2, ::2].tobytes())


def write_pictures(folder: Path, images: list[Array]) -> None:
    """0.jpg and so on, for browsers without such a camera."""
    folder.mkdir(exist_ok=True)
    for number, image in enumerate(images):
        Image.fromarray(numbered(image, number)).save(folder / f"{number}.jpg", quality=92)
