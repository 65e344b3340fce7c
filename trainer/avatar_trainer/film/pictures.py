"""The images and masks that a film's frames become, as files in the folder of work."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import cv2
import numpy as np
import numpy.typing as npt

from avatar_runtime import I64, AvatarError

END = b"IEND\xaeB`\x82"  # of a PNG that is whole

Picture = npt.NDArray[np.uint8]


class Pictures:
    """In the folder of work: images as they were filmed, and masks of the whole person."""

    def __init__(self, work: Path) -> None:
        self._images, self._masks = work / "images", work / "masks"

    def begin(self) -> None:
        """Make the folders."""
        for folder in (self._images, self._masks):
            folder.mkdir(parents=True, exist_ok=True)

    def there(self, row: int) -> bool:
        """Whether a frame's files are there, which are whole."""
        return all(path.is_file() and path.read_bytes().endswith(END) for path in self._paths(row))

    def write(self, row: int, image: Picture, mask: Picture) -> None:
        """A frame's image [H, W, 3] in RGB and its mask [H, W]."""
        for path, pixels in zip(self._paths(row), (image[..., ::-1], mask), strict=True):
            part = path.with_suffix(".part.png")
            if not cv2.imwrite(str(part), pixels):
                raise AvatarError("cannot be written; is the disk full?", file=path)
            part.replace(path)

    def grey(self, rows: I64) -> list[Picture]:
        """Images without colour."""
        return [_read(self._paths(int(row))[0]) for row in rows]

    def colour(self, rows: I64) -> list[Picture]:
        """Images [H, W, 3] in RGB."""
        return [_read(self._paths(int(row))[0], cv2.IMREAD_COLOR_RGB) for row in rows]

    def masks(self, rows: I64) -> list[Picture]:
        """Masks of the whole person."""
        return [_read(self._paths(int(row))[1]) for row in rows]

    def _paths(self, row: int) -> tuple[Path, Path]:
        name = f"{row:05d}.png"
        return self._images / name, self._masks / name


def cut(picture: npt.NDArray[Any], left: float, top: float, side: float, size: int) -> npt.NDArray[Any]:
    """A square of a picture as [size, size]: what falls on one pixel is averaged; pixel centres at half integers."""
    times = max(1, int(np.ceil(side / size)))
    scale = size * times / side
    move = np.array([[scale, 0, (0.5 - left) * scale - 0.5], [0, scale, (0.5 - top) * scale - 0.5]])
    fine = cv2.warpAffine(picture, move, (size * times, size * times), borderMode=cv2.BORDER_REPLICATE)
    return np.asarray(cv2.resize(fine, (size, size), interpolation=cv2.INTER_AREA))


def _read(path: Path, how: int = cv2.IMREAD_GRAYSCALE) -> Picture:
    pixels = cv2.imread(str(path), how)
    if pixels is None:
        raise AvatarError("is damaged; remove it, and run the same command again", file=path)
    return np.asarray(pixels, np.uint8)
