"""The npm package of the web player: what was built, a sample, the manifest with the version, the licences.

Building needs Node and what `npm ci` brings, so nothing is built here: a wheel holds what was built.
"""

from __future__ import annotations

import json
from pathlib import Path

from avatar_export.players.sources import folder, license_text
from avatar_runtime.io.errors import AvatarError
from avatar_schema.version import __version__

MANIFEST = "package.json"
BUILT = "dist"
WRITTEN = ("README.md", "NOTICE.md")  # by hand
SOURCES = ("src", "build.mjs", "bundle.mjs", "package-lock.json", "tsconfig.json")  # of what is built
SAMPLE = f"{BUILT}/sample.avatar"  # by tools.web_sample, after the scripts
BUILD = "with Node, run `make dist`"


def web_files() -> dict[str, bytes]:
    """{path below the package: content}: what `npm pack` holds there. Raises AvatarError where nothing is built."""
    root = folder("web")
    built = [path for path in (root / BUILT).rglob("*") if path.is_file()]
    if root / SAMPLE not in built:
        then = " in the checkout" if (root / SOURCES[0]).exists() else " in a checkout, and install that"
        raise AvatarError(f"the web player is not built: {BUILD}{then}", file=BUILT)
    sources = [
        path for name in SOURCES for path in (root / name, *(root / name).rglob("*")) if path.is_file()
    ]
    if max(map(_time, sources), default=0) > _time(root / SAMPLE):
        raise AvatarError(f"the web player was built before its sources changed: {BUILD}", file=BUILT)
    files = [*built, *(root / name for name in WRITTEN)]
    held = {path.relative_to(root).as_posix(): path.read_bytes() for path in files}
    manifest = json.loads((root / MANIFEST).read_text("utf-8"))
    name = {"name": manifest.pop("name"), "version": __version__}
    text = json.dumps(name | manifest, indent=2, ensure_ascii=False) + "\n"
    return held | {MANIFEST: text.encode(), "LICENSE": license_text()}


def _time(path: Path) -> int:
    return path.stat().st_mtime_ns
