"""The engine layer of the Unity player: it compiles against stubs of Unity, and records what the core asks for.

The stubs have Unity's signatures, as far as `Documentation~/unity_api.md` lists them. They show nothing of the engine.
"""

from __future__ import annotations

import json
import os
import re
import subprocess
from pathlib import Path

import pytest

from tests.players.unity import (
    PACKAGES,
    STUBS,
    UNITY,
    compile_csharp,
    core_sources,
    run_tests,
    runtime_sources,
    sources,
)
from tests.session.shared_folder import made_once

RUNTIME = UNITY / "Runtime"
TESTS = UNITY / "Tests" / "Runtime"
RECORDED = Path(__file__).parent / "unity_runtime"
RELEASES = {  # of Unity: the symbols that it defines
    "2022.3": (),
    "6000.0": ("UNITY_6000_0_OR_NEWER",),
    "6000.3": ("UNITY_6000_0_OR_NEWER", "UNITY_6000_3_OR_NEWER"),
}
API = UNITY / "Documentation~" / "unity_api.md"
# The one-word names of UnityEngine, UnityEngine.UIElements and System that a user's file may see beside ours.
TAKEN = {
    "UnityEngine": """
        Animation Animator Application Avatar Awaitable Behaviour Bounds Cache Caching Camera Canvas
        Cloth Collider Collision Color Component Coroutine Cubemap Cursor Debug Display Event Flare Font
        Gizmos Gradient Graphics Grid Gyroscope Handheld Joint Keyframe Light Logger Material Mathf Mesh
        Microphone Motion Object Physics Ping Plane Pose Projector Quaternion Random Ray Rect Renderer
        Resolution Resources Rigidbody Screen Security Shader Skybox Snapping Social Space Sprite
        Subsystem Terrain Texture Time Touch Transform Tree
    """,
    "UnityEngine.UIElements": """
        Align Angle Background Binding Box Button Clickable Column Columns Focusable Foldout Group Image
        Justify Label Length Manipulator Overflow Pivot Position Ratio Repeat Rotate Scale Scroller
        Slider Tab Toggle Translate Vertex Visibility Wrap
    """,
    "System": "Index Range",
}
USED = """System System.Collections.Generic System.IO System.Linq System.Threading.Tasks UnityEngine
    UnityEngine.Rendering UnityEngine.UIElements AvatarExport AvatarExport.Core"""


def defined(*symbols: str) -> tuple[str, ...]:
    return (f"-define:{';'.join(symbols)}",) if symbols else ()


def linked(*libraries: Path) -> tuple[str, ...]:
    return tuple(f"-r:{library}" for library in libraries)


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the stubs of the engine, the core, the runtime, the program of its tests and Members.exe."""

    def make(folder: Path) -> Path:
        told = f"-doc:{folder / 'core.xml'}"  # a public name without a comment is a warning
        core = compile_csharp(core_sources(), folder / "AvatarExport.Core.dll", told)
        engine = compile_csharp(sources(STUBS / "engine"), folder / "UnityEngine.dll")
        options = (*linked(core, engine), *defined("AVATAR_VR"))
        runtime = compile_csharp(runtime_sources(), folder / "AvatarExport.dll", *options)
        tests = [*sources(TESTS, STUBS / "mono"), *sorted(RECORDED.glob("*.cs"))]
        compile_csharp(tests, folder / "AvatarExport.Tests.Runtime.exe", *linked(core, engine, runtime))
        compile_csharp(sources(RECORDED / "members"), folder / "Members.exe")
        return folder

    return made_once(tmp_path_factory, "unity_runtime", make)


def members(built: Path, *libraries: Path) -> set[tuple[str, str]]:
    """(type, member) of what is public in libraries."""
    command = ["mono", str(built / "Members.exe"), *map(str, libraries)]
    environment = {**os.environ, "MONO_PATH": str(built)}
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=True)
    return {(name, member) for name, member in (line.split("\t") for line in done.stdout.splitlines())}


def test_all_tests_of_the_runtime_run(built: Path) -> None:
    printed = run_tests(built / "AvatarExport.Tests.Runtime.exe", AVATAR_TESTS=str(UNITY / "Tests"))
    ran = {line.split(" ")[1].split(".")[0] for line in printed.splitlines()[:-1]}
    assert ran == {path.stem for folder in (TESTS, RECORDED) for path in folder.glob("*Tests.cs")}


def test_no_type_has_a_name_of_unitys(built: Path, tmp_path: Path) -> None:
    """A user's file that uses both names each of our types as it is."""
    libraries = [built / f"{name}.dll" for name in ("AvatarExport.Core", "AvatarExport", "UnityEngine")]
    ours = {
        name.split(".")[-1] for name, _ in members(built, *libraries[:2]) if name.startswith("AvatarExport.")
    }
    assert len(ours) > 60
    here = {name for name, _ in members(built, libraries[2])}
    lines = []
    for space, names in TAKEN.items():
        missing = (f"public class {n} {{ }}" for n in names.split() if f"{space}.{n}" not in here)
        lines.append(f"namespace {space} {{ {' '.join(missing)} }}")
    (tmp_path / "Taken.cs").write_text("\n".join(lines), "utf-8")
    lines = [f"using {space};" for space in USED.split()]
    all_types = ", ".join(f"typeof({name})" for name in sorted(ours))
    lines.append(f"public class User {{ public static Type[] All = {{ {all_types} }}; }}")
    (tmp_path / "User.cs").write_text("\n".join(lines), "utf-8")
    compile_csharp([tmp_path / "Taken.cs", tmp_path / "User.cs"], tmp_path / "User.dll", *linked(*libraries))


def compile_packages(built: Path, folder: Path) -> Path:
    """The runtime's assemblies for other packages in `folder`, each alone. Returns the stubs of these packages."""
    core, engine, runtime = (
        built / f"{name}.dll" for name in ("AvatarExport.Core", "UnityEngine", "AvatarExport")
    )
    symbols = defined(*RELEASES["6000.0"])
    packages = compile_csharp(sources(STUBS / "packages"), folder / "Packages.dll", *linked(engine), *symbols)
    for name in PACKAGES:
        libraries = linked(core, engine, packages, runtime)
        compile_csharp(sources(RUNTIME / name), folder / f"AvatarExport.{name}.dll", *libraries, *symbols)
    return packages


@pytest.mark.parametrize(("release", "symbols"), [("2022.3", ("UNITY_EDITOR",)), ("6000.3", ())])
def test_all_sources_compile_for_each_unity(
    built: Path, tmp_path: Path, release: str, symbols: tuple[str, ...]
) -> None:
    """With and without the editor and the VR module; `built` has the module and no editor."""
    libraries = linked(built / "AvatarExport.Core.dll", built / "UnityEngine.dll")
    every = sources(RUNTIME, STUBS / "packages")
    compile_csharp(every, tmp_path / "AvatarExport.dll", *libraries, *defined(*RELEASES[release], *symbols))


@pytest.mark.parametrize("name", PACKAGES)
def test_assemblies_of_packages_are_whole(name: str) -> None:
    """References, the package that each waits for, and what Unity's linker would leave out."""
    path = RUNTIME / name / f"AvatarExport.{name}.asmdef"
    asmdef = json.loads(path.read_text("utf-8"))
    text = "".join(path.read_text("utf-8") for path in sources(RUNTIME / name))
    assert "AvatarExport" in asmdef["references"]
    assert asmdef["defineConstraints"] == [one["define"] for one in asmdef["versionDefines"]]
    assert ("using AvatarExport.Core;" in text) == ("AvatarExport.Core" in asmdef["references"])
    kept = "[assembly: UnityEngine.Scripting.AlwaysLinkAssembly]" in text
    assert kept == ("[RuntimeInitializeOnLoadMethod" in text)
    if (
        name == "ARFoundation"
    ):  # ARKit's assemblies exist in the Editor and on iOS: elsewhere ours would not compile
        assert asmdef["includePlatforms"] == ["Editor", "iOS"]
        assert {"Unity.XR.ARKit", "Unity.XR.ARKit.FaceTracking"} <= set(asmdef["references"])


def listed() -> set[tuple[str, str]]:
    """(type, member) of the table of Unity's API."""
    rows = re.findall(r"^\| `([\w.]+)` \| (.+?) \|", API.read_text("utf-8"), re.MULTILINE)
    return {(name, member) for name, members in rows for member in re.findall(r"`([^`]+)`", members)}


def test_the_table_of_unitys_api_lists_what_the_stubs_have(built: Path, tmp_path: Path) -> None:
    """All that is compiled here compiles against the stubs, so it uses nothing that is not in the table."""
    engine = compile_csharp(sources(STUBS / "engine", STUBS / "editor"), tmp_path / "WithEditor.dll")
    wanted = members(built, engine, compile_packages(built, tmp_path))
    types = {name for name, _ in wanted}
    assert {row for row in listed() if row[0] in types} == wanted
