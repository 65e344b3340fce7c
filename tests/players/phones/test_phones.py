"""The Android and iOS projects name what exists: files, functions across languages, shaders and their constants.

Neither can be built here. This tests what their texts say of each other, not the systems.
"""

from __future__ import annotations

import json
import plistlib
import re
import shutil
import subprocess
from pathlib import Path
from typing import Any

import pytest

from avatar_export.packing.write import prepare, write
from tests.avatars import full_avatar
from tests.session.native import SANITIZED, WARNINGS, library
from tests.session.needed import need

ROOT = Path(__file__).parents[3]
NATIVE = ROOT / "players" / "native"
ANDROID, IOS = NATIVE / "android", NATIVE / "ios"
KOTLIN = ANDROID / "app/src/main/kotlin"
JNI = ANDROID / "app/src/main/cpp/avatar_jni.cpp"
HEADER = NATIVE / "include" / "avatar_player.h"
SHADERS = ROOT / "engine_shaders" / "avatar_shaders"
TYPES = {"ByteArray": "jbyteArray", "String": "jstring", "Long": "jlong", "Int": "jint", "": "void"}
TYPES |= {"Double": "jdouble", "Boolean": "jboolean"}  # of Kotlin, of JNI
TABLE: dict[str, Any] = json.loads((SHADERS / "reflection.json").read_text("utf-8"))["entries"]
KERNELS = [name for name, row in TABLE.items() if row["kind"] == "compute"]
SIZES = {"uint": 4, "float": 4, "Float": 4, **{f"{kind}2": 8 for kind in ("float", "SIMD")}}
SIZES |= {"float4": 16, "SIMD4": 16}


def without_text(source: str) -> str:
    """C++, Kotlin or Swift without comments and strings."""
    return re.sub(r'//[^\n]*|/\*.*?\*/|"(?:\\.|[^"\\\n])*"', ' "" ', source, flags=re.DOTALL)


def swift() -> str:
    return "\n".join(path.read_text("utf-8") for path in sorted((IOS / "Sources").glob("*.swift")))


def succeeds(*command: object) -> bytes:
    done = subprocess.run(list(map(str, command)), capture_output=True, check=False)
    assert done.returncode == 0, done.stderr[-3000:]
    return done.stdout


def test_kotlin_declares_what_the_library_defines() -> None:
    text = without_text((KOTLIN / "org/avatarexport/player/NativeAvatar.kt").read_text("utf-8"))
    declared = {}
    for name, arguments, result in re.findall(r"external fun (\w+)\(([^)]*)\)(?:: (\w+)\??)?", text):
        types = [TYPES[one] for one in re.findall(r"\w+: (\w+)", arguments)]
        declared[name] = (TYPES[result], ["JNIEnv*", "jobject", *types])
    code = re.sub(r"\s+", " ", without_text(JNI.read_text("utf-8")))
    head = r"JNIEXPORT (\w+) JNICALL Java_org_avatarexport_player_NativeAvatar_(\w+)\(([^)]*)\)"
    found = re.findall(head, code)
    defined = {name: (result, [one.split()[0] for one in given.split(", ")]) for result, name, given in found}
    assert defined == declared and len(declared) > 4


def test_kotlins_calls_end_well(tmp_path: Path) -> None:
    """Run with a stand-in for Java: memory that is not there, a cut file, a sound one, a lost context."""
    need({"clang++": shutil.which("clang++")})
    pack, program = tmp_path / "sound.avatar", tmp_path / "program"
    pack.write_bytes(write(prepare([full_avatar(3)], None), {}, None, "right").file)
    stubs = Path(__file__).parent / "stubs"
    folders = [f"-I{path}" for path in (stubs, NATIVE / "include", NATIVE / "gles")]
    parts = [JNI, Path(__file__).parent / "jni_probe.cpp", *library(SANITIZED)]
    options = ["-std=c++17", "-fno-exceptions", "-fno-rtti", *WARNINGS, *SANITIZED]
    succeeds("clang++", *options, *folders, *parts, "-o", program)
    lines = succeeds(program, pack).decode("utf-8").splitlines()
    assert lines[:2] == ["no memory: 1"] * 2
    assert lines[2:5] == ["drawn: 0", "not drawn: 0", "seconds: -1.0000 -1.0"]
    assert lines[5].startswith("line: h\N{GRINNING FACE}.avatar")
    begun = ["gles open", "gles add", "gles forget", "gles restore"]
    assert lines[6:13] == [*begun, "drawn: 1", "not drawn: 0", f"seconds: {4 / 24:.4f} -1.0"]
    assert len(lines[13]) > len("line: ") and lines[14:] == ["gles forget", "gles close"]


def test_gradle_and_its_manifest_name_what_exists() -> None:
    (module,) = re.findall(r'include\(":(\w+)"\)', (ANDROID / "settings.gradle.kts").read_text("utf-8"))
    build = (ANDROID / module / "build.gradle.kts").read_text("utf-8")
    (cmake,) = re.findall(r'path = file\("(.+?)"\)', build)
    text = (ANDROID / module / cmake).read_text("utf-8")
    assert (ANDROID / module / cmake).parent == JNI.parent
    (up,) = re.findall(
        r"get_filename_component\(NATIVE \$\{CMAKE_CURRENT_SOURCE_DIR\}/(\S+) ABSOLUTE\)", text
    )
    assert (JNI.parent / up).resolve() == NATIVE
    assert all((NATIVE / name).is_dir() for name in re.findall(r"\$\{NATIVE\}/(\w+)", text))
    (target, own) = re.findall(r"add_library\((\w+) SHARED (\S+) ", text)[0]
    kotlin = {path.stem: path.read_text("utf-8") for path in KOTLIN.rglob("*.kt")}
    assert own == JNI.name and f'System.loadLibrary("{target}")' in kotlin["NativeAvatar"]
    (namespace,) = re.findall(r'namespace = "(.+?)"', build)
    for path in KOTLIN.rglob("*.kt"):
        assert path.read_text("utf-8").startswith(f"package {namespace}\n")
        assert path.parent == KOTLIN / namespace.replace(".", "/")
    manifest = (ANDROID / module / "src/main/AndroidManifest.xml").read_text("utf-8")
    for activity in re.findall(r'<activity\s+android:name="\.(\w+)"', manifest):
        assert f"class {activity} : Activity()" in kotlin[activity]
    used = {name for text in kotlin.values() for name in re.findall(r"NativeAvatar\.(\w+)\(", text)}
    assert used <= set(re.findall(r"fun (\w+)", kotlin["NativeAvatar"]))
    assert "-DANDROID_SUPPORT_FLEXIBLE_PAGE_SIZES=ON" in build and 'ndkVersion = "27.' in build


def test_androids_build_finds_the_texts_of_the_shaders(tmp_path: Path) -> None:
    """Configured for this machine: nothing is compiled."""
    need({"cmake": shutil.which("cmake"), "clang++": shutil.which("clang++")})
    options = ["-DCMAKE_EXPORT_COMPILE_COMMANDS=ON", "-DCMAKE_CXX_COMPILER=clang++"]
    succeeds("cmake", "-S", JNI.parent, "-B", tmp_path, *options)
    rows = json.loads((tmp_path / "compile_commands.json").read_text("utf-8"))
    (row,) = (row for row in rows if row["file"].endswith("shader_texts.cpp"))
    folders = re.findall(r"-I(\S+)", row["command"])
    assert [path for path in folders if (Path(path) / "avatar_shader_texts.inc").is_file()]


def test_cmake_names_what_ios_has() -> None:
    text = (IOS / "CMakeLists.txt").read_text("utf-8")
    named = re.findall(r"^  (Sources/\S+)$", text, re.MULTILINE)
    assert {IOS / name for name in named} == set((IOS / "Sources").iterdir())
    assert re.findall(r"add_subdirectory\(\$\{CMAKE_CURRENT_SOURCE_DIR\}/(\S+) native\)", text) == [".."]
    (listed,) = re.findall(r"INFO_PLIST \$\{CMAKE_CURRENT_SOURCE_DIR\}/(\S+)", text)
    plist = plistlib.loads((IOS / listed).read_bytes())
    assert plist["CFBundleVersion"] and plist["CFBundleExecutable"] == "$(EXECUTABLE_NAME)"
    assert plist["UILaunchScreen"] == {}  # without it iOS letterboxes the app
    assert text.index("CMAKE_OSX_DEPLOYMENT_TARGET") < text.index("project(")
    (bridge,) = re.findall(r"BRIDGING_HEADER \$\{CMAKE_CURRENT_SOURCE_DIR\}/(\S+)\n", text)
    assert re.findall(r'#include "(.+?)"', (IOS / bridge).read_text("utf-8")) == [HEADER.name]


def arguments(text: str, begin: int) -> int:
    """How many arguments follow the bracket at `begin`."""
    depth, commas, at = 0, 0, begin
    while True:
        depth += (text[at] in "([{") - (text[at] in ")]}")
        if not depth:
            inside = text[begin + 1 : at].strip()
            return commas + 1 if inside and inside != "void" else 0
        commas += text[at] == "," and depth == 1
        at += 1


def test_swift_calls_what_the_header_declares() -> None:
    header = re.sub(r"/\*.*?\*/", "", HEADER.read_text("utf-8"), flags=re.DOTALL)
    heads = re.finditer(r"AVATAR_API [\w* ]+?(avatar_\w+)\(", header)
    declared = {found[1]: arguments(header, found.end() - 1) for found in heads}
    text = without_text(swift())
    calls = {(found[1], arguments(text, found.end() - 1)) for found in re.finditer(r"\b(avatar_\w+)\(", text)}
    assert len(calls) > 20 and calls <= declared.items()
    words = set(re.findall(r"\w+", header))
    assert set(re.findall(r"\bAVATAR_\w+", text)) <= words
    sized = set(re.findall(r"\b(Avatar\w+)\.sized", text))
    assert sized == set(re.findall(r"extension (Avatar\w+): AvatarStruct", text))
    assert len(sized) > 6 and sized <= set(re.findall(r"typedef struct (\w+) \{", header))
    values = "facts|clip|chunk|dispatch|binding|buffer|camera|own"
    fields = set(re.findall(rf"\b(?:{values})\.(\w+)", text)) - {"contents"}
    assert {"whole_size", "block_offset", "projected", "binding_count"} <= fields <= words, fields - words
    assert "threadsPerThreadgroup: MTLSize(width: Int(dispatch.threads), height: 1, depth: 1)" in swift()


def layout(members: list[tuple[str, str]]) -> tuple[dict[str, int], int]:
    """Offsets of (name, type), and where the last ends."""
    offset, found = 0, {}
    for name, kind in members:
        offset = -(-offset // SIZES[kind]) * SIZES[kind]
        found[name], offset = offset, offset + SIZES[kind]
    return found, offset


@pytest.mark.parametrize("entry", KERNELS)
def test_metal_texts_have_the_indices_and_sizes_that_swift_gives(entry: str) -> None:
    """Swift binds by the dispatch's numbers, and hands over so many bytes of constants as its block has."""
    text, row = (SHADERS / "msl" / f"{entry}.metal").read_text("utf-8"), TABLE[entry]
    (signature,) = re.findall(rf"^kernel void {entry}\((.*)\)$", text, re.MULTILINE)
    *storage, (struct, _, block) = re.findall(r"(\w+)& (\w+) \[\[buffer\((\d+)\)\]\]", signature)
    want = [(one["name"], str(one["binding"])) for one in row["storage"]]
    assert sorted((name.removesuffix("_1"), at) for _, name, at in storage) == sorted(want)
    (told,) = row["uniform_blocks"]
    assert int(block) == told["binding"]
    (body,) = re.findall(rf"^struct {struct}\n\{{\n(.*?)^\}};", text, re.MULTILINE | re.DOTALL)
    members = [(name, kind) for kind, name in re.findall(r"(\w+) (\w+);", body)]
    found, end = layout(members)
    assert found.items() <= {member["name"]: member["offset"] for member in told["members"]}.items()
    widest = max(SIZES[kind] for _, kind in members)
    assert -(-end // widest) * widest <= told["size"]


@pytest.mark.parametrize(
    ("entry", "struct"), [("raster_vertex", "RasterConstants"), ("composite_pixel", "CompositeConstants")]
)
def test_swift_lays_constants_out_as_the_texts_do(entry: str, struct: str) -> None:
    (body,) = re.findall(rf"private struct {struct} \{{\n(.*?)\n    \}}", swift(), re.DOTALL)
    found, end = layout(re.findall(r"var (\w+): (\w+)", body))
    (block,) = TABLE[entry]["uniform_blocks"]
    want = {member["name"].replace("_", ""): member["offset"] for member in block["members"]}
    assert {name.lower(): at for name, at in found.items() if name != "unused"} == want
    assert f"constants = {block['binding']}" in swift() and -(-end // 16) * 16 == block["size"]
