"""The made files of the Unreal plugin: the HLSL under Unreal's names, and shader classes of the interfaces.

Unreal accepts .usf and .ush only: `x.hlsli` becomes x_core.ush, `x.hlsl` becomes x.ush, and beside it lies x.usf, a few
lines that name its entries. It needs the parameters of a shader as a C++ struct when it compiles.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

from avatar_shaders.copies import copies
from avatar_shaders.entries import ENTRIES, HLSL_ONLY
from avatar_shaders.generate import HLSL
from avatar_shaders.texts import reflection

_COPY = "// Copy of engine_shaders/avatar_shaders/hlsl/{name}: change it there.\n"
_STAGE = """\
// Stage `{stage}` for Unreal, made of engine_shaders/avatar_shaders/entries.py. Entries: {entries}.
// Parameters are loose and gathered by name.
#include "/Engine/Public/Platform.ush"
#define AVATAR_LOOSE_CONSTANTS 1
#include "{file}.ush"
"""
_MADE = "// Made of engine_shaders/avatar_shaders/reflection.json.\n"
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
_LOOSE = re.compile(r"^(Texture2D|float\d?) (\w+);", re.MULTILINE)
_ENTRY = re.compile(r"^float4? (unreal_\w+)\(.*?^\{\n(.*?)^\}", re.MULTILINE | re.DOTALL)
_QUADS = {"name": "Quads", "binding": 0, "type": "float4", "readonly": True}


def unreal_shaders(hlsl: Path = HLSL) -> dict[str, str]:
    """{file name: text} of the shaders of the plugin, but for the one that is written by hand."""
    texts = copies(hlsl, "_core.ush", ".ush", _COPY)
    entries = ENTRIES | HLSL_ONLY
    for file in dict.fromkeys(row.hlsl for row in entries.values()):
        names = [name for name, row in entries.items() if row.hlsl == file]
        texts[f"{Path(file).stem}.usf"] = _STAGE.format(
            stage=entries[names[0]].stage, entries=", ".join(names), file=Path(file).stem
        )
    return texts


def unreal_kernels(draws: str) -> dict[str, str]:
    """{file name: text} of the shader classes. `draws` is unreal_draw.usf, which is written by hand."""
    rows = reflection("msl")  # languages differ in the names of entry points alone
    entries = {name: row for name, row in rows.items() if row["kind"] == "compute"}
    drawn = {
        _FETCH: rows["raster_vertex"] | {"storage": [_QUADS]},
        "raster_pixel": rows["raster_pixel"],
        **_drawing(draws, rows["composite_pixel"]),
    }
    return {
        "GaussianAvatarKernels.h": _MADE + _header(entries, drawn),
        "GaussianAvatarKernels.cpp": _MADE + _code(entries, drawn),
    }


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
