"""The stages as shader text: HLSL written by hand; GLSL 4.30, GLSL ES 3.10 and MSL made from it.

`python -m avatar_shaders` makes them again. README.md beside this package is for whoever ports the shaders.
"""

from __future__ import annotations

from avatar_shaders.entries import ENTRIES, HLSL_ONLY, LANGUAGES, Entry, path_of
from avatar_shaders.texts import reflection, source

VERSION = 1  # of the kernels: entries, constants and codes are only ever added

__all__ = ["ENTRIES", "HLSL_ONLY", "LANGUAGES", "VERSION", "Entry", "path_of", "reflection", "source"]
