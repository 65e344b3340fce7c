"""The stages: pure functions in a file each, with the names that shaders, profiles and cases use."""

from __future__ import annotations

LIT = ("shadow", "light")  # only where a scene has a light
# fmt: off
STAGES = (
    "joints", "morph", "skin", "blend", "bind", "activate", "shadow", "project", "light", "sort", "raster",
)
UNLIT = tuple(stage for stage in STAGES if stage not in LIT)

__all__ = [
    "LIT", "STAGES", "UNLIT", "activate", "bind", "blend", "groups", "joints", "light", "morph", "project", "raster",
    "skin", "sort", "sparse",
]
# fmt: on
