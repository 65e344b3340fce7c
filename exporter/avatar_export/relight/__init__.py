"""What the light of a scene needs to know of an avatar: which way each Gaussian faces, and the light of its capture."""

from __future__ import annotations

from avatar_export.relight.make import captured, light_json, relightable

__all__ = ["captured", "light_json", "relightable"]
