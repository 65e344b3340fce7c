"""Checks of the one model; each raises AvatarError that names the field."""

from __future__ import annotations

__all__ = ["enhancer"]
