"""Idle life: what a person does who only sits there. Breath, blinks, glances, a head that is never quite still.

A function of time and a seed, without state: any moment can be asked for, in any order, and nothing repeats. Random
numbers are hashes of 32-bit integers (`_random`), and all else is additions, products, quotients and one square root of
doubles, so the players compute the same numbers. Every number of the curves is in `idle.json` of avatar_schema, with
reason and source.
"""

from __future__ import annotations

import math

from avatar_runtime.checks import arguments
from avatar_runtime.driving.arkit import ARKIT_NAMES, CHANNELS
from avatar_runtime.driving.axes import RADIANS_PER_EYE_WEIGHT
from avatar_runtime.driving.frame import DrivingFrame, frame_of
from avatar_schema.documents import idle_table

_T = idle_table()
_DEGREE = math.pi / 180
_HEAD = len(ARKIT_NAMES)  # place of headYaw in CHANNELS; pitch and roll follow, then the eyes
_MASK = 0xFFFFFFFF
_AT = {name: at for at, name in enumerate(CHANNELS)}
# Streams of random numbers. A row of "wander" has its own, from _ROWS on.
_BLINK, _PAIR, _SHIFT, _WHERE, _YAW, _PITCH, _DRIFT_YAW, _DRIFT_PITCH, _BREATH, _ROWS = range(1, 11)


def idle(seconds: float, seed: int = 0) -> DrivingFrame:
    """The frame of idle life at a time: weights of all 52 ARKit names, head and eyes.

    `seconds` may be any time, also before 0; `seed` is an integer, of which the lowest 32 bits count. The eyes are
    parallel and look at the viewer, straight ahead of the resting head, most of the time, never more than 9 degrees
    away. Raises TypeError or ValueError for arguments of other types, and for times that are not finite.
    """
    arguments.finite("seconds", seconds)
    arguments.whole("seed", seed)
    seed &= _MASK
    channels = [0.0] * len(CHANNELS)
    _wander(channels, seconds, seed)
    _breathe(channels, seconds, seed)
    _look(channels, seconds, seed)
    lids = _blink(seconds, seed)
    channels[_AT["eyeBlinkLeft"]] += lids
    channels[_AT["eyeBlinkRight"]] += lids
    return frame_of(seconds, channels)


def _wander(channels: list[float], seconds: float, seed: int) -> None:
    for row, (names, knot_s, size) in enumerate(_T["wander"]):
        value = _curve(seconds / knot_s, seed, _ROWS + row)
        _add(channels, names, size, value, 1.0 + value)


def _breathe(channels: list[float], seconds: float, seed: int) -> None:
    part, knot_s = _T["breath_drift"]
    breaths = seconds / _T["breath_every_s"] + part * _curve(seconds / knot_s, seed, _BREATH)
    at = breaths - math.floor(breaths)
    since_in = at - _T["breath_in"]
    full = _eased(at / _T["breath_in"]) if since_in < 0 else 1.0 - _eased(since_in / _T["breath_out"])
    for names, size in _T["breath"]:
        _add(channels, names, size, full, full)


def _add(channels: list[float], names: str, size: float, angle: float, weight: float) -> None:
    for name in names.split():
        at = _AT[name]
        channels[at] += size * _DEGREE * angle if at >= _HEAD else size * weight


def _look(channels: list[float], seconds: float, seed: int) -> None:
    """Shifts the gaze; the head comes after, and the eyes turn back by what the head has turned."""
    now = _fixation(seconds, seed)
    knot_s, size = _T["gaze_wander"]
    delay, turn_s = _T["head_delay_s"], _T["head_turn_s"]
    for axis, stream in enumerate((_DRIFT_YAW, _DRIFT_PITCH)):
        at = [_target(k, axis, seed) for k in range(now - 3, now + 1)]
        since = seconds - _shift(now, seed)
        eased = _eased(since / _saccade_s(_distance(now, seed)))
        gaze = at[2] + eased * (at[3] - at[2]) + size * _curve(seconds / knot_s, seed, stream)
        head = at[0]  # the shifts before `now` - 2 are over
        for step in range(1, 4):
            since = seconds - _shift(now - 3 + step, seed) - delay
            head += _eased(since / turn_s) * (at[step] - at[step - 1])
        channels[_HEAD + axis] += _T["head_share"] * _DEGREE * head
        _turn_eyes(channels, axis, _DEGREE * gaze - channels[_HEAD + axis])


def _turn_eyes(channels: list[float], axis: int, angle: float) -> None:
    """Both eyes by an angle in the head, to the subject's left (axis 0) or up (1), as channels and as weights."""
    for eye in (1, 2):
        channels[_HEAD + 3 * eye + axis] = -angle
    weight = angle / RADIANS_PER_EYE_WEIGHT
    more = ("eyeLookOutLeft", "eyeLookInRight") if axis == 0 else ("eyeLookUpLeft", "eyeLookUpRight")
    less = ("eyeLookInLeft", "eyeLookOutRight") if axis == 0 else ("eyeLookDownLeft", "eyeLookDownRight")
    for name in more if weight > 0 else less:
        channels[_AT[name]] += abs(weight)


def _fixation(seconds: float, seed: int) -> int:
    """The number of the fixation that has begun last."""
    slot = math.floor(seconds / float(_T["fixation_every_s"]))
    return slot if seconds >= _shift(slot, seed) else slot - 1


def _shift(fixation: int, seed: int) -> float:
    """When the gaze starts to shift to a fixation."""
    late: float = _T["fixation_window"] * _random(seed, _SHIFT, fixation)
    return float(_T["fixation_every_s"] * (fixation + late))


def _target(fixation: int, axis: int, seed: int) -> float:
    """Where a fixation looks, degrees: yaw to the subject's left, pitch up."""
    value = 2.0 * _random(seed, (_YAW, _PITCH)[axis], fixation) - 1.0
    if _random(seed, _WHERE, fixation) < _T["gaze_viewer_chance"]:
        return float(_T["gaze_viewer_deg"][axis] * value)
    if axis == 0:
        value = 0.6 * value + (0.4 if value >= 0 else -0.4)
    return float(_T["gaze_away_deg"][axis] * value)


def _distance(fixation: int, seed: int) -> float:
    """How far the gaze shifts to a fixation, degrees."""
    yaw, pitch = (_target(fixation, axis, seed) - _target(fixation - 1, axis, seed) for axis in (0, 1))
    return math.sqrt(yaw * yaw + pitch * pitch)


def _saccade_s(distance: float) -> float:
    return float(_T["saccade_s"] + _T["saccade_s_per_deg"] * distance)


def _blink(seconds: float, seed: int) -> float:
    """How far the lids are closed."""
    slot = math.floor(seconds / float(_T["blink_every_s"]))
    since = seconds - _blink_start(slot, seed)
    lids = _lids(since)
    if _random(seed, _PAIR, slot) < _T["blink_pair_chance"]:
        lids += _lids(since - _T["blink_pair_s"])
    return lids


def _blink_start(slot: int, seed: int) -> float:
    """When the blink of a slot starts: with the largest gaze shift of its window, else at random."""
    begin = _T["blink_every_s"] * slot
    end = begin + _T["blink_window"] * _T["blink_every_s"]
    start, most = begin + (end - begin) * _random(seed, _BLINK, slot), _T["blink_with_gaze_deg"]
    fixation = _fixation(begin, seed) + 1
    while (shift := _shift(fixation, seed)) < end:
        if (distance := _distance(fixation, seed)) > most:
            start, most = shift, distance
        fixation += 1
    return float(start)


def _lids(since: float) -> float:
    """How far a blink has closed the lids, by the seconds since its start."""
    opening: float = since - _T["blink_close_s"] - _T["blink_closed_s"]
    if opening < 0:
        return _eased(since / _T["blink_close_s"])
    left = 1.0 - min(opening / float(_T["blink_open_s"]), 1.0)
    return left * left * left * (4.0 - 3.0 * left)


def _eased(part: float) -> float:
    """From 0 to 1 with least jerk; held beyond."""
    x = min(max(part, 0.0), 1.0)
    return x * x * x * (10.0 + x * (6.0 * x - 15.0))


def _curve(knots: float, seed: int, stream: int) -> float:
    """A smooth random curve within -1 and 1: the cubic B-spline of random numbers, one a knot."""
    knot = math.floor(knots)
    x = knots - knot
    y = 1.0 - x
    a, b, c, d = (2.0 * _random(seed, stream, knot + i) - 1.0 for i in (-1, 0, 1, 2))
    middle = (4.0 - 6.0 * x * x + 3.0 * x * x * x) * b + (4.0 - 6.0 * y * y + 3.0 * y * y * y) * c
    return (y * y * y * a + middle + x * x * x * d) / 6.0


def _random(seed: int, stream: int, index: int) -> float:
    """A number from 0 to below 1."""
    return _mixed(_mixed(seed + stream * 0x9E3779B9 & _MASK) ^ (index & _MASK)) / 4294967296.0


def _mixed(bits: int) -> int:
    """The finaliser of MurmurHash3 (Appleby, public domain): 32 bits to 32 bits, each of them from all."""
    bits = (bits ^ bits >> 16) * 0x85EBCA6B & _MASK
    bits = (bits ^ bits >> 13) * 0xC2B2AE35 & _MASK
    return bits ^ bits >> 16
