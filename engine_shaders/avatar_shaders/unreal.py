"""The made files of players/unreal: shader classes of the interfaces, and copies of the native player's sources.

Unreal needs the parameters of a shader as a C++ struct when it compiles. A plugin is copied into a project as a folder,
and Unreal builds what lies in its modules. So the sources of players/native are copied into it, but for the texts of
shaders, which Unreal does not use.
"""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

UNREAL = "players/unreal"
NATIVE = "players/native"
MODULE = f"{UNREAL}/Source/GaussianAvatar/Private"
_MADE = "// Made from the HLSL of avatar_shaders by `python -m avatar_shaders`; do not edit.\n"
_COPY = "// Copy of {path} by `python -m avatar_shaders`; do not edit.\n"
_TEXTS = ("glsl430", "glsl310es", "msl")
_CPP = {
    "uint": "uint32",
    "float": "float",
    "float2": "FVector2f",
    "float3": "FVector3f",
    "float4": "FVector4f",
}
_BYTES = {"uint": 4, "float": 4, "float2": 8, "float3": 12, "float4": 16}
_TAKES = "const uint8* Block, const FRDGBufferRef* Buffers, uint32 Groups"
_FETCH = "raster_vertex_fetch"  # as raster_vertex, but the quads are in a buffer; HLSL alone
_COMPILED = """
	static bool ShouldCompilePermutation(const FGlobalShaderPermutationParameters& Parameters)
	{
		return IsFeatureLevelSupported(Parameters.Platform, ERHIFeatureLevel::SM5);
	}
"""
_DRAWS = f"{UNREAL}/Shaders/unreal_draw.usf"  # written by hand
_LOOSE = re.compile(r"^(Texture2D|float\d?) (\w+);", re.MULTILINE)
_ENTRY = re.compile(r"^float4? (unreal_\w+)\(.*?^\{\n(.*?)^\}", re.MULTILINE | re.DOTALL)
_QUADS = {"name": "Quads", "binding": 0, "type": "float4", "readonly": True}


def unreal_files(root: Path, files: Mapping[str, str]) -> dict[str, str]:
    """{path below the checkout `root`: text}. `files` are all other made files: those of the native player are new."""
    rows: dict[str, dict[str, Any]] = json.loads(files["engine_shaders/avatar_shaders/reflection.json"])[
        "entries"
    ]
    entries = {name: row for name, row in rows.items() if row["kind"] == "compute"}
    drawn = {
        _FETCH: rows["raster_vertex"] | {"storage": [_QUADS]},
        "raster_pixel": rows["raster_pixel"],
        **_drawing((root / _DRAWS).read_text("utf-8"), rows["composite_pixel"]),
    }
    engine = {
        "GaussianAvatarKernels.h": _MADE + _header(entries, drawn),
        "GaussianAvatarKernels.cpp": _MADE + _code(entries, drawn),
    }
    return {f"{MODULE}/Engine/{name}": text for name, text in engine.items()} | _copies(root, files)


def _drawing(text: str, composite: dict[str, Any]) -> dict[str, dict[str, Any]]:
    """The entries of unreal_draw.usf, with the loose parameters that each names, as rows of reflection."""
    rows = {}
    for name, body in _ENTRY.findall(text):
        named = [(kind, word) for kind, word in _LOOSE.findall(text) if re.search(rf"\b{word}\b", body)]
        textures = [word for kind, word in named if kind == "Texture2D"]
        members = [{"type": kind, "name": word} for kind, word in named if kind != "Texture2D"]
        if "composite_pixel(" in body:
            textures.append("Accumulated")
            members += _members(composite)
        rows[name] = {
            "kind": "fragment",
            "hlsl": "unreal_draw",
            "storage": [],
            "textures": textures,
            "has_targets": True,  # its parameters hold what it draws into
            "uniform_blocks": [{"members": members}],
        }
    return rows


def _copies(root: Path, files: Mapping[str, str]) -> dict[str, str]:
    """The header and the sources of the native player, as they will be."""
    present = {str(path.relative_to(root)) for path in (root / NATIVE).rglob("*") if path.is_file()}
    wanted = sorted(
        path for path in present | set(files) if path.startswith((f"{NATIVE}/src/", f"{NATIVE}/include/"))
    )
    left_out = {f"{NATIVE}/src/made/{language}.cpp" for language in _TEXTS}
    copies = {}
    for path in wanted:
        if path not in left_out:
            text = files[path] if path in files else (root / path).read_text("utf-8")
            copies[f"{MODULE}/Native{path.removeprefix(NATIVE)}"] = _COPY.format(path=path) + text
    empty = "".join(
        f"const ShaderText {name}_texts[] = {{{{nullptr, nullptr}}}};\nconst uint32_t {name}_text_count = 0;\n"
        for name in _TEXTS
    )
    texts = f'#include "shader_texts.h"\n\nnamespace avatar {{\n\n{empty}\n}}  // namespace avatar\n'
    return copies | {f"{MODULE}/Native/src/made/no_texts.cpp": _MADE + texts}


def _header(entries: dict[str, Any], drawn: dict[str, Any]) -> str:
    most = max(1 + s["binding"] for row in entries.values() for s in row["storage"])
    head = (
        '#pragma once\n#include "DataDrivenShaderPlatformInfo.h"\n#include "GlobalShader.h"\n'
        '#include "RenderGraphResources.h"\n'
        '#include "ShaderParameterStruct.h"\n\n'
        "class FRDGBuilder;\n\n/** Storage buffers of a kernel, at most. */\n"
        f"constexpr uint32 AvatarMostBindings = {most};\n\n"
        "/** Bytes of an element of the buffer that shaders know by a name; 0 for an unknown one. */\n"
        "uint32 AvatarStride(const char* Name);\n\n"
        "/** Adds a dispatch. Block: its constants, in the layout of the shader texts. Buffers by binding. */\n"
        "void AddAvatarPass(FRDGBuilder& Builder, const char* Entry, const uint8* Block, const FRDGBufferRef* Buffers, "
        "uint32 Groups);\n\n"
    )
    return head + "\n".join(_class(name, row) for name, row in (entries | drawn).items())


def _class(name: str, row: dict[str, Any]) -> str:
    kind = _class_name(name)
    parameters = [f"SHADER_PARAMETER({_CPP[m['type']]}, {m['name']})" for m in _members(row)]
    for s in row["storage"]:
        view, letters = ("SRV", "") if s["readonly"] else ("UAV", "RW")
        parameters.append(
            f"SHADER_PARAMETER_RDG_BUFFER_{view}({letters}StructuredBuffer<{s['type']}>, {s['name']})"
        )
    if row.get("has_targets", False):
        parameters += [f"SHADER_PARAMETER_RDG_TEXTURE(Texture2D, {texture})" for texture in row["textures"]]
        parameters.append("RENDER_TARGET_BINDING_SLOTS()")
    body = "".join(f"\t\t{line}\n" for line in parameters)
    return (
        f"/** Entry {name}. */\nclass {kind} : public FGlobalShader\n{{\n"
        f"\tDECLARE_GLOBAL_SHADER({kind});\n\tSHADER_USE_PARAMETER_STRUCT({kind}, FGlobalShader);\n\n"
        f"\tBEGIN_SHADER_PARAMETER_STRUCT(FParameters, )\n{body}\tEND_SHADER_PARAMETER_STRUCT()\n{_COMPILED}}};\n"
    )


def _code(entries: dict[str, Any], drawn: dict[str, Any]) -> str:
    head = (
        '#include "GaussianAvatarKernels.h"\n\n#include "RenderGraphBuilder.h"\n#include "RenderGraphUtils.h"\n\n'
        "#include <cstring>\n\n"
    )
    shaders = "".join(_implemented(name, row) for name, row in (entries | drawn).items())
    adders = "".join(_adder(name, row) for name, row in entries.items())
    cases = "".join(
        f'\tif (std::strcmp(Entry, "{name}") == 0) Add{_class_name(name)[1:]}(Builder, Block, Buffers, Groups);\n'
        for name in entries
    )
    strides: dict[str, int] = {}
    for row in entries.values():
        strides |= {s["name"]: s["stride"] for s in row["storage"]}
    found = "".join(
        f'\tif (std::strcmp(Name, "{name}") == 0) return {stride};\n' for name, stride in strides.items()
    )
    return (
        f"{head}{shaders}\nnamespace\n{{\n{adders}}}\n\n"
        f"uint32 AvatarStride(const char* Name)\n{{\n{found}\treturn 0;\n}}\n\n"
        f"void AddAvatarPass(FRDGBuilder& Builder, const char* Entry, {_TAKES})\n{{\n{cases}}}\n"
    )


def _implemented(name: str, row: dict[str, Any]) -> str:
    file = Path(row["hlsl"]).stem
    stage = {"compute": "SF_Compute", "vertex": "SF_Vertex", "fragment": "SF_Pixel"}[row["kind"]]
    path = f"/Plugin/GaussianAvatar/{file}.usf"
    return f'IMPLEMENT_GLOBAL_SHADER({_class_name(name)}, "{path}", "{name}", {stage});\n'


def _adder(name: str, row: dict[str, Any]) -> str:
    kind = _class_name(name)
    lines = [
        f"std::memcpy(&Parameters->{m['name']}, Block + {m['offset']}, {_BYTES[m['type']]});"
        for m in _members(row)
    ]
    for s in row["storage"]:
        view = "SRV" if s["readonly"] else "UAV"
        lines.append(f"Parameters->{s['name']} = Builder.Create{view}(Buffers[{s['binding']}]);")
    body = "".join(f"\t{line}\n" for line in lines)
    return (
        f"void Add{kind[1:]}(FRDGBuilder& Builder, {_TAKES})\n{{\n"
        f"\t{kind}::FParameters* Parameters = Builder.AllocParameters<{kind}::FParameters>();\n{body}"
        f"\tconst TShaderMapRef<{kind}> Shader(GetGlobalShaderMap(GMaxRHIFeatureLevel));\n"
        f'\tFComputeShaderUtils::AddPass(Builder, RDG_EVENT_NAME("{name}"), Shader, Parameters, '
        f"FIntVector(static_cast<int32>(Groups), 1, 1));\n}}\n\n"
    )


def _members(row: dict[str, Any]) -> list[dict[str, Any]]:
    return [member for block in row["uniform_blocks"] for member in block["members"]]


def _class_name(entry: str) -> str:
    return "FAvatar" + "".join(part.capitalize() for part in entry.split("_"))
