"""Images and mattes of a capture: their headers, and their pixels.

PNG and JPEG, 8 bits, display-referred sRGB as it stands in the file: profiles and orientation tags are not applied.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from PIL import Image

from avatar_runtime import F32, AvatarError
from avatar_runtime.io import open_file

MAX_SIDE = 8192  # pixels; an image is decoded as a whole
MAX_FILE_BYTES = 512 << 20
ENDINGS = {"PNG": b"IEND\xaeB`\x82", "JPEG": b"\xff\xd9"}  # the last bytes of a whole file
TAIL = 256
COLOUR_MODES = ("RGB", "RGBA")
MASK_MODES = ("1", "L", "RGB")  # of RGB, the first channel is read: many tools write a matte to all three
BROKEN = (OSError, SyntaxError, ValueError, EOFError)  # errors that Pillow raises for a damaged file


@dataclass(frozen=True)
class Header:
    """The header of an image."""

    width: int
    height: int
    mode: str  # Pillow's


def header(path: Path) -> Header:
    """Size and mode of a whole image file, undecoded.

    Raises AvatarError for a missing, foreign or cut-off file and for sides over MAX_SIDE.
    """
    with _opened(path) as opened:
        return Header(opened.width, opened.height, opened.mode)


def colour(path: Path) -> F32:
    """[H, W, 3] 0..1. Raises AvatarError as `header`, and for a damaged or another kind of image."""
    with _opened(path) as opened:
        check_colour(path, opened.mode)
        return _unit(np.asarray(opened, np.uint8)[..., :3])


def matte(path: Path, image: Path) -> F32:
    """[H, W] 0..1, 1 where the person is: the grey of `path`, or its alpha where it is `image` itself.

    Raises AvatarError as `colour`.
    """
    with _opened(path) as opened:
        check_matte(path, opened.mode, path == image)
        pixels = np.asarray(opened.convert("L") if opened.mode == "1" else opened, np.uint8)
        channel = pixels if pixels.ndim == 2 else pixels[..., 3 if path == image else 0]
        return _unit(channel)


def person(image: Path, mask: Path, over: float | None) -> tuple[F32, F32]:
    """(straight colour [H, W, 3], matte [H, W]) of an image whose person stands before the grey `over`; None: of a
    straight image. Raises AvatarError as `matte`, and for a mask of another size."""
    found, alpha = colour(image), matte(mask, image)
    if found.shape[:2] != alpha.shape:
        raise AvatarError("is of another size than its image", file=mask)
    if over is None:
        return found, alpha
    share = alpha[:, :, None]
    straight = (found - np.float32(over) * (1 - share)) / np.maximum(share, np.float32(1 / 255))
    return np.clip(straight, 0, 1, dtype=np.float32), alpha


def check_colour(path: Path, mode: str) -> None:
    """Raise AvatarError unless an image of Pillow's `mode` is 8-bit RGB."""
    if mode not in COLOUR_MODES:
        raise AvatarError(f"is an image of mode {mode}; 8-bit RGB is needed", file=path)


def check_matte(path: Path, mode: str, is_image: bool) -> None:
    """Raise AvatarError unless an image of Pillow's `mode` holds a matte."""
    if is_image and mode != "RGBA":
        raise AvatarError("has no alpha channel and no mask belongs to it; give a mask per frame", file=path)
    if not is_image and mode not in MASK_MODES:
        raise AvatarError(f"is an image of mode {mode}; a mask has one channel of 8 bits", file=path)


@contextmanager
def _opened(path: Path) -> Iterator[Image.Image]:
    try:
        with open_file(path) as stream:
            size = stream.seek(0, 2)
            if size > MAX_FILE_BYTES:
                raise AvatarError(f"is {size} bytes long; up to {MAX_FILE_BYTES} are read", file=path)
            stream.seek(max(0, size - TAIL))
            tail = stream.read()
            stream.seek(0)
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", Image.DecompressionBombWarning)  # sides are bounded below
                opened = Image.open(stream, formats=tuple(ENDINGS))
            with opened:
                _check_whole(path, opened, tail)
                yield opened
    except FileNotFoundError:
        raise AvatarError("no such image", file=path) from None
    except Image.DecompressionBombError:
        raise AvatarError(f"has sides over {MAX_SIDE} pixels", file=path) from None
    except BROKEN as error:
        reason = str(error) or type(error).__name__
        raise AvatarError(f"cannot be read as a PNG or JPEG image ({reason[:100]!a})", file=path) from error


def _check_whole(path: Path, opened: Image.Image, tail: bytes) -> None:
    if max(opened.size) > MAX_SIDE:
        raise AvatarError(
            f"has {opened.width}x{opened.height} pixels, sides up to {MAX_SIDE} are read", file=path
        )
    if ENDINGS[str(opened.format)] not in tail:
        raise AvatarError(f"is cut off: the end of the {opened.format} is missing", file=path)


def _unit(pixels: np.ndarray[tuple[int, ...], np.dtype[np.uint8]]) -> F32:
    return np.multiply(pixels, np.float32(1 / 255), dtype=np.float32)
