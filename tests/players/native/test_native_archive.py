"""The source archive of the native player is whole: CMake builds it, installs it, and programs use it in both ways."""

from __future__ import annotations

import re
import shutil
import subprocess
from pathlib import Path

import pytest

from avatar_schema.version import __version__
from avatar_shaders.entries import ENTRIES
from avatar_shaders.generate import HLSL
from avatar_shaders.texts import source
from tests.players.native import need_compilers
from tests.session.assembled import assembled
from tests.session.native import LIMIT_S, NATIVE
from tests.session.shared_folder import made_once

LANGUAGES = ("glsl430", "glsl310es", "msl")  # as the C header numbers them
TEXTS = {(language, entry): source(entry, language) for language in LANGUAGES for entry in ENTRIES}
PROGRAM = r"""
#include "avatar_gles.h"
#include <stdio.h>

int main(void) {
    const uint32_t languages[] = {AVATAR_GLSL430, AVATAR_GLSL310ES, AVATAR_MSL};
    for (int at = 0; at < 3; at++) {
        const char* entry = NULL;
        const char* text;
        for (uint32_t i = 0; (text = avatar_shader_at(languages[at], i, &entry)) != NULL; i++) {
            if (avatar_shader(languages[at], entry) != text) return 1;
            printf("%d\n%s\n%s%c", at, entry, text, 0);
        }
    }
    avatar_gles_close(NULL);
    return 0;
}
"""
PROJECT = """
cmake_minimum_required(VERSION 3.16)
project(program LANGUAGES C CXX)
{found}
add_executable(program program.c)
target_link_libraries(program PRIVATE avatar_player::avatar_gles)
"""


def cmake(*words: object) -> str:
    """What it prints. Fails the test where it fails."""
    done = refused(*words)
    assert done.returncode == 0, done.stdout[-1000:] + done.stderr[-4000:]
    return done.stdout


def refused(*words: object) -> subprocess.CompletedProcess[str]:
    command = ["cmake", *map(str, words)]
    return subprocess.run(command, capture_output=True, text=True, timeout=LIMIT_S, check=False)


@pytest.fixture(scope="session")
def archive(tmp_path_factory: pytest.TempPathFactory) -> Path:
    need_compilers()
    return assembled(tmp_path_factory, "native")


@pytest.fixture(scope="session")
def installed(archive: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """What the archive installs, built with warnings as errors."""

    def make(folder: Path) -> Path:
        cmake("-S", archive, "-B", folder / "build", "-DAVATAR_WARNINGS_AS_ERRORS=ON")
        cmake("--build", folder / "build", "--parallel", 2)
        cmake("--install", folder / "build", "--prefix", folder / "installed")
        return folder / "installed"

    return made_once(tmp_path_factory, "native_installed", make)


def program(folder: Path, found: str) -> None:
    """A project in a folder that uses the library as `found` says."""
    (folder / "program.c").write_text(PROGRAM)
    (folder / "CMakeLists.txt").write_text(PROJECT.format(found=found))


def built(folder: Path, *options: str) -> dict[tuple[str, str], str]:
    """Builds the project and runs it: {(language, entry): text}."""
    cmake("-S", folder, "-B", folder / "build", *options)
    return rebuilt(folder)


def rebuilt(folder: Path) -> dict[tuple[str, str], str]:
    cmake("--build", folder / "build", "--parallel", 2)
    done = subprocess.run([str(folder / "build/program")], capture_output=True, text=True, check=True)
    rows = [row.split("\n", 2) for row in done.stdout.split("\0")[:-1]]
    return {(LANGUAGES[int(language)], entry): text for language, entry, text in rows}


def test_the_archive_has_what_a_build_needs_and_no_more(archive: Path) -> None:
    names = {path.relative_to(archive).as_posix() for path in archive.rglob("*") if path.is_file()}
    folders = {name.split("/")[0] for name in names if "/" in name}
    assert folders == {
        "android",
        "cmake",
        "d3d11",
        "gles",
        "include",
        "ios",
        "play",
        "scene",
        "shaders",
        "src",
    }
    assert {name for name in names if "/" not in name} == {
        "CMakeLists.txt",
        "LICENSE",
        "README.md",
        "VERSION",
    }
    assert (archive / "VERSION").read_text() == f"{__version__}\n"
    assert (archive / "LICENSE").read_bytes() == (NATIVE.parents[1] / "LICENSE").read_bytes()
    texts = {name for name in names if name.startswith("shaders/")}
    hlsl = {f"shaders/hlsl/{path.name}" for path in HLSL.iterdir()}
    assert hlsl < texts and len(texts - hlsl) == 2 * len(ENTRIES)
    assert not [name for name in names if "head.avatar" in name or "/." in f"/{name}"]


def test_a_program_finds_what_was_installed(installed: Path, tmp_path: Path) -> None:
    program(tmp_path, f"find_package(avatar_player {'.'.join(__version__.split('.')[:2])} REQUIRED)")
    assert built(tmp_path, f"-DCMAKE_PREFIX_PATH={installed}") == TEXTS
    assert (installed / "include/avatar_player.h").is_file()


def test_another_minor_version_is_not_found(installed: Path, tmp_path: Path) -> None:
    major, minor = (int(number) for number in __version__.split(".")[:2])
    older = f"{major}.{minor - 1}" if minor else f"{major - 1}.0"
    for wanted in (older, f"{major}.{minor + 1}", f"{major + 1}.{minor}"):
        program(tmp_path, f"find_package(avatar_player {wanted} REQUIRED)")
        done = refused("-S", tmp_path, "-B", tmp_path / "build", f"-DCMAKE_PREFIX_PATH={installed}")
        assert done.returncode and f'requested version "{wanted}"' in " ".join(done.stderr.split())


def test_a_program_with_the_sources_is_built_again_where_a_text_changes(
    archive: Path, tmp_path: Path
) -> None:
    shutil.copytree(archive, tmp_path / "player")
    program(tmp_path, "add_subdirectory(player)")
    assert built(tmp_path, "-DCMAKE_UNITY_BUILD=ON") == TEXTS
    assert not list((tmp_path / "build").rglob("avatar_play")), "who adds a folder has no use for the example"
    changed = tmp_path / "player/shaders/msl/blend.metal"
    long = "".join(f'// {at} "quoted" \\ ; ${{not_a_variable}} [x] \n' for at in range(1000))
    changed.write_text(changed.read_text() + long)
    want = TEXTS | {("msl", "blend"): TEXTS["msl", "blend"] + long}
    assert rebuilt(tmp_path) == want
    (tmp_path / "player/shaders/glsl/added.comp").write_text("void main() {}\n")
    assert rebuilt(tmp_path) == want | {
        (language, "added"): "void main() {}\n" for language in ("glsl430", "glsl310es")
    }


def test_a_text_that_compilers_refuse_is_refused(archive: Path, tmp_path: Path) -> None:
    shutil.copytree(archive / "cmake", tmp_path / "cmake")
    script = ["-D", f"TO={tmp_path}", "-P", tmp_path / "cmake/shader_texts.cmake"]
    assert "has no shader texts: take the whole source archive" in " ".join(refused(*script).stderr.split())
    shutil.copytree(archive / "shaders", tmp_path / "shaders")
    cmake(*script)
    for wrong in ("x" * 65001, 'the end )~" of a literal'):
        (tmp_path / "shaders/glsl/blend.comp").write_text(wrong)
        said = refused(*script)
        assert said.returncode and "blend.comp is longer than 65000 bytes, or" in " ".join(
            said.stderr.split()
        )
    assert "TO is missing" in refused("-P", tmp_path / "cmake/shader_texts.cmake").stderr


def test_pieces_of_texts_are_short_enough_for_every_compiler(archive: Path, tmp_path: Path) -> None:
    """MSVC takes 16,380 bytes of a literal and 65,535 of joined ones."""
    cmake("-D", f"TO={tmp_path}", "-P", archive / "cmake/shader_texts.cmake")
    made = [(tmp_path / f"avatar_{kind}_texts.inc").read_text() for kind in ("shader", "hlsl")]
    rows = "".join(made).split("\n},\n")
    sizes = [[len(piece.encode()) for piece in re.findall(r'R"~\((.*?)\)~"', row, re.DOTALL)] for row in rows]
    assert max(map(max, sizes[:-1])) <= 16380 and max(map(sum, sizes)) <= 65535
    assert max(map(len, sizes)) > 1  # so joining is tested, too


def test_a_checkout_has_the_version_and_texts_of_the_archive(archive: Path, tmp_path: Path) -> None:
    for root in (archive, NATIVE):
        cmake("-S", root, "-B", tmp_path / root.name)
    caches = [(tmp_path / root.name / "CMakeCache.txt").read_text() for root in (archive, NATIVE)]
    for cache in caches:
        assert re.findall(r"^CMAKE_PROJECT_VERSION:STATIC=(.+)$", cache, re.MULTILINE) == [__version__]
    texts = [tmp_path / root.name / "shader_texts/avatar_shader_texts.inc" for root in (archive, NATIVE)]
    assert texts[0].read_bytes() == texts[1].read_bytes()
