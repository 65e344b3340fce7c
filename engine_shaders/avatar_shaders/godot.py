"""The shaders of the Godot add-on: SPIR-V, which the engine's RenderingDevice takes as it is.

It is what glslang makes for the texts in other languages, too: not optimised, without fma() of sums of products, so
that every operation rounds as there. Modules of another compiler would be a second rounding to check.
"""

from __future__ import annotations

import struct
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from avatar_shaders.entries import ENTRIES
from avatar_shaders.generate import HLSL
from avatar_shaders.tools import spirv

GODOT_ENTRIES = (
    *(name for name, row in ENTRIES.items() if row.kind == "compute"),
    *("raster_vertex_fetch", "raster_pixel", "composite_vertex", "composite_pixel"),
    *("depth_pixel", "depth_samples_pixel"),
)
_WORDS = 10  # a line


def spirv_main(folder: Path, entry: str) -> bytes:
    """The validated SPIR-V of an entry, which is called `main` there: Godot calls no other. Raises ShaderError."""
    return spirv(folder, entry, options=("--source-entrypoint", entry, "-e", "main"))


def godot_shaders(hlsl: Path = HLSL) -> str:
    """avatar_spirv.inc: an array of words for each entry, and `spirv_texts`, the table of them.

    Who includes it has `struct SpirvText { const char* entry; const uint32_t* words; size_t count; };`.
    Raises ShaderError.
    """
    with ThreadPoolExecutor() as pool:
        modules = list(pool.map(lambda entry: spirv_main(hlsl, entry), GODOT_ENTRIES))
    arrays = "".join(map(_array, GODOT_ENTRIES, modules))
    rows = "".join(
        f'    {{"{entry}", spirv_{entry}, {len(module) // 4}}},\n'
        for entry, module in zip(GODOT_ENTRIES, modules, strict=True)
    )
    return f"{arrays}constexpr SpirvText spirv_texts[] = {{\n{rows}}};\n"


def _array(entry: str, module: bytes) -> str:
    words = [f"{word:#x}" for (word,) in struct.iter_unpack("<I", module)]
    lines = [", ".join(words[at : at + _WORDS]) for at in range(0, len(words), _WORDS)]
    return f"constexpr uint32_t spirv_{entry}[] = {{\n" + "".join(f"    {line},\n" for line in lines) + "};\n"
