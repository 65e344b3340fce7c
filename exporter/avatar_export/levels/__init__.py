"""Coarser levels of an avatar, made by dropping unseen Gaussians, merging neighbours and fitting the result."""

from __future__ import annotations

from avatar_export.levels.height import heights_px, served
from avatar_export.levels.level import coarser

__all__ = ["coarser", "heights_px", "served"]
