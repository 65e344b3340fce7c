"""The made files of players/unity and players/unreal: copies of the HLSL under names that each engine accepts.

A Unity package cannot include files from outside, and Unreal accepts .usf and .ush only. So both get flat copies:
`x.hlsli` becomes x_core.hlsl or x_core.ush, `x.hlsl` keeps its name or becomes x.ush, and a compute entry gets
a few lines that name its kernel. Unity's kernels lie in a folder Resources: builds keep what lies there, also where no
scene refers to it, as with an avatar that is loaded at run time.
"""

from __future__ import annotations

import hashlib
import re
from pathlib import Path

from avatar_shaders.entries import ENTRIES, HLSL_ONLY
from avatar_shaders.generate import HLSL
from avatar_shaders.unreal import UNREAL

_INCLUDE = re.compile(r'#include "(\w+)\.(hlsli?)"')
_GUID = re.compile(r"^guid: ([0-9a-f]{32})$", re.MULTILINE)
_COPY = "// Copy of avatar_shaders/hlsl/{name}, by `python -m avatar_shaders`; do not edit.\n"
_SUFFIXES = {"unity": ("_core.hlsl", ".hlsl"), "unreal": ("_core.ush", ".ush")}  # of .hlsli and of .hlsl
UNITY = "players/unity"
_FOLDERS = {"unity": f"{UNITY}/Shaders", "unreal": f"{UNREAL}/Shaders"}
_KERNELS = f"{UNITY}/Shaders/Resources/AvatarExport"
_UNITY_KERNEL = """\
// Stage `{stage}` for Unity, by `python -m avatar_shaders`; do not edit. Constants are set by name.
#pragma kernel {entry}
#define AVATAR_LOOSE_CONSTANTS 1
#include "../../{file}.hlsl"
"""
_UNREAL = """\
// Stage `{stage}` for Unreal, by `python -m avatar_shaders`; do not edit. Entries: {entries}.
// Parameters are loose and gathered by name.
#include "/Engine/Public/Platform.ush"
#define AVATAR_LOOSE_CONSTANTS 1
#include "{file}.ush"
"""
_META = "fileFormatVersion: 2\nguid: {guid}\n"
_META_OF_FOLDER = _META + "folderAsset: yes\n"
_WITHOUT_META = re.compile(r"^Documentation~(/|$)|^Samples~$|(^|/)\.")  # below the package


def engine_files(hlsl: Path = HLSL) -> dict[str, str]:
    """{path below the checkout: text} of every made shader file for Unity and Unreal."""
    return _copies(hlsl, "unity") | _copies(hlsl, "unreal") | _unity_kernels() | _unreal_shaders()


def unity_metas(root: Path, made: dict[str, str]) -> dict[str, str]:
    """{path below the checkout `root`: text} of a .meta file for every file and folder of the Unity package.

    `made` are files that are to be written. Of files by hand only the names are used. An identifier is a hash of the
    path, and stays what it is once there is one.
    """
    package = root / UNITY
    written = [str(path.relative_to(package)) for path in package.rglob("*")]
    names = {path.removeprefix(f"{UNITY}/") for path in made if path.startswith(f"{UNITY}/")} | set(written)
    folders = {str(folder) for name in names for folder in Path(name).parents if folder.name}
    names |= folders
    assets = sorted(name for name in names if not name.endswith(".meta") and not _WITHOUT_META.search(name))
    forms = {name: _META_OF_FOLDER if name in folders else _META for name in assets}
    return {f"{UNITY}/{name}.meta": form.format(guid=_guid(package, name)) for name, form in forms.items()}


def _copies(hlsl: Path, engine: str) -> dict[str, str]:
    core, plain = _SUFFIXES[engine]
    suffix = {"hlsli": core, "hlsl": plain}

    def renamed(match: re.Match[str]) -> str:
        return f'#include "{match[1]}{suffix[match[2]]}"'

    return {
        f"{_FOLDERS[engine]}/{path.stem}{suffix[path.suffix[1:]]}": _COPY.format(name=path.name)
        + _INCLUDE.sub(renamed, path.read_text("utf-8"))
        for path in sorted(hlsl.glob("*.hlsl*"))
    }


def _unity_kernels() -> dict[str, str]:
    compute = {name: row for name, row in ENTRIES.items() if row.kind == "compute"}
    return {
        f"{_KERNELS}/{name}.compute": _UNITY_KERNEL.format(
            stage=row.stage, entry=name, file=Path(row.hlsl).stem
        )
        for name, row in compute.items()
    }


def _unreal_shaders() -> dict[str, str]:
    texts, all_entries = {}, ENTRIES | HLSL_ONLY
    for file in dict.fromkeys(row.hlsl for row in all_entries.values()):
        rows = {name: row for name, row in all_entries.items() if row.hlsl == file}
        stem, stage = Path(file).stem, next(iter(rows.values())).stage
        texts[f"{_FOLDERS['unreal']}/{stem}.usf"] = _UNREAL.format(
            stage=stage, entries=", ".join(rows), file=stem
        )
    return texts


def _guid(package: Path, name: str) -> str:
    meta = package / f"{name}.meta"
    kept = _GUID.search(meta.read_text("utf-8")) if meta.is_file() else None
    return kept[1] if kept else hashlib.md5(f"avatar-export/unity/{name}".encode()).hexdigest()
