"""The made files of the engine folders beside this package: copies of the HLSL under names that each engine accepts.

A Unity package cannot include files from outside, and Unreal accepts .usf and .ush only. So both get flat copies:
`x.hlsli` becomes x_core.hlsl or x_core.ush, `x.hlsl` keeps its name or becomes x.ush, and a compute entry gets
a few lines that name its kernel.
"""

from __future__ import annotations

import hashlib
import re
from pathlib import Path

from avatar_shaders.entries import ENTRIES, HLSL_ONLY
from avatar_shaders.generate import HLSL

_INCLUDE = re.compile(r'#include "(\w+)\.(hlsli?)"')
_COPY = "// Copy of avatar_shaders/hlsl/{name}, by `python -m avatar_shaders`; do not edit.\n"
_SUFFIXES = {"unity": ("_core.hlsl", ".hlsl"), "unreal": ("_core.ush", ".ush")}  # of .hlsli and of .hlsl
_UNITY_KERNEL = """\
// Stage `{stage}` for Unity, by `python -m avatar_shaders`; do not edit. Constants are set by name.
#pragma kernel {entry}
#include "{file}.hlsl"
"""
_UNREAL = """\
// Stage `{stage}` for Unreal, by `python -m avatar_shaders`; do not edit. Entries: {entries}.
// Parameters are loose and gathered by name.
#include "/Engine/Public/Platform.ush"
#define AVATAR_LOOSE_CONSTANTS 1
#include "{file}.ush"
"""
_META = "fileFormatVersion: 2\nguid: {guid}\n"


def engine_files(engines: Path, hlsl: Path = HLSL) -> dict[str, str]:
    """{path below `engines`: text} of every made file of engines/unity and engines/unreal.

    Of the hand-written files in unity/ only the names are used: every asset of a Unity package needs a .meta file
    with an identifier that never changes.
    """
    files = _copies(hlsl, "unity") | _copies(hlsl, "unreal") | _unity_kernels() | _unreal_shaders()
    return files | _metas(engines, files)


def _copies(hlsl: Path, engine: str) -> dict[str, str]:
    core, plain = _SUFFIXES[engine]
    suffix = {"hlsli": core, "hlsl": plain}

    def renamed(match: re.Match[str]) -> str:
        return f'#include "{match[1]}{suffix[match[2]]}"'

    return {
        f"{engine}/Shaders/{path.stem}{suffix[path.suffix[1:]]}": _COPY.format(name=path.name)
        + _INCLUDE.sub(renamed, path.read_text("utf-8"))
        for path in sorted(hlsl.glob("*.hlsl*"))
    }


def _unity_kernels() -> dict[str, str]:
    compute = {name: row for name, row in ENTRIES.items() if row.kind == "compute"}
    return {
        f"unity/Shaders/{name}.compute": _UNITY_KERNEL.format(
            stage=row.stage, entry=name, file=Path(row.hlsl).stem
        )
        for name, row in compute.items()
    }


def _unreal_shaders() -> dict[str, str]:
    texts, all_entries = {}, ENTRIES | HLSL_ONLY
    for file in dict.fromkeys(row.hlsl for row in all_entries.values()):
        rows = {name: row for name, row in all_entries.items() if row.hlsl == file}
        stem, stage = Path(file).stem, next(iter(rows.values())).stage
        texts[f"unreal/Shaders/{stem}.usf"] = _UNREAL.format(stage=stage, entries=", ".join(rows), file=stem)
    return texts


def _metas(engines: Path, made: dict[str, str]) -> dict[str, str]:
    """A .meta file for every file and folder of the Unity package; its identifier is a hash of the path."""
    written = [str(path.relative_to(engines)) for path in sorted((engines / "unity").rglob("*"))]
    assets = {path for path in [*made, *written] if path.startswith("unity/") and not path.endswith(".meta")}
    assets.add("unity/Shaders")
    return {
        f"{path}.meta": _META.format(guid=hashlib.md5(f"avatar-export/{path}".encode()).hexdigest())
        for path in sorted(assets)
    }
