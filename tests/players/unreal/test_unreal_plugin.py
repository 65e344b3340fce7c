"""The Unreal plugin is whole: its layer over the engine compiles against stubs, and its parts name each other rightly.

The stubs have the signatures that players/unreal/Docs/unreal_api.md names. This tests our text, not the engine.
"""

from __future__ import annotations

import json
import re
from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path

import pytest

from avatar_export.players.unreal import described
from avatar_schema.version import __version__
from avatar_shaders.entries import ENTRIES, HLSL_ONLY
from tests.players.unreal.sources import (
    HEADERS,
    MODULE,
    NEWEST,
    OLDEST,
    STUBS,
    WRITTEN,
    check_layer,
    check_rest,
    layer,
)
from tests.session.native import NATIVE

MOST_LINES = 1000  # of the layer over the engine, without what is made
TABLE = WRITTEN / "Docs" / "unreal_api.md"
ROW = re.compile(r"^\| `([^`]+)` \| ([^|]+) \| `([^`]+)` \| ([^|]+) \| ([^|]+) \|$", re.MULTILINE)
NAME = re.compile(r"\b[A-Za-z_]\w*")
OWN = re.compile(r"(?i:GaussianAvatar)|^(FAvatar|Avatar|AVATAR_|avatar_)")
IN_EVERY_FILE = {
    *("CoreMinimal.h", "UObject/Object.h"),  # each header of the engine includes them
    "Components/SceneComponent.h",  # that of UPrimitiveComponent includes its base
    "Engine/World.h",  # a pointer needs none
}
PARAMETERS = {  # names of arguments alone
    *("Name", "Parameters", "Command", "Pass", "Flags", "Filename", "Parms", "Warn"),
    *("DeltaTime", "TickType", "LocalToWorld", "InWorld", "OutFilenames", "NewReimportPaths", "WorldType"),
    "Type",  # of many enums
}


def without_text(source: str) -> str:
    """C++ without comments and strings."""
    return re.sub(r'//[^\n]*|/\*.*?\*/|"(?:\\.|[^"\\\n])*"', " ", source, flags=re.DOTALL)


def words_of(paths: list[Path]) -> set[str]:
    return {word for path in paths for word in NAME.findall(without_text(path.read_text("utf-8")))}


def table() -> list[tuple[str, set[str], str]]:
    """(type or function, that and the names with it, header)."""
    rows = ROW.findall(TABLE.read_text("utf-8"))
    assert all(found.strip() for *_, found in rows)
    return [
        (name, {*NAME.findall(name), *NAME.findall(members)}, header) for name, members, header, *_ in rows
    ]


def kernels(plugin: Path, kind: str) -> Path:
    return plugin / MODULE / f"Private/Engine/GaussianAvatarKernels.{kind}"


def test_the_layer_compiles_against_the_stubs_of_each_release(unreal_plugin: Path, tmp_path: Path) -> None:
    releases = (OLDEST, OLDEST + 1, NEWEST)
    folders = [tmp_path / str(minor) for minor in releases]
    with ThreadPoolExecutor(2) as pool:
        said = list(pool.map(partial(check_layer, unreal_plugin), folders, releases))
    assert said == ["", "", ""], said[0][:3000] or said[1][:3000] or said[2][:3000]


def test_the_layer_is_thin() -> None:
    assert sum(len(path.read_text("utf-8").splitlines()) for path in layer(WRITTEN)) < MOST_LINES


def test_the_rest_includes_no_header_of_the_engine(unreal_plugin: Path) -> None:
    private = unreal_plugin / MODULE / "Private"
    own = [path for name in ("Core", "Native") for path in (private / name).rglob("*.*")]
    names = {path.name for path in own} | {
        "avatar_shader_texts.inc"
    }  # which AVATAR_NO_SHADER_TEXTS leaves out
    for path in own:
        for header in re.findall(r'#include "(.+?)"', path.read_text("utf-8")):
            assert Path(header).name in names, f"{path.name} includes {header}"


def test_every_name_of_the_engine_stands_in_the_table_with_its_source(unreal_plugin: Path) -> None:
    rows = table()
    assert len({name for name, *_ in rows}) == len(rows) > 50
    named = {word for _, words, _ in rows for word in words}
    stubs = words_of(sorted(STUBS.glob("*.h")))
    used = words_of([*layer(WRITTEN), *(kernels(unreal_plugin, kind) for kind in ("h", "cpp"))])
    assert not sorted(named - stubs), "in the table, not in the stubs"
    assert not sorted(named - used), "in the table, not used"
    assert {header for *_, header in rows} <= {
        f"{name}.h" for names in HEADERS.values() for name in names.split()
    }
    engines = {word for word in used & stubs if len(word) > 1 and word[0].isupper() and not OWN.search(word)}
    assert not sorted(engines - named - PARAMETERS), "used, and not in the table"


def test_no_two_sources_of_a_module_have_one_name(unreal_plugin: Path) -> None:
    """Unreal's build puts the objects of a module into one folder."""
    for module in (unreal_plugin / "Source").iterdir():
        names = Counter(path.name for path in module.rglob("*.cpp"))
        assert [name for name, count in names.items() if count > 1] == []


def test_the_rest_compiles_as_the_build_file_says(unreal_plugin: Path, tmp_path: Path) -> None:
    assert check_rest(unreal_plugin, tmp_path) == ""


def test_its_core_is_the_native_player(unreal_plugin: Path) -> None:
    core = unreal_plugin / MODULE / "Private/Native"
    copied = {path.relative_to(core): path.read_bytes() for path in core.rglob("*.*")}
    own = [path for name in ("include", "src") for path in (NATIVE / name).rglob("*.*")]
    assert copied == {path.relative_to(NATIVE): path.read_bytes() for path in own} and len(own) > 80


@pytest.mark.parametrize("entry", [name for name, row in ENTRIES.items() if row.kind == "compute"])
def test_kernels_have_the_parameters_of_their_texts(unreal_plugin: Path, entry: str) -> None:
    """Names and types are those that the .usf file declares. A member begins at a multiple of its size."""
    (told,) = re.findall(
        rf"/\*\* Entry {entry}\. \*/\n.*?BEGIN_SHADER_PARAMETER_STRUCT\(.*?\)\n(.*?)\tEND_",
        kernels(unreal_plugin, "h").read_text("utf-8"),
        re.DOTALL,
    )
    text = shader(unreal_plugin, entry)
    (block,) = re.findall(r"AVATAR_CONSTANTS\(\w+\)(.*?)AVATAR_CONSTANTS_END", text, re.DOTALL)
    cpp = {"uint": "uint32", "float": "float", **{f"float{n}": f"FVector{n}f" for n in (2, 3, 4)}}
    offset, declared, places = 0, [], []
    for kind, name in re.findall(r"(\w+) (\w+);", block):
        size = 4 * int(kind[-1]) if kind[-1].isdigit() else 4
        offset = -(-offset // size) * size
        declared.append((cpp[kind], name))
        places.append((name, str(offset), str(size)))
        offset += size
    assert re.findall(r"SHADER_PARAMETER\((\w+), (\w+)\)", told) == declared and declared
    buffers = set(re.findall(r"(RWStructuredBuffer<\w+>|StructuredBuffer<\w+>), (\w+)\)", told))
    assert buffers == set(re.findall(r"\b(RWStructuredBuffer<\w+>|StructuredBuffer<\w+>) (\w+);", text))
    code = kernels(unreal_plugin, "cpp").read_text("utf-8")
    own = code[code.index(f"void Add{kernel_name(entry)}(") :].split("\n}\n", 1)[0]
    assert re.findall(r"memcpy\(&Parameters->(\w+), Block \+ (\d+), (\d+)\)", own) == places


def shader(plugin: Path, entry: str) -> str:
    """The text that has an entry, with the buffer that platform.hlsli declares."""
    text = without_text((plugin / "Shaders" / f"{Path(ENTRIES[entry].hlsl).stem}.ush").read_text("utf-8"))
    return re.sub(r"AVATAR_LEAST_BUFFER\((\w+)\);", r"RWStructuredBuffer<uint> \1;", text)


def kernel_name(entry: str) -> str:
    return "Avatar" + entry.replace("_", " ").title().replace(" ", "")


def test_every_shader_that_a_class_names_exists(unreal_plugin: Path) -> None:
    sources = "".join(
        path.read_text("utf-8") for path in (*layer(unreal_plugin), kernels(unreal_plugin, "cpp"))
    )
    head = r'IMPLEMENT_GLOBAL_SHADER\(\w+, "/Plugin/GaussianAvatar/(.+?)", "(\w+)"'
    named = re.findall(head, sources)
    assert len(named) == 19 + 2 + 2 and {entry for _, entry in named} - set(ENTRIES | HLSL_ONLY) == set(DRAWN)
    for file, entry in named:
        path = unreal_plugin / "Shaders" / file
        texts = [one.read_text("utf-8") for one in (path, path.with_suffix(".ush")) if one.is_file()]
        assert re.search(rf"\b{entry}\(", "".join(texts))


DRAWN = {  # what each entry of unreal_draw.usf reads, seen by eye
    "unreal_depth_pixel": {"scene_depth", "depth_min", "depth_per_pixel"},
    "unreal_composite_pixel": {"scene_colour", "output_min", "colour_min"}
    | {"Accumulated", "background", "linear_target", "flip_rows", "image_size"},
}
ZERO = {"background", "linear_target", "flip_rows"}  # as a new parameter struct has them


@pytest.mark.parametrize("entry", DRAWN)
def test_loose_parameters_of_the_drawing_shaders_are_given(unreal_plugin: Path, entry: str) -> None:
    code = kernels(unreal_plugin, "h").read_text("utf-8")
    (told,) = re.findall(rf"/\*\* Entry {entry}\. \*/\n(.*?)END_SHADER_PARAMETER_STRUCT", code, re.DOTALL)
    assert set(re.findall(r"SHADER_PARAMETER\w*\(\w+, (\w+)\)", told)) == DRAWN[entry]
    assert told.rstrip().endswith("RENDER_TARGET_BINDING_SLOTS()")
    draw = (unreal_plugin / MODULE / "Private/Engine/GaussianAvatarDraw.cpp").read_text("utf-8")
    own = draw[draw.index(f"F{kernel_name(entry)}::FParameters* Parameters") :].split("\n}\n", 1)[0]
    assert set(re.findall(r"Parameters->(\w+) =", own)) == DRAWN[entry] - ZERO


def test_what_files_use_of_the_engine_they_include(unreal_plugin: Path) -> None:
    """By the table: through headers of the plugin too, but not by what the engine's headers happen to include."""
    headers = {word: header for name, _, header in table() for word in [name.split("::")[-1]]}
    made = [kernels(unreal_plugin, kind) for kind in ("h", "cpp")]
    own = {path.name: path for path in (*layer(WRITTEN), *made)}

    def included(path: Path) -> set[str]:
        found = set(re.findall(r'#include "(.+?)"', path.read_text("utf-8")))
        return found.union(*(included(own[name]) for name in found if name in own))

    missing = {
        f"{path.name}: {word} of {headers[word]}"
        for path in own.values()
        if path.suffix == ".cpp"  # headers may declare classes ahead
        for word in words_of([path]) & headers.keys()
        if headers[word] not in included(path) | IN_EVERY_FILE
    }
    assert not missing, sorted(missing)


def test_the_plugin_names_its_modules_and_their_modules_exist(unreal_plugin: Path) -> None:
    plugin = json.loads((unreal_plugin / "GaussianAvatar.uplugin").read_text("utf-8"))
    modules = {one["Name"]: one for one in plugin["Modules"]}
    sources = unreal_plugin / "Source"
    assert {path.name for path in sources.iterdir()} == modules.keys()
    assert modules["GaussianAvatar"]["LoadingPhase"] == "PostConfigInit"  # before shaders are compiled
    for name in modules:
        rules = (sources / name / f"{name}.Build.cs").read_text("utf-8")
        assert f"public class {name} : ModuleRules" in rules
        implemented = re.compile(rf"IMPLEMENT_MODULE\(\w+, {name}\)")
        assert any(implemented.search(path.read_text("utf-8")) for path in (sources / name).rglob("*.cpp"))
    rules = (sources / "GaussianAvatar/GaussianAvatar.Build.cs").read_text("utf-8")
    assert (
        "FPSemantics = FPSemanticsMode.Precise;" in rules
    )  # Unreal's own default assumes that there is no NaN
    for folder in re.findall(r'Path\.Combine\(ModuleDirectory, "(.+?)"\)', rules):
        assert (sources / "GaussianAvatar" / folder).is_dir()


def test_the_plugin_says_who_made_it_and_which_version_it_is(unreal_plugin: Path) -> None:
    plugin = json.loads((unreal_plugin / "GaussianAvatar.uplugin").read_text("utf-8"))
    assert list(plugin)[:3] == ["FileVersion", "Version", "VersionName"]
    assert plugin["VersionName"] == __version__ and plugin["CreatedBy"] and "DocsURL" in plugin
    assert (unreal_plugin / "LICENSE").read_bytes() == (WRITTEN.parents[1] / "LICENSE").read_bytes()


def test_a_later_version_is_a_larger_number() -> None:
    """Unreal compares the number, people read the name."""
    numbers = [json.loads(described("{}", of))["Version"] for of in ("0.1.0", "0.1.12", "0.2.0rc1", "1.0.0")]
    assert numbers == sorted(set(numbers))
