"""Reads trained avatars and writes bundles.

The public face: `read`, `convert`, `validate`, `ReadOptions`, `READERS`, `AvatarError`. Nothing heavy is loaded before
one of these names is used.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from avatar_export.version import GENERATOR, __version__

if TYPE_CHECKING:
    from avatar_export.checks.bundle import validate
    from avatar_export.conversion import convert
    from avatar_export.options import ReadOptions
    from avatar_export.readers.table import READERS, read
    from avatar_runtime.io.errors import AvatarError

__all__ = ["GENERATOR", "READERS", "AvatarError", "ReadOptions", "__version__", "convert", "read", "validate"]
_HOMES = {
    "AvatarError": "avatar_runtime.io.errors",
    "READERS": "avatar_export.readers.table",
    "ReadOptions": "avatar_export.options",
    "convert": "avatar_export.conversion",
    "read": "avatar_export.readers.table",
    "validate": "avatar_export.checks.bundle",
}


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(_HOMES[name]), name)
