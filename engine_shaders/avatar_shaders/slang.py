"""WGSL and C++ of an entry, by Slang's compiler. Bindings and offsets are made to be those of reflection.json."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

from avatar_shaders.entries import ENTRIES
from avatar_shaders.tools import ShaderError, program, run

_TARGETS: dict[str, tuple[str, ...]] = {  # target: options of slangc
    "wgsl": ("-DAVATAR_ATOMIC_COUNTERS",),
    "cpp": ("-DAVATAR_ONE_THREAD",),
}
_FAULT = re.compile(r"error\[\w+\]: (?P<text>.+)\n *--> (?P<file>[^:\n]+):(?P<line>\d+):")
_RESOURCE = re.compile(r"@binding\(\d+\) @group\(0\) var(?:<[^>]*>)? (?P<name>\w+)_0 : (?P<type>\w+)")
_STRUCT = re.compile(r"^struct (?P<name>\w+)\n\{\n(?P<members>.*?)^\};", re.MULTILINE | re.DOTALL)
_MEMBER = re.compile(r"@align\((?P<align>\d+)\) (?P<name>\w+)_0 : (?P<type>[\w<>]+),")
_WORDS = {"float": "f32", "uint": "u32", "int": "i32"}
_LAYOUT = {"": (4, 4), "2": (8, 8), "3": (12, 16), "4": (16, 16)}  # components: bytes, alignment


def slang(folder: Path, entry: str, target: str) -> str:
    """An entry as text of a target, `wgsl` or `cpp`, as slangc writes it. Raises ShaderError."""
    row = ENTRIES[entry]
    options = ["-lang", "hlsl", "-I", str(folder), "-entry", entry, "-stage", row.kind, *_TARGETS[target]]
    options += ["-target", target, "-line-directive-mode", "none"]
    done = run([program("slangc"), str(folder / row.hlsl), *options])
    text = done.stdout.decode()
    if done.returncode or not text:
        raise _refused(entry, row.hlsl, done.stderr.decode(errors="replace"))
    return text


def wgsl(folder: Path, entry: str, interface: dict[str, Any]) -> str:
    """An entry as WGSL that binds what its row of reflection.json says. Raises ShaderError where it cannot."""
    text = slang(folder, entry, "wgsl")
    blocks = {block["name"]: block for block in interface["uniform_blocks"]}
    bound = [*interface["storage"], *blocks.values(), *interface["textures"]]
    numbers = {resource["name"]: resource["binding"] for resource in bound}
    found = [match["name"] for match in _RESOURCE.finditer(text)]
    if sorted(found) != sorted(numbers):
        raise _differs(entry, f"WGSL binds {', '.join(found)}; reflection.json has {', '.join(numbers)}")
    structs = {match["name"]: match["members"] for match in _STRUCT.finditer(text)}
    for match in _RESOURCE.finditer(text):
        if match["name"] in blocks:
            _check_offsets(entry, structs[match["type"]], blocks[match["name"]])
    return _RESOURCE.sub(lambda m: _bound(m, numbers[m["name"]]), text)


def _bound(match: re.Match[str], number: int) -> str:
    return re.sub(r"@binding\(\d+\)", f"@binding({number})", match[0])


def _check_offsets(entry: str, members: str, block: dict[str, Any]) -> None:
    """WGSL places a member at the next multiple of its alignment: that must be its offset in the block."""
    at, found = 0, []
    for match in _MEMBER.finditer(members):
        vector = re.fullmatch(r"vec(\d)<(\w+)>", match["type"])
        components, word = (vector[1], vector[2]) if vector else ("", match["type"])
        size, least = _LAYOUT[components]
        align = max(least, int(match["align"]))
        at = -(-at // align) * align
        found.append((match["name"], at, f"{word}{components}"))
        at += size
    wanted = [(m["name"], m["offset"], _wgsl_type(m["type"])) for m in block["members"]]
    if found != wanted:
        wrong = next((w for w, f in zip(wanted, found, strict=False) if w != f), wanted[-1])
        raise _differs(entry, f"{block['name']}.{wrong[0]} lies elsewhere in WGSL than in reflection.json")


def _wgsl_type(hlsl: str) -> str:
    """float4 as f324: the word of WGSL and the number of components."""
    word = hlsl.rstrip("234")
    return _WORDS[word] + hlsl[len(word) :]


def _differs(entry: str, text: str) -> ShaderError:
    file = ENTRIES[entry].hlsl
    return ShaderError(f"{file}: {text} (slangc, entry {entry})", file=file)


def _refused(entry: str, file: str, said: str) -> ShaderError:
    found = _FAULT.search(said)
    if found:
        name, line = Path(found["file"]).name, int(found["line"])
        via = "" if name == file else f", included by {file}"
        text = f"{name}:{line}: {found['text']} (slangc, entry {entry}{via})"
        return ShaderError(text, file=name, line=line)
    return _differs(entry, said or "no message")
