"""Makes GLSL, MSL, WGSL and the reflection table from a folder of HLSL."""

from __future__ import annotations

import json
import re
from collections.abc import Iterable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from avatar_shaders.contracts import contracts
from avatar_shaders.entries import ENTRIES, HLSL_ONLY, MADE, path_of
from avatar_shaders.reflect import interface
from avatar_shaders.slang import wgsl
from avatar_shaders.tools import ShaderError, cross, spirv, version, versions

PACKAGE = Path(__file__).parent
HLSL = PACKAGE / "hlsl"
# GLSL ES 3.00 joins what a vertex shader hands on by name: `_entryPointOutput_x` there, `q_x` in the pixel shader.
_VARYING = re.compile(r"\b(?:_entryPointOutput|q)_(?=\w)")
_COMBINED = re.compile(r"SPIRV_Cross_Combined(\w+?)SPIRV_Cross_DummySampler")

_WIDTH = 116
Texts = dict[tuple[str, str], str]


def generate(
    hlsl: Path = HLSL, entries: Iterable[str] = tuple(ENTRIES), languages: Iterable[str] = MADE
) -> Texts:
    """{(language, entry): text} of the HLSL in a folder, which may be an altered copy of this package's.

    Language "reflect" gives the interface as JSON of spirv-cross. Raises tools.ShaderError where a file does not
    compile or a tool is missing.
    """
    wanted, chosen = tuple(entries), tuple(languages)
    with ThreadPoolExecutor() as pool:
        # All of them first: what is wrong is then said before slower tools run.
        modules = list(pool.map(lambda entry: spirv(hlsl, entry), wanted))
        found = pool.map(lambda entry, module: _texts(hlsl, entry, module, chosen), wanted, modules)
        return {key: text for texts in found for key, text in texts.items()}


def generate_all(hlsl: Path = HLSL) -> dict[str, str]:
    """{path below the package: text} of all that is generated from a folder of HLSL. Raises tools.ShaderError."""
    texts = generate(hlsl, ENTRIES, (*MADE, "reflect"))
    rows = {e: interface(e, ENTRIES[e], texts["reflect", e], texts["glsl310es", e]) for e in ENTRIES}
    for entry, contract in contracts().items():
        rows[entry]["access"] = contract
    files = {path_of(entry, language): texts[language, entry] for entry in ENTRIES for language in MADE}
    return files | {"reflection.json": _json({"tools": versions(), "entries": rows}) + "\n"}


def _json(value: object, depth: int = 0) -> str:
    """JSON in which lines hold as many elements of a list, and parts of an object, as fit."""
    text = json.dumps(value)
    if depth + len(text) < _WIDTH or not isinstance(value, dict | list):
        return text
    keys = [f"{json.dumps(key)}: " for key in value] if isinstance(value, dict) else [""] * len(value)
    parts = value.values() if isinstance(value, dict) else value
    lines = [""]
    for text in (key + _json(part, depth + 1) for key, part in zip(keys, parts, strict=True)):
        if lines[-1] and (depth == 1 or len(lines[-1]) + len(text) > _WIDTH - depth):
            lines.append("")
        lines[-1] += f"{' ' if lines[-1] else ''}{text},"
    inner = f"\n{' ' * (depth + 1)}".join(lines)[:-1]
    opened, closed = "{}" if isinstance(value, dict) else "[]"
    return f"{opened}\n{' ' * (depth + 1)}{inner}\n{' ' * depth}{closed}"


def _texts(hlsl: Path, entry: str, module: bytes, languages: tuple[str, ...]) -> Texts:
    reflected = _crossed(module, "reflect", entry)
    texts = {}
    for language in languages:
        if language == "reflect":
            texts[language, entry] = reflected
        elif language == "wgsl":
            row = interface(entry, ENTRIES[entry], reflected, "")
            texts[language, entry] = _header(language, entry) + wgsl(hlsl, entry, row)
        else:
            texts[language, entry] = _finished(_crossed(module, language, entry), language, entry)
    return texts


def _crossed(module: bytes, language: str, entry: str) -> str:
    row = (ENTRIES | HLSL_ONLY)[entry]
    try:
        return cross(module, language, vertex=row.kind == "vertex")
    except ShaderError as error:
        raise ShaderError(f"{row.hlsl}: {error} (entry {entry})", file=row.hlsl) from None


def _header(language: str, entry: str) -> str:
    writers = ("slang",) if language == "wgsl" else ("glslang", "spirv-cross")
    tools = ", ".join(f"{tool} {version(tool)}" for tool in writers)
    file = (ENTRIES | HLSL_ONLY)[entry].hlsl
    return (
        f"// Generated from hlsl/{file}, entry {entry}, by `python -m avatar_shaders`; do not edit.\n"
        f"// Tools: {tools}\n"
    )


def _finished(text: str, language: str, entry: str) -> str:
    """The text with a header, and textures under their HLSL names. In GLSL #version must be the first line."""
    text = _COMBINED.sub(r"\1", text)
    if language == "msl":
        return _header(language, entry) + text
    if language == "glsl300es":
        text = _VARYING.sub(r"varying_", text)
    first, _, rest = text.partition("\n")
    return f"{first}\n{_header(language, entry)}{rest}"
