"""The Unity package is laid out as Unity and npm want it: identifiers, references, scenes, licences."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
import tarfile
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

import pytest

from avatar_schema.version import __version__

ROOT = Path(__file__).parents[2]
WRITTEN = ROOT / "players" / "unity"  # by hand; the package is put together from it
HIDDEN = "~"  # Unity imports no folder whose name ends so; a sample is copied into Assets and imported there
GUID = re.compile(r"\bguid: ([0-9a-f]{32})\b")
BUILT_IN = "0000000000000000"  # how the identifiers of Unity's own resources begin
SCRIPT = "11500000"  # fileID of the class in a file of C#
OPTIONAL = {  # assemblies of packages that a project may lack; a version define turns our assembly off
    "Unity.RenderPipelines.Core.Runtime",
    "Unity.RenderPipelines.Universal.Runtime",
    "Unity.RenderPipelines.HighDefinition.Runtime",
    "Unity.XR.ARFoundation",
    "Unity.XR.ARKit",
    "Unity.XR.ARKit.FaceTracking",
    "Unity.XR.ARSubsystems",
    "UnityEngine.TestRunner",
    "UnityEditor.TestRunner",
}


def assets(folder: Path) -> Iterator[Path]:
    """Files and folders that Unity sees as assets, those of samples too, each once."""
    for path in sorted(folder.iterdir()):
        if path.suffix == ".meta" or path.name.startswith("."):
            continue
        if not path.name.endswith(HIDDEN):
            yield path
        if path.is_dir() and path.name != f"Documentation{HIDDEN}":
            yield from assets(path)


def metas(package: Path) -> dict[str, Path]:
    """Identifier -> asset."""
    found: dict[str, Path] = {}
    for asset in assets(package):
        match = GUID.search(meta_of(asset).read_text("utf-8"))
        assert match and match[1] not in found, asset
        found[match[1]] = asset
    return found


def meta_of(asset: Path) -> Path:
    return asset.with_name(asset.name + ".meta")


def names(folder: Path, paths: Iterable[Path]) -> list[str]:
    return sorted(path.relative_to(folder).as_posix() for path in paths)


def manifest(package: Path) -> dict[str, Any]:
    document: dict[str, Any] = json.loads((package / "package.json").read_text("utf-8"))
    return document


def test_every_asset_has_a_meta_and_every_meta_an_asset(unity_package: Path) -> None:
    wanted = {meta_of(asset) for asset in metas(unity_package).values()}
    assert len(wanted) > 100
    assert names(unity_package, wanted ^ set(unity_package.rglob("*.meta"))) == []


def test_the_manifest_is_one_that_unity_reads(unity_package: Path) -> None:
    document = manifest(unity_package)
    assert list(document)[:2] == ["name", "version"] and document["version"] == __version__
    assert re.fullmatch(r"[a-z0-9-]+(\.[a-z0-9-]+){2,}", document["name"]) and len(document["name"]) <= 50
    assert re.fullmatch(r"\d+\.\d+\.\d+(-[\w.-]+)?", document["version"])
    assert re.fullmatch(r"\d{4}\.\d+", document["unity"]) and re.fullmatch(
        r"\d+[abf]\d+", document["unityRelease"]
    )
    assert all(name.startswith("com.unity.") for name in document["dependencies"])
    assert f"## [{document['version']}]" in (unity_package / "CHANGELOG.md").read_text("utf-8")
    for sample in document["samples"]:
        assert set(sample) == {"displayName", "description", "path"}
        kinds = {path.suffix for path in (unity_package / sample["path"]).rglob("*") if path.is_file()}
        assert {".avatar", ".unity", ".cs", ".md"} <= kinds, sample["path"]
    folders = {path.name for path in (unity_package / f"Samples{HIDDEN}").iterdir() if path.is_dir()}
    assert folders == {Path(sample["path"]).name for sample in document["samples"]}


def test_references_of_assemblies_resolve_and_the_core_knows_no_engine(unity_package: Path) -> None:
    found = {path: json.loads(path.read_text("utf-8")) for path in unity_package.rglob("*.asmdef")}
    own = {document["name"] for document in found.values()}
    assert len(own) == len(found)
    for path, document in found.items():
        unknown = set(document["references"]) - own - OPTIONAL
        assert not unknown, f"{path.name}: {unknown}"
        assert not document["allowUnsafeCode"], path.name
        if any("RenderPipelines" in name or "XR" in name for name in {*document["references"]} & OPTIONAL):
            defined = {row["define"] for row in document["versionDefines"]}
            assert defined & set(document["defineConstraints"]), f"{path.name} compiles without its package"
    core = found[unity_package / "Core" / "AvatarExport.Core.asmdef"]
    assert core["noEngineReferences"] and core["references"] == []


def scenes() -> list[Path]:
    return sorted((WRITTEN / f"Samples{HIDDEN}").rglob("*.unity"))


@pytest.mark.parametrize("scene", scenes(), ids=lambda path: path.stem)
def test_what_a_scene_points_at_is_there(unity_package: Path, scene: Path) -> None:
    """Objects of the file itself by number, scripts of the same sample or the package by identifier."""
    scene = unity_package / scene.relative_to(WRITTEN)
    text, known = scene.read_text("utf-8"), metas(unity_package)
    assert text.startswith("%YAML 1.1\n%TAG !u! tag:unity3d.com,2011:\n")
    numbers = re.findall(r"^--- !u!\d+ &(\d+)$", text, re.MULTILINE)
    assert len(numbers) == len(set(numbers)) >= 5
    for number in re.findall(r"\{fileID: (\d+)\}", text):
        assert number == "0" or number in numbers, number
    scripts = re.findall(r"m_Script: \{fileID: (\d+), guid: ([0-9a-f]{32}), type: 3\}", text)
    assert scripts
    for number, guid in scripts:
        script, sample = known[guid], scene.relative_to(unity_package).parts[1]
        assert number == SCRIPT and script.suffix == ".cs"
        assert script.is_relative_to(unity_package / "Runtime") or sample in script.parts, script
        assert re.search(rf"\bclass {script.stem}\b", script.read_text("utf-8"))
    for guid in GUID.findall(text):
        assert guid in known or guid.startswith(BUILT_IN), guid


def test_npm_packs_it(unity_package: Path, tmp_path: Path) -> None:
    """`npm pack` runs no script and asks nobody; the archive has all files."""
    npm = shutil.which("npm")
    assert npm, "npm is needed"
    flags = ("--ignore-scripts", "--offline", "--silent", "--pack-destination", str(tmp_path))
    command = [npm, "pack", str(unity_package), *flags]
    done = subprocess.run(command, capture_output=True, text=True, cwd=tmp_path, check=False)
    assert done.returncode == 0, done.stderr[-2000:]
    with tarfile.open(next(tmp_path.glob("*.tgz"))) as archive:
        packed = sorted(name.removeprefix("package/") for name in archive.getnames())
    assert packed == names(unity_package, (path for path in unity_package.rglob("*") if path.is_file()))
