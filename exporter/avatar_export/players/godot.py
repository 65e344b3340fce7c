"""The add-on for Godot: hand-written files, the version, the licence, and the libraries that were built.

Building needs Zig and the tools of the shaders, so nothing is built here: a wheel holds what was built.
"""

from __future__ import annotations

import re
from pathlib import Path

from avatar_export.players.native import written
from avatar_export.players.sources import folder, license_text
from avatar_runtime.io.errors import AvatarError
from avatar_schema.version import __version__

MANIFEST = "plugin.cfg"
BUILT = "bin"
_HLSL = "../engine_shaders/avatar_shaders/hlsl"
SOURCES = ("native/include", "native/scene", "native/src", "godot/extension", _HLSL)  # of what is built
BUILD = "run `python -m tools.godot.build all`"
_OF_GODOT = re.compile(r"\.(uid|import)$")  # that it writes beside files
_VERSION = re.compile(r'^version=".*"$', re.MULTILINE)


def godot_files() -> dict[str, bytes]:
    """{path below the add-on: content}. Raises AvatarError where no library is built."""
    root = folder("godot")
    built = sorted((root / BUILT).glob("libgaussian_avatar.*"))
    if not built:
        then = "" if (root / "extension").exists() else " in a checkout, and install that"
        raise AvatarError(f"the add-on for Godot is not built: {BUILD}{then}", file=BUILT)
    sources = [path for name in SOURCES for path in (root.parent / name).rglob("*.*")]
    if (root / "extension").exists() and max(map(_time, sources)) > min(map(_time, built)):
        raise AvatarError(f"the add-on for Godot was built before its sources changed: {BUILD}", file=BUILT)
    own = written(root, *(path.name for path in root.iterdir() if path.name != "extension"))
    files = {path: data for path, data in own.items() if not _OF_GODOT.search(path)}
    said = _VERSION.sub(f'version="{__version__}"', files[MANIFEST].decode())
    return files | {MANIFEST: said.encode(), "LICENSE": license_text()}


def _time(path: Path) -> int:
    return path.stat().st_mtime_ns
