"""The made shaders of the Unity package: the HLSL under Unity's names, and a file for each compute kernel.

A Unity package cannot include files from outside, so it gets copies when it is put together. Kernels lie in a folder
Resources: builds keep what lies there, also where no scene refers to it, as with an avatar that is loaded at run time.
"""

from __future__ import annotations

from pathlib import Path

from avatar_shaders.copies import copies
from avatar_shaders.entries import ENTRIES
from avatar_shaders.generate import HLSL

FOLDER = "Made"  # below the package; nothing in it is written by hand
KERNELS = f"{FOLDER}/Resources/AvatarExport"
_HEAD = "// Copy of engine_shaders/avatar_shaders/hlsl/{name}: change it there.\n"
_KERNEL = """\
// Stage `{stage}` for Unity, made of engine_shaders/avatar_shaders/entries.py. Constants are set by name.
#pragma kernel {entry}
#define AVATAR_LOOSE_CONSTANTS 1
#include "../../{file}.hlsl"
"""


def unity_shaders(hlsl: Path = HLSL) -> dict[str, str]:
    """{path below the package: text}: `x.hlsli` is x_core.hlsl, `x.hlsl` keeps its name, an entry is entry.compute."""
    texts = copies(hlsl, "_core.hlsl", ".hlsl", _HEAD)
    return {f"{FOLDER}/{name}": text for name, text in texts.items()} | {
        f"{KERNELS}/{entry}.compute": _KERNEL.format(stage=row.stage, entry=entry, file=Path(row.hlsl).stem)
        for entry, row in ENTRIES.items()
        if row.kind == "compute"
    }
