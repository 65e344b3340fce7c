"""The made files of players/web/src/made: shader texts, interfaces, constants and kernels as TypeScript modules."""

from __future__ import annotations

import base64
import json
import re
from collections import Counter
from string import ascii_letters
from typing import Any

from avatar_schema.pack_form import form_text
from avatar_shaders.entries import ENTRIES
from avatar_shaders.generate import HLSL, generate
from avatar_shaders.headers import table
from avatar_shaders.kernels import kernels

_MADE = "// Made from the HLSL of avatar_shaders by `python -m avatar_shaders`; do not edit.\n"
_COMMENT = re.compile(r"//[^\n]*")
_SPACE = re.compile(r"\s*([^\w\s])\s*|\s+")
_IDENTIFIER = re.compile(r"\b[A-Za-z]\w*_\d+\b")
_LETTERS = [letter for letter in ascii_letters if letter not in "fiu"]  # f32, i32 and u32 are types
_MACRO = re.compile(r"^#define AVATAR_(\w+) (\d+|\([\w *]+\)) // (.+)$", re.MULTILINE)
_DRAWN = ("raster_vertex_batch", "raster_pixel", "composite_vertex", "composite_pixel")
_SPACED = "+-"  # "a - -b" is not "a--b"

_REFLECTION = """\
/** A member of a uniform block; its type as HLSL spells it: "uint", "float4". */
export interface Member {
  readonly name: string;
  readonly offset: number; // bytes
  readonly type: string;
}

/** A uniform block: its name in GLSL, and its bytes. */
export interface UniformBlock {
  readonly name: string;
  readonly binding: number;
  readonly size: number; // bytes
  readonly members: readonly Member[];
}

/** A storage buffer of an entry. */
export interface StorageBuffer {
  readonly name: string;
  readonly binding: number;
  readonly type: string; // of an element
  readonly stride: number; // bytes of an element
  readonly readonly: boolean;
}

/** How many elements of a buffer without sections a pass touches; `when`: for these values of constants alone. */
export interface Touched {
  readonly elements: string;
  readonly when?: Readonly<Record<string, readonly number[]>>;
}

/** A section of a packed buffer. An absent `width` means 32 bits. */
export interface SectionContract {
  readonly buffer: string;
  readonly kind: "pointer" | "index" | "linear" | "signed" | "weight" | "table";
  readonly elements: string;
  readonly width?: string;
  readonly widths?: readonly number[];
  readonly below?: string;
  readonly pointer?: number;
  readonly scale?: string;
  readonly floats?: string;
  readonly when?: Readonly<Record<string, readonly number[]>>;
}

/** What a pass of an entry reads and writes, by its constants. Expressions are sums of products: "3*#morph_ptr+1". */
export interface Contract {
  readonly rows: string;
  readonly most?: Readonly<Record<string, number>>;
  readonly values?: Readonly<Record<string, readonly number[]>>;
  readonly fits?: readonly (readonly [string, string])[];
  readonly pose?: Readonly<Record<string, string>>;
  readonly same?: Readonly<Record<string, readonly string[]>>;
  readonly chunk?: string;
  readonly level?: readonly string[];
  readonly elements?: Readonly<Record<string, readonly Touched[]>>;
  readonly sections?: Readonly<Record<string, SectionContract>>;
}

/** What an entry of the shaders binds. Everything is in bind group 0. */
export interface Interface {
  readonly kind: "compute" | "vertex" | "fragment";
  readonly stage: string;
  readonly threadGroup: number; // threads of a group along x; 0 unless it is a compute entry
  readonly storage: readonly StorageBuffer[];
  readonly uniforms: UniformBlock | null;
  readonly textures: readonly { readonly name: string; readonly binding: number }[];
  readonly inputs: readonly { readonly name: string; readonly location: number; readonly type: string }[];
  readonly access: Contract | null; // entries that a program may use
}

/** Every entry of the shaders, by name. */
"""
_FORM = "/** What the document of a pack must be: JSON, of the keywords that `Form` knows. */\n"
_KERNELS = """\
/**
 * A WebAssembly module in base64: the compute entries that need no memory of a thread group, as functions
 * `NAME(params, firstRow, rows)` over rows firstRow .. firstRow + rows. `params` is the address of 32-bit addresses:
 * of every storage buffer in the order of INTERFACES[NAME].storage, then of the uniform block. It imports nothing and
 * exports `memory` and `__heap_base`, the first byte that the caller may use.
 */
"""


def web_files(made: dict[str, str]) -> dict[str, str]:
    """{file name: text} of every module. `made` is what generate_all() makes. Raises ShaderError."""
    rows: dict[str, dict[str, Any]] = json.loads(made["reflection.json"])["entries"]
    wgsl = renamed({name: minified(made[f"wgsl/{name}.wgsl"]) for name in ENTRIES})
    glsl = generate(HLSL, _DRAWN, ["glsl300es"])
    modules = {
        "wgsl.ts": _texts("WGSL", "Every entry as WGSL, by name; its function has the same name.", wgsl),
        "glsl.ts": _texts(
            "GLSL",
            "What draws in WebGL2 as GLSL ES 3.00, by the entry's name.",
            {name: minified_glsl(glsl["glsl300es", name]) for name in _DRAWN},
        ),
        "reflection.ts": _REFLECTION + _interfaces(rows),
        "constants.ts": _constants(),
        "pack_form.ts": f"{_FORM}export const PACK_FORM =\n  '{form_text()}';\n",
        "kernels.ts": _KERNELS + f'export const KERNELS = "{base64.b64encode(kernels(rows)).decode()}";\n',
    }
    return {name: _MADE + text for name, text in modules.items()}


def minified(text: str) -> str:
    """A shader's text without comments and without space that means nothing."""
    return _SPACE.sub(_squeezed, _COMMENT.sub("", text)).strip()


def renamed(texts: dict[str, str]) -> dict[str, str]:
    """WGSL with short identifiers, the same in all texts. slangc ends every name but those of entries with a number."""
    counts = Counter(name for text in texts.values() for name in _IDENTIFIER.findall(text))
    short = {name: _short(place) for place, (name, _) in enumerate(counts.most_common())}
    return {entry: _IDENTIFIER.sub(lambda found: short[found[0]], text) for entry, text in texts.items()}


def _short(place: int) -> str:
    """A letter, then letters with a number: none of them is a word of WGSL."""
    number, letter = divmod(place, len(_LETTERS))
    return _LETTERS[letter] + (str(number) if number else "")


def minified_glsl(text: str) -> str:
    """The same; lines of the preprocessor stay lines."""
    parts = re.split(r"^(#.*\n)", _COMMENT.sub("", text), flags=re.MULTILINE)
    return "".join(part if part.startswith("#") else minified(part) for part in parts)


def _squeezed(match: re.Match[str]) -> str:
    sign = match[1]
    if sign is None:
        return " "
    return f" {sign} " if sign in _SPACED and match[0] != sign else sign


def _texts(name: str, about: str, texts: dict[str, str]) -> str:
    lines = "".join(f"  {entry}: {json.dumps(text)},\n" for entry, text in texts.items())
    return f"/** {about} */\nexport const {name}: Readonly<Record<string, string>> = {{\n{lines}}};\n"


def _interfaces(rows: dict[str, dict[str, Any]]) -> str:
    texts = {name: json.dumps(_interface(row), separators=(",", ":")) for name, row in rows.items()}
    lines = "".join(f"  {name}: {text},\n" for name, text in texts.items())
    return f"export const INTERFACES: Readonly<Record<string, Interface>> = {{\n{lines}}};\n"


def _interface(row: dict[str, Any]) -> dict[str, Any]:
    return {
        "kind": row["kind"],
        "stage": row["stage"],
        "threadGroup": row.get("thread_group", [0])[0],
        "storage": row["storage"],
        "uniforms": next(iter(row["uniform_blocks"]), None),
        "textures": row["textures"],
        "inputs": row.get("inputs", []),
        "access": row.get("access"),
    }


def _constants() -> str:
    """The numbers of the shaders that a player's own code may need."""
    lines = [
        f"/** {entry['reason']} */\nexport const {name.upper()} = {json.dumps(entry['value'])};\n"
        for name, entry in table("constants.json").items()
        if not isinstance(entry["value"], list)
    ]
    for name, number, about in macros():
        lines.append(f"/** {about} */\nexport const {name} = {number};\n")
    return "".join(lines)


def macros() -> list[tuple[str, str, str]]:
    """(name, number or formula, comment) of every macro of a number that a player's own code may need."""
    texts = [(HLSL / file).read_text("utf-8") for file in ("platform.hlsli", "sort.hlsli", "raster.hlsli")]
    found = [row for text in texts for row in _MACRO.findall(text)]
    return [(name, value.strip("()").replace("AVATAR_", ""), about) for name, value, about in found]
