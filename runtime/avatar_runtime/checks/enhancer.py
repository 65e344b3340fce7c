"""Checks an enhancer without opening its network; part of `check_avatar`."""

from __future__ import annotations

import math

from avatar_runtime.avatar import Enhancer
from avatar_runtime.io.errors import AvatarError

LARGEST = 8 << 20  # bytes; ours have half a megabyte; a hostile file grows much larger when it is parsed
WIDEST = 1 << 14  # pixels


def check_enhancer(enhancer: Enhancer) -> Enhancer:
    """`enhancer` itself. Raises AvatarError for an empty or too large file, an empty name, a wrong size or figure."""
    if not isinstance(enhancer.onnx, bytes) or not 0 < len(enhancer.onnx) <= LARGEST:
        found = f"{len(enhancer.onnx)} bytes" if isinstance(enhancer.onnx, bytes) else "no bytes"
        raise AvatarError(f"is {found}, expected 1 to {LARGEST}", field="enhancer.onnx")
    for name, text in (("input", enhancer.input), ("output", enhancer.output)):
        if not text:
            raise AvatarError("is empty", field=f"enhancer.{name}")
    for name, size in (
        ("trained_width", enhancer.trained_width),
        ("trained_height", enhancer.trained_height),
    ):
        if not 1 <= size <= WIDEST:
            raise AvatarError(f"is {size}, expected 1 to {WIDEST}", field=f"enhancer.{name}")
    for name, decibels in (
        ("psnr_raw_db", enhancer.psnr_raw_db),
        ("psnr_enhanced_db", enhancer.psnr_enhanced_db),
    ):
        if decibels is not None and not math.isfinite(decibels):
            raise AvatarError(f"is {decibels}, expected decibels or none", field=f"enhancer.{name}")
    return enhancer
