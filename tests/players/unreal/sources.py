"""Compiles the Unreal plugin here: its engine layer against stubs, and the rest as a library that tests call.

`plugin` is the folder of the plugin, put together.
"""

from __future__ import annotations

import hashlib
import re
import subprocess
from pathlib import Path

from tests.session.native import BUILT, build

WRITTEN = Path(__file__).parents[3] / "players" / "unreal"
MODULE = "Source/GaussianAvatar"
EDITOR = "Source/GaussianAvatarEditor"
STUBS = Path(__file__).parent / "stubs"
OLDEST, NEWEST = 4, 8  # of UE 5
HEADERS = {  # headers of the engine that the plugin includes: the stub that stands for them
    "core": (
        "CoreGlobals CoreMinimal Features/IModularFeatures Interfaces/IPluginManager Logging/LogMacros "
        "Misc/App Misc/EngineVersionComparison Misc/FeedbackContext Misc/FileHelper Misc/Paths Modules/ModuleManager "
        "Serialization/Archive UObject/Object"
    ),
    "engine": (
        "ComponentReregisterContext Components/PrimitiveComponent Components/SceneComponent "
        "EditorFramework/AssetImportData Engine/World ILiveLinkClient LiveLinkTypes "
        "Roles/LiveLinkBasicRole Subsystems/WorldSubsystem"
    ),
    "render": (
        "CommonRenderResources DataDrivenShaderPlatformInfo FXRenderingUtils GlobalShader PipelineStateCache "
        "PixelShaderUtils PostProcess/PostProcessMaterialInputs RHICommandList RHIStaticStates "
        "RenderGraphBuilder RenderGraphResources RenderGraphUtils RenderingThread SceneView SceneViewExtension "
        "ScreenPass ShaderCore ShaderParameterStruct"
    ),
    "editor": "EditorReimportHandler Factories/Factory",
}
WARNINGS = ("-Wall", "-Wextra", "-Wno-unused-parameter", "-Wno-comma", "-Wno-unused-value", "-Werror")
_CLASS = re.compile(r"^class (?:\w+_API )?(\w+) : public (\w+)", re.MULTILINE)


def layer(plugin: Path) -> list[Path]:
    """Sources and headers of the layer over the engine that are written by hand."""
    folders = [f"{MODULE}/Public", f"{MODULE}/Private/Engine", f"{EDITOR}/Private"]
    files = [path for folder in folders for path in sorted((plugin / folder).iterdir())]
    return [path for path in files if "GaussianAvatarKernels" not in path.name]


def check_layer(plugin: Path, folder: Path, minor: int) -> str:
    """Compile the layer, and the made kernels, against the stubs as UE 5.`minor`. Returns what the compiler says."""
    _write_headers(plugin, folder)
    private = plugin / MODULE / "Private"
    kernels = private / "Engine/GaussianAvatarKernels.cpp"
    sources = [path for path in (*layer(plugin), kernels) if path.suffix == ".cpp"]
    whole = folder / f"whole_{minor}.cpp"  # one run of the compiler: it reads the stubs once
    whole.write_text("".join(f'#include "{path}"\n' for path in sources), "utf-8")
    includes = [folder, plugin / MODULE / "Public", private / "Engine", private / "Core"]
    includes += [private / "Native/include", plugin / EDITOR / "Private"]
    options = ["-std=c++20", "-fsyntax-only", "-fno-exceptions", "-fno-rtti", *WARNINGS]
    command = [
        "g++",
        *options,
        f"-DENGINE_MINOR_VERSION={minor}",
        *(f"-I{path}" for path in includes),
        str(whole),
    ]
    return subprocess.run(command, capture_output=True, text=True, check=False).stderr


def check_rest(plugin: Path, folder: Path) -> str:
    """Compile all that includes no header of the engine, as the module's build file says. Returns what is said."""
    module = plugin / MODULE
    rules = (module / "GaussianAvatar.Build.cs").read_text("utf-8")
    options = [f"-D{one}" for one in re.findall(r'PrivateDefinitions\.Add\("(.+?)"\)', rules)]
    options += [f"-I{module / one}" for one in re.findall(r'\(ModuleDirectory, "(.+?)"\)', rules)]
    parts = [
        path for name in ("Core", "Native") for path in sorted((module / "Private" / name).rglob("*.cpp"))
    ]
    whole = folder / "whole.cpp"
    whole.write_text("".join(f'#include "{path}"\n' for path in parts), "utf-8")
    command = ["g++", "-std=c++20", "-fsyntax-only", "-fno-exceptions", "-fno-rtti", *WARNINGS, *options]
    return subprocess.run([*command, str(whole)], capture_output=True, text=True, check=False).stderr


def _write_headers(plugin: Path, folder: Path) -> None:
    """Headers by the engine's names, and what Unreal Header Tool would make."""
    for stub, names in HEADERS.items():
        for name in names.split():
            path = folder / f"{name}.h"
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(f'#pragma once\n#include "{STUBS / stub}.h"\n', "utf-8")
    for path in layer(plugin):
        if path.suffix == ".h" and "GENERATED_BODY" in path.read_text("utf-8"):
            (folder / f"{path.stem}.generated.h").write_text(_generated(path), "utf-8")


def _generated(path: Path) -> str:
    text = path.read_text("utf-8")
    lines = [f"#undef CURRENT_FILE\n#define CURRENT_FILE {path.stem}_\n"]
    for found in _CLASS.finditer(text):
        body = text.find("GENERATED_BODY()", found.end())
        if body >= 0:
            line = text.count("\n", 0, body) + 1
            members = f"public: using Super = {found[2]}; static UClass* StaticClass(); private:"
            lines.append(f"#define {path.stem}_{line}_BODY {members}\n")
    return "".join(lines)


def library() -> Path:
    """The part of the plugin that knows no engine, with the native player and the probe, to be called by ctypes.

    From where it is written: programs are kept by the paths of their sources.
    """
    core = WRITTEN / MODULE / "Private/Core"
    parts = [*sorted(core.iterdir()), Path(__file__).parent / "probe.cpp"]
    digest = hashlib.sha256("".join(path.read_text("utf-8") for path in parts).encode()).hexdigest()
    text = f"// {digest}\n" + "".join(f'#include "{path}"\n' for path in parts if path.suffix == ".cpp")
    BUILT.mkdir(parents=True, exist_ok=True)
    unit = BUILT / f"unreal_{digest[:16]}.cpp"
    unit.write_text(text, "utf-8")
    return build("unreal_probe", [unit], ["-O0", "-fPIC", f"-I{core}"], ["-shared"])
