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
        assert match, asset
        assert match[1] not in found, f"{asset} has the identifier of {found.get(match[1])}"
        found[match[1]] = asset
    return found


def meta_of(asset: Path) -> Path:
    return asset.with_name(asset.name + ".meta")


def names(folder: Path, paths: Iterable[Path]) -> list[str]:
    return sorted(path.relative_to(folder).as_posix() for path in paths)


def manifest(package: Path) -> dict[str, Any]:
    document: dict[str, Any] = json.loads((package / "package.json").read_text("utf-8"))
    return document


def assemblies(package: Path) -> dict[Path, dict[str, Any]]:
    return {path: json.loads(path.read_text("utf-8")) for path in package.rglob("*.asmdef")}


def sources(folder: Path) -> list[Path]:
    return sorted(folder.rglob("*.cs"))


def without_text(source: str) -> str:
    """C# without comments, strings and characters."""
    return re.sub(
        r'//[^\n]*|/\*.*?\*/|@"(?:[^"]|"")*"|"(?:\\.|[^"\\\n])*"|\'(?:\\.|[^\'\\])*\'',
        " ",
        source,
        flags=re.S,
    )


def test_every_asset_has_a_meta_and_every_meta_an_asset(unity_package: Path) -> None:
    wanted = {meta_of(asset) for asset in assets(unity_package)}
    present = set(unity_package.rglob("*.meta"))
    assert len(wanted) > 100
    assert names(unity_package, wanted ^ present) == []


def test_identifiers_are_unique(unity_package: Path) -> None:
    assert len(metas(unity_package)) == len(list(assets(unity_package)))


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
        assert (unity_package / sample["path"]).is_dir()
    folders = {path.name for path in (unity_package / f"Samples{HIDDEN}").iterdir() if path.is_dir()}
    assert folders == {Path(sample["path"]).name for sample in document["samples"]}


def test_licence_and_notices_are_in_it(unity_package: Path) -> None:
    assert "Cesium" in (unity_package / "Third Party Notices.md").read_text("utf-8")
    assert (unity_package / "LICENSE.md").read_text("utf-8") == (ROOT / "LICENSE").read_text("utf-8")


def test_references_of_assemblies_resolve(unity_package: Path) -> None:
    found = assemblies(unity_package)
    own = {document["name"] for document in found.values()}
    assert len(own) == len(found)
    for path, document in found.items():
        unknown = set(document["references"]) - own - OPTIONAL
        assert not unknown, f"{path.name}: {unknown}"
        assert not document["allowUnsafeCode"], path.name
        if set(document["references"]) & {
            name for name in OPTIONAL if "RenderPipelines" in name or "XR" in name
        }:
            defined = {row["define"] for row in document["versionDefines"]}
            assert defined & set(document["defineConstraints"]), f"{path.name} compiles without its package"


def test_core_knows_no_engine(unity_package: Path) -> None:
    core = json.loads((unity_package / "Core" / "AvatarExport.Core.asmdef").read_text("utf-8"))
    assert core["noEngineReferences"] and core["references"] == []
    assert [
        path.name
        for path in sources(unity_package / "Core")
        if re.search(r"\bUnity(Engine|Editor)\b", path.read_text("utf-8"))
    ] == []


def test_nothing_is_unsafe_or_native(unity_package: Path) -> None:
    named = re.compile(r"\b(unsafe|stackalloc|DllImport|fixed|Marshal)\b")
    assert not [
        path for path in sources(unity_package) if named.search(without_text(path.read_text("utf-8")))
    ]
    libraries = {".dll", ".so", ".dylib", ".bundle", ".a", ".jar", ".aar"}
    assert not [path for path in unity_package.rglob("*") if path.suffix in libraries]


def test_words_in_comments_and_texts_are_no_code() -> None:
    assert "unsafe" not in without_text(
        'int a; // unsafe\nstring b = "unsafe \\" unsafe"; /* unsafe */ char c = \'"\'; // unsafe'
    )
    assert "unsafe" in without_text('string b = "x"; unsafe { }')


def scenes() -> list[Path]:
    return sorted((WRITTEN / f"Samples{HIDDEN}").rglob("*.unity"))


def test_each_sample_is_whole(unity_package: Path) -> None:
    for sample in manifest(unity_package)["samples"]:
        folder = unity_package / sample["path"]
        kinds = {path.suffix for path in folder.rglob("*") if path.is_file()}
        assert {".avatar", ".unity", ".cs", ".md"} <= kinds, folder.name


@pytest.mark.parametrize("scene", scenes(), ids=lambda path: path.stem)
def test_what_a_scene_points_at_is_there(unity_package: Path, scene: Path) -> None:
    """Objects of the file itself by number, scripts of the same sample or the package by identifier."""
    scene = unity_package / scene.relative_to(WRITTEN)
    text, known = scene.read_text("utf-8"), metas(unity_package)
    assert text.startswith("%YAML 1.1\n%TAG !u! tag:unity3d.com,2011:\n")
    objects = dict(re.findall(r"^--- !u!(\d+) &(\d+)$", text, re.MULTILINE)[::-1])
    numbers = re.findall(r"^--- !u!\d+ &(\d+)$", text, re.MULTILINE)
    assert len(numbers) == len(set(numbers)) and len(objects) >= 5
    for number in re.findall(r"\{fileID: (\d+)\}", text):
        assert number == "0" or number in numbers, number
    scripts = re.findall(r"m_Script: \{fileID: (\d+), guid: ([0-9a-f]{32}), type: 3\}", text)
    assert scripts
    for number, guid in scripts:
        assert number == SCRIPT and known[guid].suffix == ".cs"
        sample = scene.relative_to(unity_package).parts[1]
        assert known[guid].is_relative_to(unity_package / "Runtime") or sample in known[guid].parts, known[
            guid
        ]
        assert re.search(rf"\bclass {known[guid].stem}\b", known[guid].read_text("utf-8"))
    for guid in GUID.findall(text):
        assert guid in known or guid.startswith(BUILT_IN), guid


def test_npm_packs_it(unity_package: Path, tmp_path: Path) -> None:
    """`npm pack` runs no script and asks nobody; the archive has all files."""
    npm = shutil.which("npm")
    assert npm, "npm is needed"
    command = [
        npm,
        "pack",
        str(unity_package),
        "--ignore-scripts",
        "--offline",
        "--silent",
        "--pack-destination",
        str(tmp_path),
    ]
    done = subprocess.run(command, capture_output=True, text=True, cwd=tmp_path, check=False)
    assert done.returncode == 0, done.stderr[-2000:]
    with tarfile.open(next(tmp_path.glob("*.tgz"))) as archive:
        packed = sorted(name.removeprefix("package/") for name in archive.getnames())
    assert packed == names(unity_package, (path for path in unity_package.rglob("*") if path.is_file()))
