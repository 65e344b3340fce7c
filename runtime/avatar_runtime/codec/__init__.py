"""Parts of a bundle: bytes to arrays and back, one file a format."""

from __future__ import annotations

__all__ = ["glb", "ply", "safetensors"]
