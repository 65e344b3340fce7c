"""Reads trained avatars and writes bundles.

The names in `__all__` are the public interface. Nothing heavy is loaded before one of them is used. What a sub-package
lists in its own `__all__` is for packages that build on this one, as the trainer does, and may change from one version
to the next; so may `cli`, `images` and `provenance`.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from avatar_export.version import GENERATOR, __version__

if TYPE_CHECKING:
    from avatar_export.checks.bundle import validate
    from avatar_export.conversion import convert
    from avatar_export.convert_options import ConvertOptions
    from avatar_export.options import ReadOptions
    from avatar_export.readers.table import READERS, read
    from avatar_runtime.io.errors import AvatarError

# fmt: off
__all__ = [
    "GENERATOR", "READERS", "AvatarError", "ConvertOptions", "ReadOptions", "__version__", "cli", "convert", "images",
    "provenance", "read", "validate",
]
# fmt: on
_HOMES = {
    "AvatarError": "avatar_runtime.io.errors",
    "ConvertOptions": "avatar_export.convert_options",
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
