"""A film as upright frames, one at a time: at most two whole frames are in memory, however long it is.

OpenCV decodes (FFmpeg inside its wheels), from an open file: it never sees a name, so that no address, no `-` and no
series of pictures is opened. Its FFmpeg turns HDR into the colours of SDR by itself.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO, cast

import cv2
import numpy as np
import numpy.typing as npt

from avatar_export.notes import note
from avatar_runtime import AvatarError
from avatar_trainer.film import boxes

os.environ.setdefault(
    "OPENCV_FFMPEG_LOGLEVEL", "-8"
)  # FFmpeg says nothing; OpenCV reads it at its first film

SECONDS = 60.0  # that are read where no last second is named
FEWEST = 10  # frames: fewer are no film
LONGEST_SIDE = 8192  # pixels: 8K; a decoder would take gigabytes for more
LONGEST_UNSTATED = 600.0  # seconds to which a film without a stated length is read ahead
CLOCK = 0.0025  # seconds by which frames of a constant rate differ, where the file counts milliseconds
FASTEST = 1000.0  # frames a second
TIMEOUT_MS = 20_000  # in which a file is opened, or a frame is read
WIDTH_35MM = (
    34.6  # millimetres: of a 4:3 picture with the diagonal of 24x36, as the sensors of phones have it
)
TURNS = {90: cv2.ROTATE_90_CLOCKWISE, 180: cv2.ROTATE_180, 270: cv2.ROTATE_90_COUNTERCLOCKWISE}
Picture = npt.NDArray[np.uint8]


@dataclass(frozen=True)
class Facts:
    """What is known of a film before its frames are read."""

    path: Path
    width: int  # pixels, upright
    height: int
    fps: float  # mean
    frames: int  # estimate
    seconds: float
    rotation: int  # degrees clockwise that make the stored frames upright
    transfer: str  # "sdr" | "pq" | "hlg"
    codec: str
    focal_px: float | None  # from the lens that the file states
    mirrored: bool = False  # left and right are changed, after the rotation
    constant: bool = True  # all frames have the same length


def probe(path: Path) -> Facts:
    """The facts of a film. Raises AvatarError for what is no usable video."""
    with _opened(path) as file:
        container = boxes.expect_film(file, path)
        stated = boxes.read(file, path) if container == "mp4" else boxes.Stated(["vide"])
        if "vide" not in stated.kinds:
            raise AvatarError("has sound but no picture; film the face with the camera of a phone", file=path)
        boxes.expect_decodable(stated.codec, path)
        _expect_size(stated.width, stated.height, path)
        reader = _reader(file, path)
        width, height = _displayed(reader)
        _expect_size(width, height, path)
        times = _first_times(reader, path)
        rotation = stated.rotation
        if container != "mp4":
            rotation = round(reader.get(cv2.CAP_PROP_ORIENTATION_META)) % 360 // 90 * 90
        fps, seconds, constant = stated.fps, stated.seconds, stated.constant
        if not (fps and seconds):
            fps, seconds, constant = _measured(reader, times)
        codec = stated.codec or boxes.fourcc(int(reader.get(cv2.CAP_PROP_FOURCC)))
    if not 0 < fps <= FASTEST:
        raise AvatarError(f"states {fps:g} frames a second, which cannot be; film it again", file=path)
    if rotation in (90, 270):
        width, height = height, width
    focal = stated.focal_35mm and stated.focal_35mm * max(width, height) / WIDTH_35MM
    return Facts(
        path,
        width,
        height,
        fps,
        max(round(seconds * fps), len(times)),
        seconds,
        rotation,
        stated.transfer,
        codec,
        focal,
        stated.mirrored,
        constant,
    )


def said(facts: Facts, first: float = 0.0, last: float | None = None) -> list[note.Note]:
    """What should be known of a film of which these seconds are read."""
    found = []
    if facts.transfer != "sdr":
        found.append(note.doubt("film_hdr", transfer=facts.transfer.upper()))
    if not facts.constant:
        found.append(note.fact("film_uneven", fps=facts.fps))
    if last is None and first + SECONDS < facts.seconds:
        found.append(note.fact("film_part", seconds=facts.seconds, first=first, last=first + SECONDS))
    return found


def frames(
    facts: Facts,
    *,
    first: float = 0.0,
    last: float | None = None,
    every: int = 1,
    fps: float | None = None,
    longest: int | None = None,
    crop: tuple[int, int, int, int] | None = None,
    rotation: int | None = None,
) -> Iterator[tuple[int, float, Picture]]:
    """Index, second and RGB [H, W, 3] of the frames from second `first` to `last` (SECONDS later, where not named).

    `every`: each n-th frame; the index counts the film's frames. `fps`: a constant rate instead, by the nearest frame;
    index and second count from `first`. `rotation`: degrees clockwise instead of the film's own. `crop`: X, Y, width
    and height of the upright frame. `longest`: larger frames are made smaller. Raises AvatarError.
    """
    if fps is not None and every != 1:
        raise ValueError("name every or fps, not both")
    view = _View.of(facts, longest, crop, rotation)
    if not 0 <= first < facts.seconds:
        raise AvatarError(
            f"{first:g} is no second of the film, which has {facts.seconds:.1f}",
            file=facts.path,
            field="--first",
        )
    end = first + SECONDS if last is None else last
    if not end > first:  # or no number
        raise AvatarError(f"{end:g} is not behind second {first:g}", file=facts.path, field="--last")
    if fps is not None:
        return _resampled(facts, view, first, min(end, facts.seconds), fps)
    return _read(facts, view, end, lambda index, time: time >= first and index % every == 0)


def upright(facts: Facts, rotation: int | None = None) -> tuple[int, int]:
    """Width and height of the upright film."""
    return _View.of(facts, None, None, rotation).upright


def shape(
    facts: Facts,
    longest: int | None = None,
    crop: tuple[int, int, int, int] | None = None,
    rotation: int | None = None,
) -> tuple[int, int, float]:
    """Width and height of the frames that `frames` makes, and how many of their pixels a pixel of the film takes."""
    view = _View.of(facts, longest, crop, rotation)
    return view.size[0], view.size[1], view.size[0] / view.crop[2]


def _read(
    facts: Facts, view: _View, end: float, taken: Callable[[int, float], bool]
) -> Iterator[tuple[int, float, Picture]]:
    """The frames before second `end` that are taken; the others are decoded, and not looked at."""
    with _opened(facts.path) as file:
        reader, index = _reader(file, facts.path), -1
        while _grab(reader):
            index += 1
            time = reader.get(cv2.CAP_PROP_POS_MSEC) / 1000
            if time >= end:
                return
            if taken(index, time):
                yield index, time, view.picture(reader, facts.path)


def _resampled(
    facts: Facts, view: _View, first: float, end: float, fps: float
) -> Iterator[tuple[int, float, Picture]]:
    tick, before, kept = 0, -np.inf, None
    # In a film of constant rate the nearest frame is at most half a frame away.
    near = 0.75 / facts.fps if facts.constant else np.inf

    def taken(_: int, time: float) -> bool:
        return time > first + tick / fps - near

    for _, time, picture in _read(facts, view, end + 1 / fps, taken):
        while (wanted := first + tick / fps) <= time and wanted < end:
            yield tick, wanted, kept if kept is not None and wanted - before < time - wanted else picture
            tick += 1
        before, kept = time, picture
    while kept is not None and (wanted := first + tick / fps) < min(end, before + 1 / facts.fps):
        yield tick, wanted, kept
        tick += 1


@dataclass(frozen=True)
class _View:
    """How a stored frame becomes a picture."""

    rotation: int
    mirrored: bool
    upright: tuple[int, int]  # width, height
    crop: tuple[int, int, int, int]  # of the upright frame
    size: tuple[int, int]  # of the picture

    @staticmethod
    def of(
        facts: Facts, longest: int | None, crop: tuple[int, int, int, int] | None, rotation: int | None
    ) -> _View:
        turned = facts.rotation if rotation is None else rotation
        if turned not in (0, *TURNS):
            raise AvatarError(f"{turned} is none of 0, 90, 180 and 270", file=facts.path, field="--rotation")
        width, height = facts.width, facts.height
        if (turned - facts.rotation) % 180:
            width, height = height, width
        x, y, w, h = crop or (0, 0, width, height)
        if min(x, y) < 0 or min(w, h) < 1 or x + w > width or y + h > height:
            raise AvatarError(
                f"{x},{y},{w},{h} is not inside the upright frame of {width}x{height} pixels",
                file=facts.path,
                field="--crop",
            )
        scale = min(1.0, (longest or max(w, h)) / max(w, h))
        size = max(round(w * scale), 1), max(round(h * scale), 1)
        return _View(turned, facts.mirrored, (width, height), (x, y, w, h), size)

    def picture(self, reader: cv2.VideoCapture, path: Path) -> Picture:
        """The frame that was grabbed, in RGB."""
        taken, pixels = reader.retrieve()
        if not taken:
            raise AvatarError(
                "holds a frame that cannot be decoded; name --first and --last around it", file=path
            )
        if self.rotation:
            pixels = cv2.rotate(pixels, TURNS[self.rotation])
        if self.mirrored:
            pixels = cv2.flip(pixels, 1)
        if pixels.shape[1::-1] != self.upright:  # pixels that are not square, or a film that changes its size
            pixels = cv2.resize(pixels, self.upright, interpolation=cv2.INTER_LINEAR)
        x, y, w, h = self.crop
        pixels = pixels[y : y + h, x : x + w]
        if (w, h) != self.size:
            pixels = cv2.resize(pixels, self.size, interpolation=cv2.INTER_AREA)
        return np.asarray(cv2.cvtColor(pixels, cv2.COLOR_BGR2RGB))


def _opened(path: Path) -> BinaryIO:
    if not path.is_file():
        why = "is a folder" if path.is_dir() else "is no file" if path.exists() else "is not there"
        raise AvatarError(f"{why}; name a video file (MP4, MOV, WebM, MKV, AVI)", file=path)
    try:
        return path.open("rb")
    except OSError as error:
        raise AvatarError(f"cannot be read ({error.strerror or error})", file=path) from None


def _reader(file: BinaryIO, path: Path) -> cv2.VideoCapture:
    level = cv2.utils.logging.setLogLevel(0)
    file.seek(0)
    reader = cv2.VideoCapture()
    limits = [cv2.CAP_PROP_OPEN_TIMEOUT_MSEC, TIMEOUT_MS, cv2.CAP_PROP_READ_TIMEOUT_MSEC, TIMEOUT_MS]
    try:
        opened = reader.open(cast("cv2.IStreamReader", file), cv2.CAP_FFMPEG, limits)
    except cv2.error:
        opened = False
    finally:
        cv2.utils.logging.setLogLevel(level)
    if not opened:
        raise AvatarError("cannot be decoded: it is damaged or its codec is not known here; "
                          "convert it to MP4 with H.264", file=path)  # fmt: skip
    reader.set(cv2.CAP_PROP_ORIENTATION_AUTO, 0)  # turned here, once
    return reader


def _grab(reader: cv2.VideoCapture) -> bool:
    try:
        return bool(reader.grab())
    except cv2.error:
        return False


def _first_times(reader: cv2.VideoCapture, path: Path) -> list[float]:
    """Seconds of the first frames, at least two. Raises AvatarError if there are too few, or none can be decoded."""
    times: list[float] = []
    while len(times) < 2 * FEWEST and _grab(reader):
        times.append(reader.get(cv2.CAP_PROP_POS_MSEC) / 1000)
    if not times:
        raise AvatarError("holds no frame that can be decoded; copy it once more, or film again", file=path)
    if len(times) == 1:
        raise AvatarError("is a still picture: one frame; film the face for 30 seconds", file=path)
    if len(times) < FEWEST:
        raise AvatarError(f"has only {len(times)} frames; film the face for 30 seconds", file=path)
    return times


def _measured(reader: cv2.VideoCapture, times: list[float]) -> tuple[float, float, bool]:
    """Rate, seconds, and whether the rate is constant, by the first frames, where no index states them.

    A film that no header measures is read to its end.
    """
    constant = float(np.ptp(np.diff(times))) < CLOCK
    fps = (len(times) - 1) / max(times[-1] - times[0], 1e-6)
    frames, rate = reader.get(cv2.CAP_PROP_FRAME_COUNT), reader.get(cv2.CAP_PROP_FPS)
    if frames > 0 and rate > 0:
        return fps, max(frames / rate, times[-1]), constant
    last = times[-1]
    while last < LONGEST_UNSTATED and _grab(reader):
        last = reader.get(cv2.CAP_PROP_POS_MSEC) / 1000
    return fps, last + 1 / fps, constant


def _displayed(reader: cv2.VideoCapture) -> tuple[int, int]:
    """The size of a frame with square pixels, before it is turned."""
    width, height = reader.get(cv2.CAP_PROP_FRAME_WIDTH), reader.get(cv2.CAP_PROP_FRAME_HEIGHT)
    across, down = reader.get(cv2.CAP_PROP_SAR_NUM), reader.get(cv2.CAP_PROP_SAR_DEN)
    if across > 0 and down > 0 and 1 / 4 <= across / down <= 4:
        width *= across / down
    return round(width), round(height)


def _expect_size(width: int, height: int, path: Path) -> None:
    if max(width, height) > LONGEST_SIDE:
        raise AvatarError(
            f"states frames of {width}x{height} pixels; at most {LONGEST_SIDE} a side are read: film in 1080p",
            file=path,
        )
