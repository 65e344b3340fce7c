"""The made files of players/web/src/made: shader texts, interfaces, constants and kernels as TypeScript modules."""

from __future__ import annotations

import base64
import json
import re
from collections import Counter
from collections.abc import Sequence
from string import ascii_lowercase, ascii_uppercase
from typing import Any

from avatar_schema.pack_form import form_text
from avatar_shaders.entries import ENTRIES
from avatar_shaders.generate import HLSL, generate
from avatar_shaders.headers import idle_table, table
from avatar_shaders.kernels import kernels
from avatar_shaders.tools import ShaderError

_MADE = "// Made from the HLSL of avatar_shaders by `python -m avatar_shaders`; do not edit.\n"
_COMMENT = re.compile(r"//[^\n]*")
_SPACE = re.compile(r"\s*([^\w\s])\s*|\s+")
_IDENTIFIER = re.compile(r"\b[A-Za-z]\w*_\d+\b")
# What WGSL says shorter: types that an initial value has, literals, vectors. `block` below places members.
_SHORTER = (
    (re.compile(r"@align\(\d+\)"), ""),
    (re.compile(r"\bvec(\d)<([fiu])32>"), r"vec\1\2"),
    (re.compile(r"\b([iu])32\((\d+)\)"), r"\2\1"),
    (re.compile(r"\b(var|let|const) (\w+):[^;=(){}]+="), r"\1 \2="),
    (re.compile(r" ([-+]) (?![-+])"), r"\1"),
)
_FUNCTION = re.compile(
    r"\bfn \w+(\([^{]*)(\{(?:[^{}]|\{(?:[^{}]|\{(?:[^{}]|\{(?:[^{}]|\{[^{}]*\})*\})*\})*\})*\})"
)
_PARAMETER = re.compile(r"(\w+):")
_LOCAL = re.compile(r"\b(?:var|let|const) (\w+)")
_NAME = re.compile(r"(?<![.\w])[A-Za-z_]\w*")  # no member
_LETTERS = [letter for letter in ascii_lowercase if letter not in "fiu"]  # f32, i32 and u32 are types
_MACRO = re.compile(r"^#define AVATAR_(\w+) (\d+|\([\w *]+\)) // (.+)$", re.MULTILINE)
_DRAWN = ("raster_vertex_batch", "raster_pixel", "composite_vertex", "composite_pixel")
_SPACED = "+-"  # "a - -b" is not "a--b"
_LIT = ("shadow", "light")  # stages
_DEPTH = "raster_depth_pixel"

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
  readonly stage: string;
  readonly storage: readonly StorageBuffer[];
  readonly uniforms: UniformBlock | null;
  readonly access: Contract | null; // entries that a program may use
}

/** A uniform block of "NAME:TYPE" apart by spaces, uint where no type stands, each at a multiple of its alignment. */
function block(name: string, binding: number, size: number, members: string): UniformBlock {
  let end = 0;
  const placed = members.split(" ").map((member) => {
    const [name, type = "uint"] = member.split(":") as [string, string?];
    const bytes = 4 * (Number(type.slice(5)) || 1);
    const offset = Math.ceil(end / bytes) * bytes;
    end = offset + bytes;
    return { name, offset, type };
  });
  return { name, binding, size, members: placed };
}

/** Every entry of the shaders, by name. */
"""
_FORM = "/** What the document of a pack must be: JSON, of the keywords that `Form` knows. */\n"
_KERNELS = """\
/**
 * A WebAssembly module, a character a byte: the compute entries that need no memory of a thread group, as functions
 * `NAME(params, firstRow, rows)` over rows firstRow .. firstRow + rows. `params` is the address of 32-bit addresses:
 * of every storage buffer in the order of INTERFACES[NAME].storage, then of the uniform block. It imports nothing and
 * exports `memory` and `__heap_base`, the first byte that the caller may use.
 */
"""


def web_files(made: dict[str, str]) -> dict[str, str]:
    """{file name: text} of every module. `made` is what generate_all() makes. Raises ShaderError."""
    rows: dict[str, dict[str, Any]] = json.loads(made["reflection.json"])["entries"]
    wgsl = {name: minified_wgsl(made[f"wgsl/{name}.wgsl"]) for name in ENTRIES}
    glsl = generate(HLSL, (*_DRAWN, _DEPTH), ["glsl300es"])
    depth = {"GLSL": minified_glsl(glsl["glsl300es", _DEPTH]), **renamed({"WGSL": wgsl.pop(_DEPTH)})}
    wgsl = renamed(wgsl)
    modules = {
        "wgsl.ts": _texts(
            "WGSL", "Entries as WGSL, by name; the function has the same name.", _of(wgsl, rows, lit=False)
        ),
        "wgsl_light.ts": _texts(
            "LIGHT_WGSL",
            "Entries of stages shadow and light, which few pages load.",
            _of(wgsl, rows, lit=True),
        ),
        "glsl.ts": _texts(
            "GLSL",
            "What draws in WebGL2 as GLSL ES 3.00, by the entry's name.",
            {name: minified_glsl(glsl["glsl300es", name]) for name in _DRAWN},
        ),
        "depth.ts": "".join(
            f"/** Entry {_DEPTH}, which few pages need, as {language}. */\n"
            f"export const DEPTH_{language} =\n  {json.dumps(text)};\n"
            for language, text in depth.items()
        ),
        "reflection.ts": _REFLECTION
        + _interfaces({entry: row for entry, row in rows.items() if entry != _DEPTH}),
        "constants.ts": _constants(),
        "idle.ts": _idle(),
        "pack_form.ts": f"{_FORM}export const PACK_FORM =\n  '{form_text()}';\n",
        "kernels.ts": _KERNELS
        + f'export const KERNELS = atob("{base64.b64encode(kernels(rows)).decode()}");\n',
    }
    return {name: _MADE + text for name, text in modules.items()}


def _of(texts: dict[str, str], rows: dict[str, dict[str, Any]], *, lit: bool) -> dict[str, str]:
    return {entry: text for entry, text in texts.items() if (rows[entry]["stage"] in _LIT) == lit}


def minified(text: str) -> str:
    """A shader's text without comments and without space that means nothing."""
    return _SPACE.sub(_squeezed, _COMMENT.sub("", text)).strip()


def minified_wgsl(text: str) -> str:
    """The same, by the rules of WGSL."""
    text = minified(text)
    for pattern, short in _SHORTER:
        text = pattern.sub(short, text)
    return text


def renamed(texts: dict[str, str]) -> dict[str, str]:
    """
    WGSL with short identifiers. Those of a function are its own, small letters from a on: few names compress well.
    Others are the same in all texts; slangc ends them with a number.
    """
    texts = {entry: _FUNCTION.sub(_with_short_locals, text) for entry, text in texts.items()}
    counts = Counter(name for text in texts.values() for name in _IDENTIFIER.findall(text))
    short = {name: _short(place, ascii_uppercase) for place, (name, _) in enumerate(counts.most_common())}
    return {entry: _IDENTIFIER.sub(lambda found: short[found[0]], text) for entry, text in texts.items()}


def _with_short_locals(function: re.Match[str]) -> str:
    names = dict.fromkeys([*_PARAMETER.findall(function[1]), *_LOCAL.findall(function[2])])
    short = {name: _short(place, _LETTERS) for place, name in enumerate(names)}
    return _NAME.sub(lambda found: short.get(found[0], found[0]), function[0])


def _short(place: int, letters: Sequence[str]) -> str:
    """A letter, then letters with a number: none of them is a word of WGSL."""
    number, letter = divmod(place, len(letters))
    return letters[letter] + (str(number) if number else "")


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
    lines = "".join(f"  {name}: {{{_interface(row)}}},\n" for name, row in rows.items())
    return f"export const INTERFACES: Readonly<Record<string, Interface>> = {{\n{lines}}};\n"


def _interface(row: dict[str, Any]) -> str:
    """What a player needs of an entry, as TypeScript."""
    storage = [
        {key: buffer[key] for key in ("name", "binding", "stride", "readonly")} for buffer in row["storage"]
    ]
    fields = {"stage": row["stage"], "storage": storage, "access": row.get("access")}
    texts = {name: json.dumps(value, separators=(",", ":")) for name, value in fields.items()}
    texts["uniforms"] = next(map(_block, row["uniform_blocks"]), "null")
    return ",".join(f"{name}:{text}" for name, text in texts.items())


def _block(block: dict[str, Any]) -> str:
    """A call of `block` in _REFLECTION. Raises ShaderError where a member lies elsewhere than it would place it."""
    words, end = [], 0
    for member in block["members"]:
        size = 4 * int(member["type"][5:] or 1)
        if member["offset"] != -(-end // size) * size:
            raise ShaderError(f"{block['name']}.{member['name']} is not at the next multiple of its size")
        end = member["offset"] + size
        words.append(member["name"] + ("" if member["type"] == "uint" else f":{member['type']}"))
    return f'block("{block["name"]}",{block["binding"]},{block["size"]},"{" ".join(words)}")'


def _constants() -> str:
    """The numbers of the shaders that a player's own code may need."""
    lines = []
    for name, entry in table("constants.json").items():
        kind = ": readonly number[]" if isinstance(entry["value"], list) else ""
        value = json.dumps(entry["value"])
        lines.append(f"/** {entry['reason']} */\nexport const {name.upper()}{kind} = {value};\n")
    for name, number, about in macros():
        lines.append(f"/** {about} */\nexport const {name} = {number};\n")
    return "".join(lines)


def _idle() -> str:
    """The numbers of idle life."""
    lines = []
    for name, (about, value) in idle_table().items():
        kind = "" if not isinstance(value, list) else ": readonly number[]"
        if kind and isinstance(value[0], list):
            kind = ": readonly (readonly [channel: string, row: number, ...numbers: number[]])[]"
        rows = json.dumps(value) if kind.count("[") < 2 else _rows(value)
        lines.append(f"/** {about} */\nexport const {name.upper()}{kind} = {rows};\n")
    return "".join(lines)


def _rows(value: list[Any]) -> str:
    return "[\n" + "".join(f"  {json.dumps(row)},\n" for row in value) + "]"


def macros() -> list[tuple[str, str, str]]:
    """(name, number or formula, comment) of every macro of a number that a player's own code may need."""
    texts = [(HLSL / file).read_text("utf-8") for file in ("platform.hlsli", "sort.hlsli", "raster.hlsli")]
    found = [row for text in texts for row in _MACRO.findall(text)]
    return [(name, value.strip("()").replace("AVATAR_", ""), about) for name, value, about in found]
