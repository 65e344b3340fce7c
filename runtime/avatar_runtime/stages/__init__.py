"""The nine stages: one pure function in each file, with the name that shaders, profiles and cases use."""

from __future__ import annotations

STAGES = ("joints", "morph", "skin", "blend", "bind", "activate", "project", "sort", "raster")

# fmt: off
__all__ = [
    "STAGES", "activate", "bind", "blend", "groups", "joints", "morph", "project", "raster", "skin", "sort",
    "sparse",
]
# fmt: on
