"""How a display-referred image lies over what an engine drew in linear light, and what RGB10A2 keeps of that."""

from __future__ import annotations

from typing import Any

import numpy as np

from avatar_runtime.avatar import F64

STEP_RGB10A2 = 2 / 1023  # 10 bits for 0..2: Godot's Mobile renderer stores half of the light


def linear(display: Any) -> F64:
    """sRGB's curve, to light."""
    value = np.asarray(display, np.float64)
    return np.where(value <= 0.04045, value / 12.92, ((np.maximum(value, 0) + 0.055) / 1.055) ** 2.4)


def display(light: Any) -> F64:
    """Light to sRGB."""
    value = np.asarray(light, np.float64)
    return np.where(value <= 0.0031308, 12.92 * value, 1.055 * np.maximum(value, 0) ** (1 / 2.4) - 0.055)


def over(image: Any, background: Any) -> F64:
    """[H, W, 3] light of a premultiplied, display-referred image [H, W, 4] over display-referred colours."""
    image = np.asarray(image, np.float64)
    alpha = image[..., 3:]
    straight = np.divide(image[..., :3], alpha, out=np.zeros_like(image[..., :3]), where=alpha > 0)
    found: F64 = linear(straight) * alpha + (1 - alpha) * linear(background)
    return found


def bounds_rgb10a2(wanted: Any, alpha: Any) -> tuple[F64, F64]:
    """The least and the largest display-referred colour that may be kept of light over a background.

    The background is rounded to the nearest step. What lies over it may be cut off to a step: some drivers do.
    """
    off = STEP_RGB10A2 * (1 + (1 - np.asarray(alpha, np.float64)) / 2)
    return display(np.maximum(wanted - off, 0)), display(wanted + off)


def beyond_rgb10a2(shown: Any, wanted: Any, alpha: Any) -> F64:
    """How far colours of bytes are outside of these bounds."""
    low, high = (np.clip(one, 0, 1) for one in bounds_rgb10a2(wanted, alpha))
    found: F64 = np.maximum(np.maximum(shown - high, low - shown), 0)
    return found


def off(found: Any, wanted: Any) -> F64:
    """How far colours are from others, as a screen shows them."""
    apart: F64 = np.abs(np.clip(found, 0, 1) - np.clip(wanted, 0, 1))
    return apart
