"""ARKit weights over time as JSON, from any tool. Three spellings of names, rate and frames:

    {"names": [N], "fps": 30, "frames": [[N numbers], ...]}                                    for tools of your own
    {"names": [N], "metadata": {"fps": 30, "frame_count": F}, "frames": [{"weights": [N]}]}    LAM_Audio2Expression
    {"facsNames": [N], "exportFps": 30, "numFrames": F, "weightMat": [[N numbers], ...]}       Audio2Face

Names are ARKit's, in any order and of any case; others are left out. LAM_Audio2Expression (aigc3d, 02a703c) writes the
second as bsData.json into an avatar's zip; its frames have a `time` in seconds, too, and a `rotation`, which its code
leaves empty. NVIDIA's Audio2Face writes the third from "Export as JSON"; its joints are not read.
"""

from __future__ import annotations

import json
from typing import Any, NamedTuple

import numpy as np

from avatar_export.driving.frames import DrivingTake, take
from avatar_export.formats.json_text import json_fault
from avatar_runtime.avatar import F64
from avatar_runtime.driving.arkit import CHANNELS, canonical
from avatar_runtime.io.errors import AvatarError, no_such

FILE = "bsData.json"  # its name in a zip
MAX_BYTES = 64 << 20  # about half an hour at 30 frames a second
RATES = (1.0, 1000.0)  # range of frames per second
RATE_ERROR = 0.01  # by which the times may leave the rate


class _Keys(NamedTuple):
    """Where a document says what."""

    names: str
    frames: str
    fps: tuple[str, ...]
    frame_count: tuple[str, ...] | None


OWN = _Keys("names", "frames", ("fps",), None)
LAM = _Keys("names", "frames", ("metadata", "fps"), ("metadata", "frame_count"))
AUDIO2FACE = _Keys("facsNames", "weightMat", ("exportFps",), ("numFrames",))


def is_expression_json(data: bytes) -> bool:
    """Whether `data` looks like such a file: an object with names and frames of weights."""
    begins = data[:64].removeprefix(b"\xef\xbb\xbf").lstrip()[:1] == b"{"
    return begins and any(
        all(f'"{key}"'.encode() in data for key in (keys.names, keys.frames)) for keys in (OWN, AUDIO2FACE)
    )


def read_expression_json(data: bytes, source: str) -> DrivingTake:
    """The take in the bytes of such a file; names that ARKit does not have are left out.

    Raises AvatarError, naming the frame (from 0), for a damaged file, numbers that contradict each other, and
    rotations, whose unit nobody states.
    """
    if len(data) > MAX_BYTES:
        raise AvatarError(f"is {len(data)} bytes long; up to {MAX_BYTES} are read", file=source)
    try:
        document = json.loads(data.decode("utf-8-sig"))
    except (ValueError, RecursionError) as error:
        raise AvatarError(f"is not valid JSON ({json_fault(error)})", file=source) from None
    keys = _keys_of(document)
    names, frames = _list(document, keys.names, source), _list(document, keys.frames, source)
    fps = _fps(document, keys, len(frames), source)
    weights = np.array(
        [_row(frame, f"{keys.frames}[{k}]", len(names), source) for k, frame in enumerate(frames)]
    )
    channels = np.zeros((len(frames), len(CHANNELS)))
    columns = _columns(names, keys.names, source)
    if len(frames):
        channels[:, list(columns.values())] = weights[:, list(columns)]
    missing = tuple(c for at, c in enumerate(CHANNELS) if at not in columns.values())
    found = take(_times(frames, fps, source), channels, source, missing=missing)
    if len(frames) > 1 and abs(found.fps / fps - 1) > RATE_ERROR:
        message = f"is {fps:g}, but the times of its frames make {found.fps:g}"
        raise AvatarError(message, file=source, field=".".join(keys.fps))
    return found


def _keys_of(document: Any) -> _Keys:
    if isinstance(document, dict) and AUDIO2FACE.names in document:
        return AUDIO2FACE
    return LAM if isinstance(document, dict) and "metadata" in document else OWN


def _list(document: Any, key: str, source: str) -> list[Any]:
    found = document.get(key) if isinstance(document, dict) else None
    if not isinstance(found, list):
        raise AvatarError("is missing or not a list", file=source, field=key)
    return found


def _said(document: Any, path: tuple[str, ...]) -> Any:
    for key in path:
        document = document.get(key) if isinstance(document, dict) else None
    return document


def _fps(document: Any, keys: _Keys, frames: int, source: str) -> float:
    fps = _said(document, keys.fps)
    if not _is_number(fps) or not RATES[0] <= fps <= RATES[1]:
        raise AvatarError(f"is {fps!a:.40}, not frames per second", file=source, field=".".join(keys.fps))
    count = _said(document, keys.frame_count) if keys.frame_count else None
    if keys.frame_count and count not in (None, frames):
        message = f"is {count!a:.40}, but there are {frames} frames"
        raise AvatarError(message, file=source, field=".".join(keys.frame_count))
    return float(fps)


def _columns(names: list[Any], field: str, source: str) -> dict[int, int]:
    """Column of the weights -> channel."""
    columns: dict[int, int] = {}
    for at, name in enumerate(names):
        known = canonical(name) if isinstance(name, str) else None
        if known is None:
            continue
        if CHANNELS.index(known) in columns.values():
            raise AvatarError(f"has {known} twice", file=source, field=field)
        columns[at] = CHANNELS.index(known)
    if not columns:
        raise no_such("ARKit name", ", ".join(map(str, names))[:60], CHANNELS, file=source)
    return columns


def _row(frame: Any, field: str, count: int, source: str) -> list[float]:
    if isinstance(frame, dict):
        if frame.get("rotation"):
            message = "is not empty; nobody states the unit of rotations, so remove them"
            raise AvatarError(message, file=source, field=f"{field}.rotation")
        frame, field = frame.get("weights"), f"{field}.weights"
    if not isinstance(frame, list) or len(frame) != count or not all(map(_is_number, frame)):
        raise AvatarError(f"expected {count} numbers, as many as names", file=source, field=field)
    return frame


def _times(frames: list[Any], fps: float, source: str) -> F64:
    times = [
        frame.get("time", number / fps) if isinstance(frame, dict) else number / fps
        for number, frame in enumerate(frames)
    ]
    bad = next((k for k, time in enumerate(times) if not _is_number(time)), None)
    if bad is None:
        found = np.array(times, np.float64)
        back = np.flatnonzero(~(np.diff(found) > 0))
        bad = int(back[0]) + 1 if len(back) else None
        if bad is None:
            return found
    raise AvatarError(
        "is not a number of seconds after the one before", file=source, field=f"frames[{bad}].time"
    )


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and abs(value) < 1e9
