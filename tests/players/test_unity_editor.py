"""The Editor side of the Unity package under mono: importer, clips, picture, checks. Unity itself is a stub.

The examples of its pages and the scripts of its samples are compiled along.
"""

from __future__ import annotations

import gzip
import json
import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from avatar_export.packing.steps import Fineness
from avatar_export.packing.write import prepare, write
from avatar_export.version import GENERATOR
from avatar_runtime.conformance import driving_cases, encode_driving
from avatar_runtime.packs import decode_pack
from tests.avatars import full_avatar
from tests.players.unity import STUBS, UNITY, compile_csharp, need_mono, run_core_tests
from tests.players.unity_editor.icons import write_icons
from tests.players.unity_editor.sources import engine_sources
from tests.session.shared_folder import made_once

PAGES = UNITY / "Documentation~"
EXAMPLE = re.compile(r"^```csharp\n(.*?)^```$", re.MULTILINE | re.DOTALL)
# What begins a message for the Console, and the first text that follows.
MESSAGE = re.compile(
    r'(?:Warnings\.Once|Debug\.Log(?:Error|Warning)|new Core\.AvatarError|LogImportError)\(\s*\$?"((?:\\.|[^"\\])*)"'
)
PARTS = re.compile(r"\{[^}]*\}")  # of interpolated texts
LEAST = 8  # characters of a fragment that says something


@pytest.fixture(scope="session")
def program(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The tests of the Editor, and those of icons; with examples and samples, which are only compiled."""
    need_mono()

    def make(folder: Path) -> Path:
        sources = [*engine_sources(), *sorted((UNITY / "Tests" / "Editor").rglob("*.cs"))]
        sources += sorted((Path(__file__).parent / "unity_editor").glob("*.cs"))
        sources += [UNITY / "Tests" / "Core" / name for name in ("Cases.cs", "IconTests.cs")]
        sources += [*sorted((UNITY / "Samples~").rglob("*.cs")), *written_examples(folder)]
        compile_csharp([*sources, *sorted((STUBS / "mono").glob("*.cs"))], folder / "tests.exe")
        return folder / "tests.exe"

    return made_once(tmp_path_factory, "unity_editor_tests", make)


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
    file = (UNITY / "Tests" / "Core" / "Packs" / "joints.avatar.bytes").read_bytes()

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

    far = full_avatar()
    assert far.rig is not None
    rest = far.rig.rest_local.copy()
    rest[:, 0, 3] = 3e38  # each fits float32, their sum does not
    far = replace(far, rig=replace(far.rig, rest_local=rest))
    (folder / "far.avatar").write_bytes(write(prepare([far], Fineness())).file)
    (folder / "clash.avatar").write_bytes(changed(file, clash))
    (folder / "newer.avatar").write_bytes(changed(file, newer))
    (folder / "index.avatar").write_bytes(changed(file, beyond))
    (folder / "huge.avatar").write_bytes(gzip.compress((1 << 40).to_bytes(8, "little") + bytes(1 << 20)))
    (folder / "twins.avatar").write_bytes(changed(file, twins))


def write_driving(folder: Path) -> None:
    """A pack, and the vectors of driving in the folder beside it."""
    file = (UNITY / "Tests" / "Core" / "Packs" / "joints.avatar.bytes").read_bytes()
    (folder / "driven.avatar").write_bytes(file)
    (folder / "driven.reference").mkdir()
    cases = driving_cases(decode_pack(file, "driven").avatar, "right", GENERATOR)
    for name, content in encode_driving(cases).items():
        (folder / "driven.reference" / name).write_bytes(content)


def test_the_editor_does_what_its_tests_say(program: Path, tmp_path: Path) -> None:
    write_icons(tmp_path)
    write_refused(tmp_path)
    write_driving(tmp_path)
    said = run_core_tests(program, AVATAR_CASES=str(tmp_path))
    assert "ok IconTests.IconsAreWhatPythonDraws" in said
    assert "ok ClipCurvesTests.CurvesAreTheClip(body, 2)" in said


def messages() -> dict[str, str]:
    """The longest fixed part of each message: the file that has it."""
    found = {}
    for folder in ("Runtime", "Editor", "Samples~"):
        for path in (UNITY / folder).rglob("*.cs"):
            for text in MESSAGE.findall(path.read_text("utf-8")):
                part = max(PARTS.split(text), key=len).strip(" .;:'")
                found[part] = path.name
    return found


def test_every_message_is_explained() -> None:
    page = (PAGES / "troubleshooting.md").read_text("utf-8")
    known = {part: file for part, file in messages().items() if len(part) >= LEAST}
    assert len(known) >= 12
    assert {part: file for part, file in known.items() if part not in page} == {}


def test_messages_are_found() -> None:
    text = 'Warnings.Once($"{a}: the first; {b} second", this); throw new Core.AvatarError(\n    "third", x);'
    assert MESSAGE.findall(text) == ["{a}: the first; {b} second", "third"]
