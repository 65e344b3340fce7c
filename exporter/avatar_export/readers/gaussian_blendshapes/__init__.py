"""The reader of 3D Gaussian Blendshapes."""

from __future__ import annotations

__all__ = ["layout", "reader"]
