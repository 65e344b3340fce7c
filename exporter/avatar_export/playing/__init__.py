"""From what a user asks to images: poses from weights, recordings, clips or meshes, then frames on disk."""

from __future__ import annotations

__all__ = ["sequences"]
