"""The UPM package for Unity: hand-written files, the HLSL as Unity takes it, and a .meta file for each with its GUID.

Scenes and prefabs of users point at a GUID, so one that was given never changes. guids.csv, beside the hand-written
files, holds all of them: a row is `path,guid`, and a renamed file keeps its row under the new path.
"""

from __future__ import annotations

import csv
import json
import re
from collections.abc import Iterable, Mapping
from pathlib import Path

from avatar_export.players.sources import folder, license_text
from avatar_runtime.io.errors import AvatarError
from avatar_schema.version import __version__
from avatar_shaders.unity import unity_shaders

TABLE = "guids.csv"
MANIFEST = "package.json"
_NO_ASSET = re.compile(r"(^|/)\.|\.meta$|~$")  # what the package does not take from the hand-written files
# Unity imports none of it; a sample is copied into Assets.
_NO_META = re.compile(r"^Documentation~(/|$)|^Samples~$")
_META = "fileFormatVersion: 2\nguid: {guid}\n"
_META_OF_FOLDER = _META + "folderAsset: yes\n"


def unity_files() -> dict[str, bytes]:
    """{path below the package: content}. Raises AvatarError where a file has no GUID."""
    root = folder("unity")
    files = {name: (root / name).read_bytes() for name in hand_written(root)} | unity_made(root)
    return files | metas(files, guids(root))


def hand_written(root: Path) -> list[str]:
    """Paths of the hand-written files below `root`; without Unity's own .meta files, hidden files and the table."""
    names = (path.relative_to(root).as_posix() for path in sorted(root.rglob("*")) if path.is_file())
    return [name for name in names if name != TABLE and not _NO_ASSET.search(name)]


def unity_made(root: Path) -> dict[str, bytes]:
    """{path: content} of what is made, without .meta files: the manifest with the version, licence and shaders."""
    manifest = json.loads((root / MANIFEST).read_text("utf-8"))
    name = {"name": manifest.pop("name"), "version": __version__}
    text = json.dumps(name | manifest, indent=2, ensure_ascii=False) + "\n"
    shaders = {path: shader.encode() for path, shader in unity_shaders().items()}
    return {MANIFEST: text.encode(), "LICENSE.md": license_text()} | shaders


def assets(names: Iterable[str]) -> dict[str, bool]:
    """Path of each file and folder of the package that has a .meta file: whether it is a folder."""
    files = dict.fromkeys(names, False)
    folders = {str(above): True for name in files for above in Path(name).parents if above.name}
    return {name: kind for name, kind in sorted((files | folders).items()) if not _NO_META.search(name)}


def metas(names: Iterable[str], known: Mapping[str, str]) -> dict[str, bytes]:
    """{path: content} of the .meta files of a package with files `names`. Raises AvatarError for one without a row."""
    found = assets(names)
    missing = sorted(found.keys() - known.keys())
    if missing:
        raise AvatarError(f"{missing[0]} has no GUID: run `make unity`, which adds its row", file=TABLE)
    forms = {name: _META_OF_FOLDER if is_folder else _META for name, is_folder in found.items()}
    return {f"{name}.meta": form.format(guid=known[name]).encode() for name, form in forms.items()}


def guids(root: Path) -> dict[str, str]:
    """The table: {path: GUID}."""
    with (root / TABLE).open(encoding="utf-8", newline="") as file:
        return {row["path"]: row["guid"] for row in csv.DictReader(file)}
