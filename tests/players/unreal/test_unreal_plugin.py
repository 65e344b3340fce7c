"""The Unreal plugin is whole: its layer over the engine compiles against stubs, its made files are those of today.

The stubs have the signatures that players/unreal/Docs/unreal_api.md names. This tests our text, not the engine.
"""

from __future__ import annotations

import json
import re
from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from avatar_shaders.entries import ENTRIES, HLSL_ONLY
from avatar_shaders.unreal import unreal_files
from tests.players.unreal.sources import (
    HEADERS,
    MODULES,
    NEWEST,
    OLDEST,
    PLUGIN,
    PRIVATE,
    ROOT,
    STUBS,
    check_layer,
    layer,
)

MOST_LINES = 900  # of the layer over the engine, without what is made
TABLE = PLUGIN / "Docs" / "unreal_api.md"
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


def test_the_layer_compiles_against_the_stubs_of_each_release(tmp_path: Path) -> None:
    releases = (OLDEST, OLDEST + 1, NEWEST)
    folders = [tmp_path / str(minor) for minor in releases]
    with ThreadPoolExecutor(2) as pool:
        said = list(pool.map(check_layer, folders, releases))
    assert said == ["", "", ""], said[0][:3000] or said[1][:3000] or said[2][:3000]


def test_the_layer_is_thin() -> None:
    assert sum(len(path.read_text("utf-8").splitlines()) for path in layer()) < MOST_LINES


def test_the_rest_includes_no_header_of_the_engine() -> None:
    own = [
        path for path in PRIVATE.rglob("*") if path.suffix in (".h", ".cpp") and "Engine" not in path.parts
    ]
    names = {path.name for path in own}
    for path in own:
        for header in re.findall(r'#include "(.+?)"', path.read_text("utf-8")):
            assert Path(header).name in names, f"{path.name} includes {header}"


def test_every_name_of_the_engine_stands_in_the_table_with_its_source() -> None:
    rows = table()
    assert len({name for name, *_ in rows}) == len(rows) > 50
    named = {word for _, words, _ in rows for word in words}
    stubs = words_of(sorted(STUBS.glob("*.h")))
    made = [PRIVATE / f"Engine/GaussianAvatarKernels.{kind}" for kind in ("h", "cpp")]
    used = words_of([*layer(), *made])
    assert not sorted(named - stubs), "in the table, not in the stubs"
    assert not sorted(named - used), "in the table, not used"
    assert {header for *_, header in rows} <= {
        f"{name}.h" for names in HEADERS.values() for name in names.split()
    }
    engines = {word for word in used & stubs if len(word) > 1 and word[0].isupper() and not OWN.search(word)}
    assert not sorted(engines - named - PARAMETERS), "used, and not in the table"


def test_no_two_sources_of_a_module_have_one_name() -> None:
    """Unreal's build puts the objects of a module into one folder."""
    for module in MODULES.iterdir():
        names = Counter(path.name for path in module.rglob("*.cpp"))
        assert [name for name, count in names.items() if count > 1] == []


def test_made_files_are_those_of_today() -> None:
    reflection = "engine_shaders/avatar_shaders/reflection.json"
    files = unreal_files(ROOT, {reflection: (ROOT / reflection).read_text("utf-8")})
    different = [path for path, text in files.items() if _text(ROOT / path) != text]
    assert different == [], "run python -m avatar_shaders"
    native = {path.relative_to(ROOT).as_posix() for path in (PRIVATE / "Native").rglob("*") if path.is_file()}
    assert native <= files.keys()


def _text(path: Path) -> str | None:
    return path.read_text("utf-8") if path.is_file() else None


@pytest.mark.parametrize("entry", [name for name, row in ENTRIES.items() if row.kind == "compute"])
def test_kernels_have_the_parameters_of_their_texts(entry: str) -> None:
    """Names and types of the class are those that the .usf file declares. Read from the text, not from reflection."""
    kernels = (PRIVATE / "Engine/GaussianAvatarKernels.h").read_text("utf-8")
    (told,) = re.findall(
        rf"/\*\* Entry {entry}\. \*/\n.*?BEGIN_SHADER_PARAMETER_STRUCT\(.*?\)\n(.*?)\tEND_",
        kernels,
        re.DOTALL,
    )
    found = dict(re.findall(r"SHADER_PARAMETER\((\w+), (\w+)\)", told))
    text = without_text((PLUGIN / "Shaders" / f"{Path(ENTRIES[entry].hlsl).stem}.ush").read_text("utf-8"))
    (block,) = re.findall(r"AVATAR_CONSTANTS\(\w+\)(.*?)AVATAR_CONSTANTS_END", text, re.DOTALL)
    cpp = {"uint": "uint32", "float": "float", **{f"float{n}": f"FVector{n}f" for n in (2, 3, 4)}}
    declared = [(cpp[kind], name) for kind, name in re.findall(r"(\w+) (\w+);", block)]
    assert re.findall(r"SHADER_PARAMETER\((\w+), (\w+)\)", told) == declared and found
    buffers = set(re.findall(r"(RWStructuredBuffer<\w+>|StructuredBuffer<\w+>), (\w+)\)", told))
    assert buffers == set(re.findall(r"\b(RWStructuredBuffer<\w+>|StructuredBuffer<\w+>) (\w+);", text))


@pytest.mark.parametrize("entry", [name for name, row in ENTRIES.items() if row.kind == "compute"])
def test_constants_are_read_from_where_the_block_has_them(entry: str) -> None:
    """Offsets follow from the declarations: a member begins at a multiple of its size, as in std140 and a cbuffer."""
    text = without_text((PLUGIN / "Shaders" / f"{Path(ENTRIES[entry].hlsl).stem}.ush").read_text("utf-8"))
    (block,) = re.findall(r"AVATAR_CONSTANTS\(\w+\)(.*?)AVATAR_CONSTANTS_END", text, re.DOTALL)
    offset, want = 0, []
    for kind, name in re.findall(r"(\w+) (\w+);", block):
        size = 4 * int(kind[-1]) if kind[-1].isdigit() else 4
        offset = -(-offset // size) * size
        want.append((name, str(offset), str(size)))
        offset += size
    code = (PRIVATE / "Engine/GaussianAvatarKernels.cpp").read_text("utf-8")
    own = code[code.index(f"void Add{kernel_name(entry)}(") :].split("\n}\n", 1)[0]
    assert re.findall(r"memcpy\(&Parameters->(\w+), Block \+ (\d+), (\d+)\)", own) == want


def kernel_name(entry: str) -> str:
    return "Avatar" + entry.replace("_", " ").title().replace(" ", "")


def kernel_class(entry: str) -> str:
    return f"F{kernel_name(entry)}"


def test_every_shader_that_a_class_names_exists() -> None:
    sources = [*layer(), PRIVATE / "Engine/GaussianAvatarKernels.cpp"]
    named = [
        found
        for path in sources
        for found in re.findall(
            r'IMPLEMENT_GLOBAL_SHADER\(\w+, "/Plugin/GaussianAvatar/(.+?)", "(\w+)"', path.read_text("utf-8")
        )
    ]
    assert len(named) == 14 + 2 + 2 and {entry for _, entry in named} - set(ENTRIES | HLSL_ONLY) == set(DRAWN)
    for file, entry in named:
        text = (PLUGIN / "Shaders" / file).read_text("utf-8")
        included = (PLUGIN / "Shaders" / file).with_suffix(".ush")
        assert re.search(rf"\b{entry}\(", text + (included.read_text("utf-8") if included.is_file() else ""))


DRAWN = {  # what each entry of unreal_draw.usf reads, seen by eye
    "unreal_depth_pixel": {"scene_depth", "depth_min", "depth_per_pixel"},
    "unreal_composite_pixel": {"scene_colour", "output_min", "colour_min"}
    | {"Accumulated", "background", "linear_target", "flip_rows", "image_size"},
}
ZERO = {"background", "linear_target", "flip_rows"}  # as a new parameter struct has them


@pytest.mark.parametrize("entry", DRAWN)
def test_loose_parameters_of_the_drawing_shaders_are_given(entry: str) -> None:
    kernels = (PRIVATE / "Engine/GaussianAvatarKernels.h").read_text("utf-8")
    (told,) = re.findall(rf"/\*\* Entry {entry}\. \*/\n(.*?)END_SHADER_PARAMETER_STRUCT", kernels, re.DOTALL)
    assert set(re.findall(r"SHADER_PARAMETER\w*\(\w+, (\w+)\)", told)) == DRAWN[entry]
    assert told.rstrip().endswith("RENDER_TARGET_BINDING_SLOTS()")
    draw = (PRIVATE / "Engine/GaussianAvatarDraw.cpp").read_text("utf-8")
    own = draw[draw.index(f"{kernel_class(entry)}::FParameters* Parameters") :].split("\n}\n", 1)[0]
    assert set(re.findall(r"Parameters->(\w+) =", own)) == DRAWN[entry] - ZERO


def test_what_files_use_of_the_engine_they_include() -> None:
    """By the table: through headers of the plugin too, but not by what the engine's headers happen to include."""
    headers = {word: header for name, _, header in table() for word in [name.split("::")[-1]]}
    kernels = [PRIVATE / f"Engine/GaussianAvatarKernels.{kind}" for kind in ("h", "cpp")]
    own = {path.name: path for path in (*layer(), *kernels)}

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


def test_the_plugin_names_its_modules_and_their_modules_exist() -> None:
    plugin = json.loads((PLUGIN / "GaussianAvatar.uplugin").read_text("utf-8"))
    modules = {one["Name"]: one for one in plugin["Modules"]}
    assert {path.name for path in MODULES.iterdir()} == modules.keys()
    assert modules["GaussianAvatar"]["LoadingPhase"] == "PostConfigInit"  # before shaders are compiled
    for name in modules:
        rules = (MODULES / name / f"{name}.Build.cs").read_text("utf-8")
        assert f"public class {name} : ModuleRules" in rules
        implemented = re.compile(rf"IMPLEMENT_MODULE\(\w+, {name}\)")
        assert any(implemented.search(path.read_text("utf-8")) for path in (MODULES / name).rglob("*.cpp"))
    rules = (MODULES / "GaussianAvatar/GaussianAvatar.Build.cs").read_text("utf-8")
    assert (
        "FPSemantics = FPSemanticsMode.Precise;" in rules
    )  # Unreal's own default assumes that there is no NaN
    for folder in re.findall(r'Path\.Combine\(ModuleDirectory, "(.+?)"\)', rules):
        assert (MODULES / "GaussianAvatar" / folder).is_dir()
