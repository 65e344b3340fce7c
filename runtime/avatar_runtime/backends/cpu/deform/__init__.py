"""Deforming on the CPU: stages morph, skin, blend, bind and activate."""

from __future__ import annotations

from avatar_runtime.backends.cpu.deform import surface
from avatar_runtime.backends.cpu.deform.bind import POLAR_STEPS
from avatar_runtime.backends.cpu.deform.inputs import fresh_posed_mesh

__all__ = ["POLAR_STEPS", "fresh_posed_mesh", "surface"]
