"""Reads trained avatars, writes bundles."""

from __future__ import annotations

__version__ = "0.1.0"
GENERATOR = f"avatar-export {__version__}"
