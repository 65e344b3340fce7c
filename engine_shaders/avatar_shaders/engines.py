"""The made shaders of players/unreal: copies of the HLSL under names that Unreal accepts, which are .usf and .ush only.

`x.hlsli` becomes x_core.ush, `x.hlsl` becomes x.ush, and an entry gets a file with a few lines that include it.
"""

from __future__ import annotations

from pathlib import Path

from avatar_shaders.copies import copies
from avatar_shaders.entries import ENTRIES, HLSL_ONLY
from avatar_shaders.generate import HLSL
from avatar_shaders.unreal import UNREAL

_COPY = "// Copy of avatar_shaders/hlsl/{name}, by `python -m avatar_shaders`; do not edit.\n"
_FOLDER = f"{UNREAL}/Shaders"
_UNREAL = """\
// Stage `{stage}` for Unreal, by `python -m avatar_shaders`; do not edit. Entries: {entries}.
// Parameters are loose and gathered by name.
#include "/Engine/Public/Platform.ush"
#define AVATAR_LOOSE_CONSTANTS 1
#include "{file}.ush"
"""


def engine_files(hlsl: Path = HLSL) -> dict[str, str]:
    """{path below the checkout: text} of every made shader file for Unreal."""
    texts = copies(hlsl, "_core.ush", ".ush", _COPY)
    return {f"{_FOLDER}/{name}": text for name, text in texts.items()} | _unreal_shaders()


def _unreal_shaders() -> dict[str, str]:
    texts, all_entries = {}, ENTRIES | HLSL_ONLY
    for file in dict.fromkeys(row.hlsl for row in all_entries.values()):
        rows = {name: row for name, row in all_entries.items() if row.hlsl == file}
        stem, stage = Path(file).stem, next(iter(rows.values())).stage
        texts[f"{_FOLDER}/{stem}.usf"] = _UNREAL.format(stage=stage, entries=", ".join(rows), file=stem)
    return texts
