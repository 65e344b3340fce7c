"""Applies an avatar's enhancer to a drawn image: optional, on the CPU, with ONNX Runtime (extra `enhance`)."""

from __future__ import annotations

import importlib
import importlib.util
from collections.abc import Callable
from typing import TYPE_CHECKING

from avatar_runtime.io.errors import AvatarError
from avatar_schema.extras import how_to_install

if TYPE_CHECKING:
    from avatar_runtime.avatar import F32, Enhancer

LIBRARIES = ("onnxruntime", "onnx")  # onnx checks the file before onnxruntime runs it
Enhance = Callable[["F32"], "F32"]  # colour [H, W, 3] -> colour [H, W, 3], not clamped


def missing_libraries() -> str | None:
    """The missing libraries and the command that installs them; None if none is missing."""
    missing = [library for library in LIBRARIES if importlib.util.find_spec(library) is None]
    return f"{' and '.join(missing)}: {how_to_install('enhance')}" if missing else None


def make_enhance(enhancer: Enhancer | None) -> Enhance:
    """A function that applies `enhancer` to colour [H, W, 3]; the same image gives the same bits.

    Raises AvatarError if `enhancer` is None, its libraries are not installed, or its file is not valid.
    """
    if enhancer is None:
        raise AvatarError("this avatar has none; draw it as it is", field="enhancer")
    missing = missing_libraries()
    if missing:
        raise AvatarError(f"needs {missing}", field="enhancer")
    run: Enhance = importlib.import_module("avatar_runtime.enhance.session").Session(enhancer)
    return run
