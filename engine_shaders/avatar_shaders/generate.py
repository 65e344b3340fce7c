"""Generated text: from a folder of HLSL to GLSL, MSL and the reflection table."""

from __future__ import annotations

import json
import re
from collections.abc import Iterable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

from avatar_shaders import ENTRIES, LANGUAGES, path_of
from avatar_shaders.reflect import interface
from avatar_shaders.tools import cross, spirv, versions

PACKAGE = Path(__file__).parent
_COMBINED = re.compile(r"SPIRV_Cross_Combined(\w+?)SPIRV_Cross_DummySampler")


def generate(
    hlsl: Path, entries: Iterable[str] = tuple(ENTRIES), languages: Iterable[str] = LANGUAGES
) -> dict[tuple[str, str], str]:
    """{(language, entry): text} of the HLSL in a folder, which may be an altered copy of this package's.

    Raises tools.ShaderError where something does not compile or a tool is missing.
    """
    chosen = tuple(languages)
    with ThreadPoolExecutor() as pool:
        texts = pool.map(lambda entry: _texts(hlsl, entry, chosen), entries)
        return {key: text for found in texts for key, text in found.items()}


def generate_all(hlsl: Path = PACKAGE / "hlsl") -> dict[str, str]:
    """{path below the package: text} of all that is generated from a folder of HLSL. Raises tools.ShaderError."""
    texts = generate(hlsl, ENTRIES, (*LANGUAGES, "reflect"))
    table = {"tools": versions(), "entries": {entry: _interface(texts, entry) for entry in ENTRIES}}
    files = {path_of(entry, language): texts[language, entry] for entry in ENTRIES for language in LANGUAGES}
    return files | {"reflection.json": json.dumps(table, indent=1) + "\n"}


def _interface(texts: dict[tuple[str, str], str], entry: str) -> dict[str, Any]:
    return interface(entry, texts["reflect", entry], texts["glsl430", entry])


def _texts(hlsl: Path, entry: str, languages: tuple[str, ...]) -> dict[tuple[str, str], str]:
    module = spirv(hlsl, entry)
    texts = {}
    for language in languages:
        text = cross(module, entry, language)
        texts[language, entry] = text if language == "reflect" else _with_header(text, entry, language)
    return texts


def _with_header(text: str, entry: str, language: str) -> str:
    """The text with its origin; GLSL ES wants #version in the first line."""
    tools = ", ".join(f"{tool} {version}" for tool, version in versions().items())
    header = (
        f"// Generated from hlsl/{ENTRIES[entry].hlsl}, entry {entry}, by `python -m avatar_shaders`; do not edit.\n"
        f"// Tools: {tools}\n"
    )
    text = _COMBINED.sub(r"\1", text)
    if language == "msl":
        return header + text
    version, _, rest = text.partition("\n")
    return f"{version}\n{header}{rest}"
