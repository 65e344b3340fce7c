"""The source archive of the native player, which CMake builds without this repository and without Python."""

from __future__ import annotations

import re
from importlib.resources import files
from pathlib import Path

import avatar_shaders
from avatar_export.players.sources import folder, license_text
from avatar_schema.version import __version__
from avatar_shaders.entries import ENTRIES, path_of
from avatar_shaders.texts import source

LANGUAGES = ("glsl310es", "msl")  # cmake/shader_texts.cmake makes GLSL 4.30 of the first
HLSL = "hlsl"  # a folder of texts that include each other
_KEPT = (
    "CMakeLists.txt",
    "README.md",
    "android",
    "cmake",
    "d3d11",
    "gles",
    "include",
    "ios",
    "play",
    "scene",
    "src",
)
# What a build leaves there.
_LOCAL = re.compile(r"(^|/)(\.[^/]*|build|head\.avatar|local\.properties)(/|$)")


def native_files() -> dict[str, bytes]:
    """{path below the player's folder: content}. Tests, fuzzers and measurements stay in the repository."""
    texts = {
        f"shaders/{path_of(entry, lang)}": source(entry, lang) for entry in ENTRIES for lang in LANGUAGES
    }
    held = files(avatar_shaders) / HLSL
    texts |= {f"shaders/{HLSL}/{file.name}": file.read_text("utf-8") for file in held.iterdir()}
    made = {"VERSION": f"{__version__}\n"} | texts
    return (
        native_sources(*_KEPT)
        | {path: text.encode() for path, text in made.items()}
        | {"LICENSE": license_text()}
    )


def native_sources(*names: str) -> dict[str, bytes]:
    """{path below the player's folder: content} of these files and folders: what is by hand, and the tables."""
    return written(folder("native"), *names)


def written(root: Path, *names: str) -> dict[str, bytes]:
    """{path below `root`: content} of these files and folders, without what a build or an editor leaves there."""
    found = [path for name in names for path in (root / name, *(root / name).rglob("*")) if path.is_file()]
    paths = {path.relative_to(root).as_posix(): path for path in found}
    return {name: path.read_bytes() for name, path in paths.items() if not _LOCAL.search(name)}
