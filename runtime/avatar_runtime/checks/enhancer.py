"""Whether an enhancer is sound as far as its file need not be opened; part of `check_avatar`."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from avatar_runtime.io.errors import AvatarError

if TYPE_CHECKING:
    from avatar_runtime.avatar import Enhancer

LARGEST = 8 << 20  # bytes; ours have half a megabyte, and what a parser makes of hostile ones is far larger
WIDEST = 1 << 14  # pixels


def check_enhancer(enhancer: Enhancer) -> None:
    """Raise AvatarError for a file that is empty or too large, sizes and figures that make no sense."""
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
