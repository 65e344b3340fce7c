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

from tests.players.unity import LIMIT_S, STUBS, UNITY, compile_csharp, core_sources
from tests.session.shared_folder import made_once

RUNTIME = UNITY / "Runtime"
TESTS = UNITY / "Tests" / "Runtime"
RECORDED = Path(__file__).parent / "unity_runtime"
PACKAGES = ("Universal", "HighDefinition", "ARFoundation")  # folders that are assemblies for other packages
RELEASES = {  # of Unity: the symbols that it defines
    "2022.3": (),
    "6000.0": ("UNITY_6000_0_OR_NEWER",),
    "6000.3": ("UNITY_6000_0_OR_NEWER", "UNITY_6000_3_OR_NEWER"),
}
FIXTURES = sorted(path.stem for folder in (TESTS, RECORDED) for path in folder.glob("*Tests.cs"))
API = UNITY / "Documentation~" / "unity_api.md"


def sources(folder: Path) -> list[Path]:
    return sorted(folder.rglob("*.cs"))


def runtime_sources() -> list[Path]:
    return [path for path in sources(RUNTIME) if path.relative_to(RUNTIME).parts[0] not in PACKAGES]


def defined(*symbols: str) -> tuple[str, ...]:
    return (f"-define:{';'.join(symbols)}",) if symbols else ()


def linked(*libraries: Path) -> tuple[str, ...]:
    return tuple(f"-r:{library}" for library in libraries)


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the stubs of the engine, the core, the runtime and the program of its tests."""

    def make(folder: Path) -> Path:
        core, engine, runtime = (
            folder / f"{name}.dll" for name in ("AvatarExport.Core", "UnityEngine", "AvatarExport")
        )
        compile_csharp(core_sources(), core)
        compile_csharp(sources(STUBS / "engine"), engine)
        compile_csharp(runtime_sources(), runtime, *linked(core, engine), *defined("AVATAR_VR"))
        tests = [*sources(TESTS), *sorted(RECORDED.glob("*.cs")), *sources(STUBS / "mono")]
        compile_csharp(tests, folder / "AvatarExport.Tests.Runtime.exe", *linked(core, engine, runtime))
        return folder

    return made_once(tmp_path_factory, "unity_runtime", make)


def test_all_tests_of_the_runtime_run(built: Path) -> None:
    done = subprocess.run(
        ["mono", str(built / "AvatarExport.Tests.Runtime.exe")],
        env={**os.environ, "AVATAR_TESTS": str(UNITY / "Tests")},
        capture_output=True,
        text=True,
        timeout=LIMIT_S,
        check=False,
    )
    lines = done.stdout.splitlines()
    assert done.returncode == 0, "\n".join(line for line in lines if not line.startswith("ok "))[:5000]
    assert " 0 ignored" in lines[-1], lines
    assert {line.split(" ")[1].split(".")[0] for line in lines[:-1]} == set(FIXTURES)


def compile_packages(built: Path, folder: Path) -> Path:
    """The runtime's assemblies for other packages in `folder`, each alone. Returns the stubs of these packages."""
    core, engine, packages, runtime = (
        built / "AvatarExport.Core.dll",
        built / "UnityEngine.dll",
        folder / "Packages.dll",
        built / "AvatarExport.dll",
    )
    symbols = defined(*RELEASES["6000.0"])
    compile_csharp(sources(STUBS / "packages"), packages, *linked(engine), *symbols)
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
    every = [*sources(RUNTIME), *sources(STUBS / "packages")]
    compile_csharp(every, tmp_path / "All.dll", *libraries, *defined(*RELEASES[release], *symbols))


def test_assemblies_refer_to_what_they_use() -> None:
    """References, and the package that each optional assembly waits for."""
    found = {path.stem: json.loads(path.read_text("utf-8")) for path in RUNTIME.rglob("*.asmdef")}
    assert found["AvatarExport"]["references"] == ["AvatarExport.Core"]
    for name in PACKAGES:
        asmdef = found[f"AvatarExport.{name}"]
        assert "AvatarExport" in asmdef["references"]
        assert asmdef["defineConstraints"] == [one["define"] for one in asmdef["versionDefines"]]
        uses_core = any("Core." in path.read_text("utf-8") for path in sources(RUNTIME / name))
        assert uses_core == ("AvatarExport.Core" in asmdef["references"]), name


def test_assemblies_are_where_their_packages_are() -> None:
    """ARKit's assemblies exist in the Editor and on iOS: elsewhere ours would not compile."""
    asmdef = json.loads((RUNTIME / "ARFoundation" / "AvatarExport.ARFoundation.asmdef").read_text("utf-8"))
    assert asmdef["includePlatforms"] == ["Editor", "iOS"]
    assert {"Unity.XR.ARKit", "Unity.XR.ARKit.FaceTracking"} <= set(asmdef["references"])


@pytest.mark.parametrize("name", PACKAGES)
def test_builds_keep_assemblies_that_nothing_refers_to(name: str) -> None:
    """Unity's linker leaves them out else, and their methods that Unity starts."""
    text = "".join(path.read_text("utf-8") for path in sources(RUNTIME / name))
    kept = "[assembly: UnityEngine.Scripting.AlwaysLinkAssembly]" in text
    assert kept == ("[RuntimeInitializeOnLoadMethod" in text)


def listed() -> set[tuple[str, str]]:
    """(type, member) of the table of Unity's API."""
    rows = re.findall(r"^\| `([\w.]+)` \| (.+?) \|", API.read_text("utf-8"), re.MULTILINE)
    return {(name, member) for name, members in rows for member in re.findall(r"`([^`]+)`", members)}


def test_the_table_of_unitys_api_lists_what_the_stubs_have(built: Path, tmp_path: Path) -> None:
    """All that is compiled here compiles against the stubs, so it uses nothing that is not in the table."""
    program, engine = tmp_path / "Members.exe", tmp_path / "WithEditor.dll"
    compile_csharp(sources(RECORDED / "members"), program)
    compile_csharp([*sources(STUBS / "engine"), *sources(STUBS / "editor")], engine)
    stubs = [engine, compile_packages(built, tmp_path)]
    done = subprocess.run(
        ["mono", str(program), *map(str, stubs)],
        env={**os.environ, "MONO_PATH": str(built)},
        capture_output=True,
        text=True,
        check=True,
    )
    wanted = {(name, member) for name, member in (line.split("\t") for line in done.stdout.splitlines())}
    types = {name for name, _ in wanted}
    assert {row for row in listed() if row[0] in types} == wanted
