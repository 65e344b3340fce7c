"""Rigs from files (.glb, .fbx, ASM) for the mesh of an avatar, and the matching of their vertices."""

from __future__ import annotations

__all__ = ["rig_file"]
