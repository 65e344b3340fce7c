"""Makes GLSL, MSL and the reflection table from a folder of HLSL."""

from __future__ import annotations

import json
import re
from collections.abc import Iterable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from avatar_shaders.contracts import contracts
from avatar_shaders.entries import ENTRIES, LANGUAGES, path_of
from avatar_shaders.reflect import interface
from avatar_shaders.tools import ShaderError, cross, spirv, versions

PACKAGE = Path(__file__).parent
HLSL = PACKAGE / "hlsl"
_COMBINED = re.compile(r"SPIRV_Cross_Combined(\w+?)SPIRV_Cross_DummySampler")

Texts = dict[tuple[str, str], str]


def generate(
    hlsl: Path = HLSL, entries: Iterable[str] = tuple(ENTRIES), languages: Iterable[str] = LANGUAGES
) -> Texts:
    """{(language, entry): text} of the HLSL in a folder, which may be an altered copy of this package's.

    Language "reflect" gives the interface as JSON of spirv-cross. Raises tools.ShaderError where a file does not
    compile or a tool is missing.
    """
    chosen = tuple(languages)
    with ThreadPoolExecutor() as pool:
        found = pool.map(lambda entry: _texts(hlsl, entry, chosen), entries)
        return {key: text for texts in found for key, text in texts.items()}


def generate_all(hlsl: Path = HLSL) -> dict[str, str]:
    """{path below the package: text} of all that is generated from a folder of HLSL. Raises tools.ShaderError."""
    texts = generate(hlsl, ENTRIES, (*LANGUAGES, "reflect"))
    rows = {e: interface(e, ENTRIES[e], texts["reflect", e], texts["glsl430", e]) for e in ENTRIES}
    for entry, contract in contracts().items():
        rows[entry]["access"] = contract
    files = {path_of(entry, language): texts[language, entry] for entry in ENTRIES for language in LANGUAGES}
    return files | {"reflection.json": json.dumps({"tools": versions(), "entries": rows}, indent=1) + "\n"}


def _texts(hlsl: Path, entry: str, languages: tuple[str, ...]) -> Texts:
    row, texts = ENTRIES[entry], {}
    module = spirv(hlsl, entry)
    for language in languages:
        try:
            text = cross(module, language, vertex=row.kind == "vertex")
        except ShaderError as error:
            raise ShaderError(f"{row.hlsl}: {error} (entry {entry})", file=row.hlsl) from None
        texts[language, entry] = text if language == "reflect" else _finished(text, language, entry)
    return texts


def _finished(text: str, language: str, entry: str) -> str:
    """The text with a header, and textures under their HLSL names. In GLSL ES #version must be the first line."""
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
