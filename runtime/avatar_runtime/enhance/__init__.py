"""Puts a drawn picture through an avatar's enhancer: optional, on the CPU, by ONNX Runtime (extra `enhance`)."""

from __future__ import annotations

import importlib
import importlib.util
from collections.abc import Callable
from typing import TYPE_CHECKING

from avatar_runtime.io.errors import AvatarError

if TYPE_CHECKING:
    from avatar_runtime.avatar import F32, Enhancer

LIBRARIES = ("onnxruntime", "onnx")  # the second reads what the first is to be trusted with
Enhance = Callable[["F32"], "F32"]  # colour [H, W, 3] -> colour [H, W, 3], not clamped


def missing_libraries() -> str | None:
    """What must be installed to enhance, and how; None where it is there."""
    missing = [library for library in LIBRARIES if importlib.util.find_spec(library) is None]
    return f"{' and '.join(missing)}: pip install 'avatar-export[enhance]'" if missing else None


def make_enhance(enhancer: Enhancer | None) -> Enhance:
    """What makes pictures better by `enhancer`: same picture, same bits.

    Raises AvatarError where there is none, where its libraries are not installed, and for a file that is not sound.
    """
    if enhancer is None:
        raise AvatarError("this avatar has none; draw it as it is", field="enhancer")
    missing = missing_libraries()
    if missing:
        raise AvatarError(f"needs {missing}", field="enhancer")
    run: Enhance = importlib.import_module("avatar_runtime.enhance.session").Session(enhancer)
    return run
