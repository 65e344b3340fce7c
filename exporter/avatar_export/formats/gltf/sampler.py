"""Evaluates glTF animation samplers: STEP, LINEAR and CUBICSPLINE, as glTF 2.0 appendix C defines them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from avatar_runtime.avatar import F64


@dataclass(frozen=True)
class Sampler:
    """Key times [T] in seconds, strictly increasing, and `values` [T, W], or [T, 3, W] for CUBICSPLINE."""

    times: F64
    values: F64
    interpolation: str
    is_rotation: bool  # quaternions xyzw: LINEAR is a slerp, CUBICSPLINE is normalised


def evaluate(sampler: Sampler, at: F64) -> F64:
    """Values [F, W] at times `at` [F]; before the first and after the last key, that key's value."""
    times = sampler.times
    after = np.clip(np.searchsorted(times, at, side="right"), 1, max(len(times) - 1, 1))
    if len(times) == 1:
        low = high = np.zeros(len(at), int)
        u, step = np.zeros(len(at)), np.zeros(len(at))
    else:
        low, high = after - 1, after
        step = times[high] - times[low]
        u = np.clip((at - times[low]) / step, 0, 1)
    return INTERPOLATIONS[sampler.interpolation](sampler, low, high, u, step)


def _step(s: Sampler, low: F64, high: F64, u: F64, step: F64) -> F64:
    result: F64 = s.values[np.where(u >= 1, high, low)]
    return result


def _linear(s: Sampler, low: F64, high: F64, u: F64, step: F64) -> F64:
    a, b = s.values[low], s.values[high]
    if s.is_rotation:
        return slerp(a, b, u)
    result: F64 = a + u[:, None] * (b - a)
    return result


def _cubic(s: Sampler, low: F64, high: F64, u: F64, step: F64) -> F64:
    t, d = u[:, None], step[:, None]
    start, leaving = s.values[low, 1], s.values[low, 2]
    arriving, end = s.values[high, 0], s.values[high, 1]
    result: F64 = (
        (2 * t**3 - 3 * t**2 + 1) * start
        + d * (t**3 - 2 * t**2 + t) * leaving
        + (-2 * t**3 + 3 * t**2) * end
        + d * (t**3 - t**2) * arriving
    )
    return unit(result) if s.is_rotation else result


INTERPOLATIONS: dict[str, Callable[[Sampler, F64, F64, F64, F64], F64]] = {
    "STEP": _step,
    "LINEAR": _linear,
    "CUBICSPLINE": _cubic,
}


def slerp(a: F64, b: F64, u: F64) -> F64:
    """Unit quaternions [F, 4] along the shorter arc from `a` [F, 4] to `b`, at `u` [F] from 0 to 1."""
    cosine = np.sum(a * b, axis=-1, keepdims=True)
    b = np.where(cosine < 0, -b, b)
    angle = np.arccos(np.clip(np.abs(cosine), 0, 1))
    sine, t = np.sin(angle), u[:, None]
    close = sine < 1e-6  # linear interpolation is exact to 1e-13 there
    safe = np.where(close, 1, sine)
    weight_a = np.where(close, 1 - t, np.sin((1 - t) * angle) / safe)
    weight_b = np.where(close, t, np.sin(t * angle) / safe)
    return unit(weight_a * a + weight_b * b)


def unit(q: F64) -> F64:
    """Quaternions [F, 4] of length one; a zero one becomes the identity (xyzw)."""
    length = np.linalg.norm(q, axis=-1, keepdims=True)
    result: F64 = np.where(length > 0, q / np.where(length > 0, length, 1), np.array([0.0, 0, 0, 1]))
    return result
