"""The Editor side of the Unity package under mono: importer, clips, picture, checks. Unity itself is a stub.

The examples of its pages and the scripts of its samples are compiled along.
"""

from __future__ import annotations

import gzip
import json
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from avatar_export.version import GENERATOR
from avatar_runtime.conformance import driving_cases, encode_driving
from avatar_runtime.packs import decode_pack
from tests.players.unity import (
    STUBS,
    UNITY,
    core_sources,
    program_of_tests,
    run_tests,
    runtime_sources,
    sources,
)
from tests.players.unity_editor.icons import write_icons

PAGES = UNITY / "Documentation~"
EXAMPLE = re.compile(r"^```csharp\n(.*?)^```$", re.MULTILINE | re.DOTALL)
# What begins a message for the Console, and the first text that follows.
MESSAGE = re.compile(
    r'(?:Warnings\.Once|Debug\.Log(?:Error|Warning)|new AvatarError|LogImportError)\(\s*\$?"((?:\\.|[^"\\])*)"'
)
LEAST = 8  # characters of a fragment that says something
JOINTS = UNITY / "Tests" / "Core" / "Packs" / "joints.avatar.bytes"


@pytest.fixture(scope="session")
def program(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The tests of the Editor, and those of icons; with examples and samples, which are only compiled."""

    def files(folder: Path) -> list[Path]:
        # AssemblyInfo names friends for assemblies of Unity; here all is one.
        own = [path for path in [*core_sources(), *runtime_sources()] if path.name != "AssemblyInfo.cs"]
        own += sources(UNITY / "Editor", STUBS / "engine", STUBS / "editor", UNITY / "Tests" / "Editor")
        own += [UNITY / "Tests" / "Core" / name for name in ("Cases.cs", "IconTests.cs")]
        own += sources(Path(__file__).parent / "unity_editor", UNITY / "Samples~")
        return [*own, *written_examples(folder)]

    return program_of_tests(tmp_path_factory, "unity_editor_tests", files)


def written_examples(folder: Path) -> list[Path]:
    """The examples of the pages as files."""
    found = []
    for page in sorted(PAGES.glob("*.md")):
        for number, example in enumerate(EXAMPLE.findall(page.read_text("utf-8"))):
            found.append(folder / f"{page.stem}_{number}.cs")
            found[-1].write_text(example, "utf-8")
    assert len(found) >= 5
    return found


def changed(file: bytes, change: Callable[[dict[str, Any]], None]) -> bytes:
    """A pack whose document was changed."""
    body = gzip.decompress(file)
    length = int.from_bytes(body[:8], "little")
    header = json.loads(body[8 : 8 + length])
    document = json.loads(header["__metadata__"]["pack"])
    change(document)
    header["__metadata__"]["pack"] = json.dumps(document)
    text = json.dumps(header).encode()
    return gzip.compress(len(text).to_bytes(8, "little") + text + body[8 + length :], 1)


def write_refused(folder: Path) -> None:
    """Packs that are not taken, and two with a name that is there twice."""
    file = JOINTS.read_bytes()

    def newer(document: dict[str, Any]) -> None:
        document["asset"] |= {"version": "2.0", "minVersion": "2.0"}

    def beyond(document: dict[str, Any]) -> None:
        blend = next(one for one in document["program"]["levels"][0]["deform"] if one["entry"] == "blend")
        blend["constants"]["base_mean"] += 1 << 20

    def twins(document: dict[str, Any]) -> None:
        for clip in document["avatar"]["clips"]:
            clip["name"] = "nod"

    def clash(document: dict[str, Any]) -> None:
        late, name = document["avatar"]["late_morphs"], document["avatar"]["expressions"][0]["name"]
        outputs = document["avatar"]["driving"]["outputs"]
        outputs[outputs.index(f"eyelid/{late[0]}")] = f"eyelid/{name}"
        late[0] = name

    (folder / "clash.avatar").write_bytes(changed(file, clash))
    (folder / "newer.avatar").write_bytes(changed(file, newer))
    (folder / "index.avatar").write_bytes(changed(file, beyond))
    (folder / "huge.avatar").write_bytes(gzip.compress((1 << 40).to_bytes(8, "little") + bytes(1 << 20)))
    (folder / "twins.avatar").write_bytes(changed(file, twins))


def write_driving(folder: Path) -> None:
    """A pack, and the vectors of driving in the folder beside it."""
    (folder / "driven.avatar").write_bytes(JOINTS.read_bytes())
    (folder / "driven.reference").mkdir()
    cases = driving_cases(decode_pack(JOINTS.read_bytes(), "driven").avatar, "right", GENERATOR)
    for name, content in encode_driving(cases).items():
        (folder / "driven.reference" / name).write_bytes(content)


def test_the_editor_does_what_its_tests_say(program: Path, tmp_path: Path) -> None:
    write_icons(tmp_path)
    write_refused(tmp_path)
    write_driving(tmp_path)
    said = run_tests(program, AVATAR_CASES=str(tmp_path))
    assert "ok IconTests.IconsAreWhatPythonDraws" in said
    assert "ok ClipCurvesTests.CurvesAreTheClip(body, 2)" in said


def test_every_message_is_explained() -> None:
    page = (PAGES / "troubleshooting.md").read_text("utf-8")
    texts = [
        path.read_text("utf-8") for path in sources(*(UNITY / n for n in ("Runtime", "Editor", "Samples~")))
    ]
    found = {
        max(re.split(r"\{[^}]*\}", one), key=len).strip(" .;:'") for t in texts for one in MESSAGE.findall(t)
    }
    known = {part for part in found if len(part) >= LEAST}
    assert len(known) >= 12
    assert {part for part in known if part not in page} == set()
