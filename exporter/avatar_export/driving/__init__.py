"""From recordings of a face (ARKit names, Live Link Face) to poses of an avatar."""

from __future__ import annotations

__all__ = ["matrix"]
