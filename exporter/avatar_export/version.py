"""The name under which the project signs the files that it writes."""

from __future__ import annotations

from avatar_schema.version import __version__

__all__ = ["GENERATOR", "__version__"]

GENERATOR = f"avatar-export {__version__}"
