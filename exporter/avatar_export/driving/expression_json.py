"""bsData.json: ARKit weights over time, as LAM_Audio2Expression (aigc3d, 02a703c) writes them into an avatar's zip.

`names`, and again `metadata.blendshape_names`: the ARKit names, in any order. `metadata.fps`, `metadata.frame_count`.
`frames`: objects with `weights`, one for each name, `time` in seconds, and `rotation`, which its code leaves empty.
"""

from __future__ import annotations

import json
from typing import Any

import numpy as np

from avatar_export.driving.frames import DrivingTake, take
from avatar_export.formats.json_text import json_fault
from avatar_runtime.avatar import F64
from avatar_runtime.driving.arkit import CHANNELS, canonical
from avatar_runtime.io.errors import AvatarError, no_such

FILE = "bsData.json"  # its name in a zip
MAX_BYTES = 64 << 20  # about half an hour at 30 frames a second
RATES = (1.0, 1000.0)  # range of frames per second
RATE_ERROR = 0.01  # by which the times may leave metadata.fps


def is_expression_json(data: bytes) -> bool:
    """Whether `data` looks like such a file: an object with names and frames of weights."""
    begins = data[:64].removeprefix(b"\xef\xbb\xbf").lstrip()[:1] == b"{"
    return begins and all(key in data for key in (b'"names"', b'"frames"', b'"weights"'))


def read_expression_json(data: bytes, source: str) -> DrivingTake:
    """The take in the bytes of a bsData.json; names that ARKit does not have are left out.

    Raises AvatarError, naming the frame (from 0), for a damaged file, numbers that contradict each other, and
    rotations, whose unit nobody states.
    """
    if len(data) > MAX_BYTES:
        raise AvatarError(f"is {len(data)} bytes long; up to {MAX_BYTES} are read", file=source)
    try:
        document = json.loads(data.decode("utf-8-sig"))
    except (ValueError, RecursionError) as error:
        raise AvatarError(f"is not valid JSON ({json_fault(error)})", file=source) from None
    names, frames = _list(document, "names", source), _list(document, "frames", source)
    fps = _fps(document, len(frames), source)
    weights = np.array([_row(frame, k, len(names), source) for k, frame in enumerate(frames)])
    channels = np.zeros((len(frames), len(CHANNELS)))
    columns = _columns(names, source)
    if len(frames):
        channels[:, list(columns.values())] = weights[:, list(columns)]
    missing = tuple(c for at, c in enumerate(CHANNELS) if at not in columns.values())
    found = take(_times(frames, fps, source), channels, source, missing=missing)
    if len(frames) > 1 and abs(found.fps / fps - 1) > RATE_ERROR:
        message = f"is {fps:g}, but the times of its frames make {found.fps:g}"
        raise AvatarError(message, file=source, field="metadata.fps")
    return found


def _list(document: Any, key: str, source: str) -> list[Any]:
    found = document.get(key) if isinstance(document, dict) else None
    if not isinstance(found, list):
        raise AvatarError("is missing or not a list", file=source, field=key)
    return found


def _fps(document: Any, frames: int, source: str) -> float:
    metadata = document.get("metadata")
    said: dict[str, Any] = metadata if isinstance(metadata, dict) else {}
    fps: Any = said.get("fps")
    count = said.get("frame_count", frames)
    if not _is_number(fps) or not RATES[0] <= fps <= RATES[1]:
        raise AvatarError(f"is {fps!a:.40}, not frames per second", file=source, field="metadata.fps")
    if count != frames:
        message = f"is {count!a:.40}, but there are {frames} frames"
        raise AvatarError(message, file=source, field="metadata.frame_count")
    return float(fps)


def _columns(names: list[Any], source: str) -> dict[int, int]:
    """Column of the weights -> channel."""
    columns: dict[int, int] = {}
    for at, name in enumerate(names):
        known = canonical(name) if isinstance(name, str) else None
        if known is None:
            continue
        if CHANNELS.index(known) in columns.values():
            raise AvatarError(f"has {known} twice", file=source, field="names")
        columns[at] = CHANNELS.index(known)
    if not columns:
        raise no_such("ARKit name", ", ".join(map(str, names))[:60], CHANNELS, file=source)
    return columns


def _row(frame: Any, number: int, count: int, source: str) -> list[float]:
    values = frame.get("weights") if isinstance(frame, dict) else None
    if not isinstance(values, list) or len(values) != count or not all(map(_is_number, values)):
        message = f"expected {count} numbers, as many as names"
        raise AvatarError(message, file=source, field=f"frames[{number}].weights")
    if frame.get("rotation"):
        message = "is not empty; nobody states the unit of rotations, so remove them"
        raise AvatarError(message, file=source, field=f"frames[{number}].rotation")
    return values


def _times(frames: list[Any], fps: float, source: str) -> F64:
    times = [frame.get("time", number / fps) for number, frame in enumerate(frames)]
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
