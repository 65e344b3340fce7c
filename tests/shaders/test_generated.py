"""Committed text is what the tools make of the HLSL, and the reflection table says what the text says."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
import sys
from importlib.resources import files
from pathlib import Path

import pytest

import avatar_shaders
import avatar_shaders.__main__ as command
from avatar_schema import constants, rules
from avatar_shaders import ENTRIES, LANGUAGES, reflection, source
from avatar_shaders.__main__ import differing, made_files
from avatar_shaders.generate import HLSL
from avatar_shaders.headers import literal
from avatar_shaders.tools import versions
from avatar_shaders.web import minified, minified_glsl

GLSL = ("glsl430", "glsl310es")


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


@pytest.mark.parametrize("language", LANGUAGES)
def test_headers_name_source_entry_and_tools(language: str) -> None:
    writers = ("slang",) if language == "wgsl" else ("glslang", "spirv-cross")
    tools = ", ".join(f"{tool} {committed_tools()[tool]}" for tool in writers)
    for entry, row in ENTRIES.items():
        head = source(entry, language)[:400]
        assert f"Generated from hlsl/{row.hlsl}, entry {entry}, " in head
        assert tools in head


@pytest.mark.parametrize("language", GLSL)
@pytest.mark.parametrize("entry", ENTRIES)
def test_glsl_binds_what_the_table_says(entry: str, language: str) -> None:
    text, row = source(entry, language), reflection(language)[entry]
    buffers = re.findall(r"^layout\(binding = (\d+), std430\) (readonly )?buffer (\w+)", text, re.MULTILINE)
    assert sorted((int(n), name, bool(readonly)) for n, readonly, name in buffers) == [
        (s["binding"], s["name"], s["readonly"]) for s in row["storage"]
    ]
    blocks = re.findall(r"^layout\(binding = (\d+), std140\) uniform (\w+)", text, re.MULTILINE)
    assert [(int(n), name) for n, name in blocks] == [
        (u["binding"], u["name"]) for u in row["uniform_blocks"]
    ]
    textures = re.findall(r"^layout\(binding = (\d+)\) uniform .*sampler2D (\w+);", text, re.MULTILINE)
    assert [(int(n), name) for n, name in textures] == [(t["binding"], t["name"]) for t in row["textures"]]
    inputs = re.findall(r"^layout\(location = (\d+)\) in (?:highp )?\w+ (\w+);", text, re.MULTILINE)
    if row["kind"] == "vertex":
        assert sorted((int(n), name) for n, name in inputs) == [
            (i["location"], i["name"]) for i in row["inputs"]
        ]
    if row["kind"] == "compute":
        sizes = re.search(r"local_size_x = (\d+), local_size_y = (\d+), local_size_z = (\d+)", text)
        assert sizes and [int(n) for n in sizes.groups()] == row["thread_group"]
    assert row["entry_point"] == "main" and "void main()" in text


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


@pytest.mark.parametrize("entry", ENTRIES)
def test_wgsl_binds_what_the_table_says(entry: str) -> None:
    text, row = source(entry, "wgsl"), reflection("wgsl")[entry]
    bound = re.findall(r"^@binding\((\d+)\) @group\(0\) var(?:<([^>]*)>)? (\w+)_0 ", text, re.MULTILINE)
    kinds = {True: "storage, read", False: "storage, read_write"}
    wanted = [(s["binding"], kinds[s["readonly"]], s["name"]) for s in row["storage"]]
    wanted += [(t["binding"], "", t["name"]) for t in row["textures"]]
    wanted += [(u["binding"], "uniform", u["name"]) for u in row["uniform_blocks"]]
    assert sorted((int(number), kind, name) for number, kind, name in bound) == sorted(wanted)
    assert re.search(rf"^@{row['kind']}\n(?:@.*\n)?fn {row['entry_point']}\(", text, re.MULTILINE)
    inputs = re.findall(r"^    @location\((\d)\) (\w+)_0 : vec4<f32>,", text, re.MULTILINE)
    if row["kind"] == "vertex":
        assert [(int(n), name) for n, name in inputs] == [(i["location"], i["name"]) for i in row["inputs"]]
    if row["kind"] == "compute":
        assert f"@workgroup_size({', '.join(map(str, row['thread_group']))})" in text


def test_minified_text_means_the_same() -> None:
    """Tokens stay what they are: no sign joins another, no word joins another."""
    token = re.compile(r"\w+|[^\w\s]")
    for entry in ENTRIES:
        text = re.sub(r"//.*", "", source(entry, "wgsl"))
        assert token.findall(minified(text)) == token.findall(text)
        assert not re.search(r"\+\+|--|\bvar\(|\n", minified(text))
    assert minified("a - -b; // c\nreturn  - 1;") == "a - -b;return - 1;"
    assert minified_glsl("#version 300 es\n// c\n\nvoid  main ( ) { }\n") == "#version 300 es\nvoid main(){}"


def test_the_web_player_gets_every_entry() -> None:
    made = command.ROOT / command.WEB
    for name in ENTRIES:
        assert f'  {name}: "' in (made / "wgsl.ts").read_text("utf-8")
        assert f'  {name}: {{"kind":' in (made / "reflection.ts").read_text("utf-8")
    assert {path.name for path in made.iterdir()} == {
        "constants.ts", "glsl.ts", "kernels.ts", "reflection.ts", "wgsl.ts"
    }  # fmt: skip
    assert "export const SORT_BLOCK = THREADS * SORT_ITEMS;" in (made / "constants.ts").read_text("utf-8")


def test_generated_text_keeps_the_order_of_operations() -> None:
    """An optimiser that contracts a * b + c rounds differently, and GLSL ES 3.10 has no fma()."""
    for language in LANGUAGES:
        assert not [e for e in ENTRIES if re.search(r"\bfma\(", source(e, language))]


def test_shader_constants_are_the_formats() -> None:
    text = source("project", "hlsl") and (files(avatar_shaders) / "hlsl" / "constants.hlsli").read_text(
        "utf-8"
    )
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
    assert found == [
        (f"{rule.name}_{value.name}".upper(), value.code)
        for rule in rules().values()
        for value in rule.values
    ]


def test_unknown_names_are_refused() -> None:
    for call in (
        lambda: source("nothing", "hlsl"),
        lambda: source("blend", "spirv"),
        lambda: reflection("hlsl"),
    ):
        with pytest.raises(ValueError, match="is not one of"):
            call()


def test_left_over_files_are_found(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    engines = tmp_path / "engine_shaders"
    monkeypatch.setattr(command, "ROOT", tmp_path)
    monkeypatch.setattr(command, "ENGINES", engines)
    monkeypatch.setattr(command, "PACKAGE", engines / "avatar_shaders")
    made = [engines / "avatar_shaders/msl/old.metal"]
    made += [tmp_path / "players" / name for name in ("web/src/made/old.ts", "native/src/made/old.cpp")]
    for path in (*made, tmp_path / "players/unity/Core/Made/by_hand.cs"):
        path.parent.mkdir(parents=True)
        path.write_text(f"// {command.MADE}.\n" if path in made else "// mine\n", "utf-8")
    assert command.stale({}) == made
    assert command.stale({str(path.relative_to(tmp_path)): "" for path in made}) == []


def test_another_folder_is_generated_from_and_into(tmp_path: Path) -> None:
    """The copy carries another constant, and so does what is made of it; the package stays as it is."""
    altered = Path(shutil.copytree(HLSL, tmp_path / "hlsl"))
    constants = altered / "constants.hlsli"
    text = constants.read_text("utf-8").replace("AVATAR_ALPHA_MAX 0.99f", "AVATAR_ALPHA_MAX 0.875f")
    constants.write_text(text, "utf-8")
    arguments = ["--hlsl", str(altered), "--out", str(tmp_path / "out")]
    subprocess.run([sys.executable, "-m", "avatar_shaders", *arguments], check=True)
    made = (tmp_path / "out" / "glsl" / "raster_pixel.frag").read_text("utf-8")
    assert "0.875" in made and "0.875" not in source("raster_pixel", "glsl430")
    assert (tmp_path / "out" / "reflection.json").is_file()


def test_command_line_refuses() -> None:
    arguments = [sys.executable, "-m", "avatar_shaders", "--hlsl", "."]
    refused = subprocess.run(arguments, capture_output=True, text=True)
    assert refused.returncode == 2 and "--out" in refused.stderr
