"""Live frames as JSON, in both directions: `session` of `serving` describes the fields."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from typing import Any

from avatar_export.formats.json_text import json_fault
from avatar_export.live.inbox import LiveFrame
from avatar_runtime.driving.arkit import ARKIT_NAMES, canonical
from avatar_runtime.io.errors import AvatarError

ANGLES = ("head", "left_eye", "right_eye")
SHAPES = len(ARKIT_NAMES)
DIGITS = 5  # after the point


def frame_message(frame: LiveFrame, epoch_ms: float) -> dict[str, Any]:
    """What a page hears about a frame; `epoch_ms` is the moment 0 of `received`, milliseconds since 1970."""
    values = [round(value, DIGITS) for value in frame.channels]
    turns = {name: values[SHAPES + 3 * k : SHAPES + 3 * k + 3] for k, name in enumerate(ANGLES)}
    return {
        "type": "live",
        "time": round(frame.received, 6),
        "weights": values[:SHAPES],
        **turns,
        "received_ms": round(epoch_ms + 1e3 * frame.received),
    }


def channels_of(text: str | bytes) -> list[float]:
    """The 61 channels of a frame that a program sent. Raises AvatarError for what is not understood."""
    try:
        said = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise AvatarError(f"is not JSON: {json_fault(error)}") from None
    if not isinstance(said, dict):
        raise AvatarError('is not an object such as {"weights": {"jawOpen": 0.5}}')
    values = _weights(said.get("weights", {}))
    for name in ANGLES:
        values += _numbers(said.get(name, (0.0, 0.0, 0.0)), 3, name)
    return values


def _weights(said: Any) -> list[float]:
    if not isinstance(said, Mapping):
        return _numbers(said, SHAPES, "weights")
    values = [0.0] * SHAPES
    for name, value in said.items():
        known = canonical(name)
        if known is None:
            raise AvatarError(f"{name[:40]!r} is not an ARKit name", field="weights")
        values[ARKIT_NAMES.index(known)] = _numbers([value], 1, f"weights.{known}")[0]
    return values


def _numbers(said: Any, count: int, field: str) -> list[float]:
    plain = isinstance(said, Sequence) and not isinstance(said, str) and len(said) == count
    if not plain or not all(isinstance(v, int | float) and not isinstance(v, bool) for v in said):
        raise AvatarError(f"is not {count} number{'s' * (count > 1)}", field=field)
    try:
        return [float(value) for value in said]
    except OverflowError:
        raise AvatarError("is too large", field=field) from None
