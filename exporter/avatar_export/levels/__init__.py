"""Coarser levels of an avatar, made by dropping unseen Gaussians, merging neighbours and fitting the result."""

from __future__ import annotations

from avatar_export.levels.height import height_px, level_psnr
from avatar_export.levels.level import coarser

__all__ = ["coarser", "height_px", "level_psnr"]
