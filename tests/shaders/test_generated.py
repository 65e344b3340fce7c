"""Committed text is what the tools make of the HLSL, and the reflection table says what the text says."""

from __future__ import annotations

import json
import math
import re
from importlib.resources import files

import pytest

import avatar_shaders
from avatar_schema import constants, rules
from avatar_shaders import ENTRIES, HLSL_ONLY, LANGUAGES, reflection, source
from avatar_shaders.__main__ import differing, made_files
from avatar_shaders.generate import HLSL
from avatar_shaders.godot import GODOT_ENTRIES, spirv_main
from avatar_shaders.headers import literal
from avatar_shaders.tools import cross, spirv, versions
from tests.shaders import gl_process


def committed_tools() -> dict[str, str]:
    table = json.loads((files(avatar_shaders) / "reflection.json").read_text("utf-8"))
    tools: dict[str, str] = table["tools"]
    return tools


def test_committed_files_are_what_the_tools_make() -> None:
    if committed_tools() == versions():
        assert differing() == []
        return
    assert made_files()
    pytest.skip(f"compiled only, not compared: made by {committed_tools()}, here are {versions()}")


@pytest.mark.parametrize("entry", ENTRIES)
def test_msl_binds_what_the_table_says(entry: str) -> None:
    text, row = source(entry, "msl"), reflection("msl")[entry]
    buffers = re.findall(r"(const )?device \w+& (\w+?)(?:_1)? \[\[buffer\((\d+)\)\]\]", text)
    assert sorted((int(n), name, bool(readonly)) for readonly, name, n in buffers) == [
        (s["binding"], s["name"], s["readonly"]) for s in row["storage"]
    ]
    blocks = re.findall(r"constant (\w+)& constants \[\[buffer\((\d+)\)\]\]", text)
    assert [(name, int(n)) for name, n in blocks] == [
        (u["name"], u["binding"]) for u in row["uniform_blocks"]
    ]
    textures = re.findall(r"(\w+) \[\[texture\((\d+)\)\]\]", text)
    assert [(name, int(n)) for name, n in textures] == [(t["name"], t["binding"]) for t in row["textures"]]
    assert re.search(rf"^(kernel|vertex|fragment) \w+ {row['entry_point']}\(", text, re.MULTILINE)


def test_shader_constants_are_the_formats() -> None:
    text = (files(avatar_shaders) / "hlsl" / "constants.hlsli").read_text("utf-8")
    found = dict(re.findall(r"^#define AVATAR_(\w+) (\S+)$", text, re.MULTILINE))
    wanted: dict[str, float] = {}
    for name, value in constants().items():
        numbers = {f"_{i}": v for i, v in enumerate(value)} if isinstance(value, list) else {"": value}
        wanted |= {f"{name.upper()}{index}": v for index, v in numbers.items()}
    assert {name: float(number.strip("()f")) for name, number in found.items()} == wanted
    assert literal(16) == "16" and literal(-0.5) == "(-0.5f)"


def test_shader_codes_are_the_formats() -> None:
    text = (files(avatar_shaders) / "hlsl" / "rules.hlsli").read_text("utf-8")
    found = [(name, int(number)) for name, number in re.findall(r"^#define AVATAR_(\w+) (\d+)$", text, re.M)]
    values = [(f"{rule.name}_{v.name}".upper(), v.code) for rule in rules().values() for v in rule.values]
    assert found == values


COMPUTE = [name for name, row in ENTRIES.items() if row.kind == "compute"]
BYTES = {"uint": 4, "float": 4, "uint2": 8, "float2": 8, "float3": 12, "float4": 16}


@pytest.mark.parametrize("language", LANGUAGES)
@pytest.mark.parametrize("entry", COMPUTE)
def test_a_compute_stage_fits_the_smallest_device(entry: str, language: str) -> None:
    row = reflection(language)[entry]
    most = 4 if language == "glsl310es" else 8
    assert 1 <= len(row["storage"]) <= most
    assert [s["binding"] for s in row["storage"]] == list(range(len(row["storage"])))  # GLES: bindings 0..3
    assert row["shared_bytes"] <= 16384
    assert math.prod(row["thread_group"]) <= 128
    assert len(row["uniform_blocks"]) == 1


def test_constants_of_a_block_do_not_overlap_and_end_inside() -> None:
    for row in reflection("glsl430").values():
        for block in row["uniform_blocks"]:
            end = 0
            for member in block["members"]:
                assert member["offset"] >= end, (block["name"], member["name"])
                end = member["offset"] + member.get("stride", BYTES[member["type"]]) * member.get("count", 1)
            assert end <= block["size"] <= 16384 and block["size"] % 16 == 0


ALL = ENTRIES | HLSL_ONLY


@pytest.mark.parametrize("entry", ALL)
def test_glslang_takes_it_and_the_module_is_valid(entry: str) -> None:
    assert spirv(HLSL, entry)  # spirv() runs spirv-val and raises what either says


@pytest.mark.parametrize("entry", GODOT_ENTRIES)
def test_godots_module_is_the_same_but_for_the_name(entry: str) -> None:
    modules = spirv_main(HLSL, entry), spirv(HLSL, entry)
    ours, plain = (cross(module, "glsl430") for module in modules)
    assert ours.replace("_main(", f"_{entry}(") == plain
    told = [json.loads(cross(module, "reflect"))["entryPoints"] for module in modules]
    assert [[row["name"] for row in rows] for rows in told] == [["main"], [entry]]


@pytest.mark.parametrize("language", [language for language in LANGUAGES if language.startswith("glsl")])
def test_a_driver_takes_the_generated_text(language: str) -> None:
    version = {"glsl430": "#version 430", "glsl310es": "#version 310 es"}[language]
    assert {source(entry, language).partition("\n")[0] for entry in ENTRIES} == {version}
    compute = [name for name, row in ENTRIES.items() if row.kind == "compute"]
    programs = [{"compute": source(entry, language)} for entry in compute]
    programs += [
        {"vertex": source(f"{name}_vertex", language), "fragment": source(f"{name}_pixel", language)}
        for name in ("raster", "composite")
    ]
    broken = {"compute": source("activate", language).replace("void main()", "void main(")}
    *said, complaint = gl_process.refusals(language, [*programs, broken])
    assert not any(said), said
    assert "syntax error" in complaint
