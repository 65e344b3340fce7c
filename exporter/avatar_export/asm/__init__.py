"""ASM (arXiv 2304.09423), a bone-driven face: its model, its maths and its files."""

from __future__ import annotations

from avatar_export.asm.check import NEUTRAL, check_names
from avatar_export.asm.files import load, save
from avatar_export.asm.model import AsmFace, Binding, Take, Template

__all__ = ["NEUTRAL", "AsmFace", "Binding", "Take", "Template", "check_names", "load", "save"]
