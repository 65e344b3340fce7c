"""What the documents point at is there: files, headings, make targets, commands."""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest

from tests.docs.conftest import SITE

ROOT = Path(__file__).parents[2]
FOLDERS = (
    *(".", "schema", "engine_shaders", "runtime", "samples", "samples/data", "trainer", ".github"),
    *("tests/data/bundles", "tests/data/golden", "players", "players/unity", "players/unity/Documentation~"),
    *("players/unreal", "players/unreal/Docs", "players/native/android", "players/native/ios"),
)
# Paths of the repository in prose: from its root. Words in capitals and stars stand for something else.
SOURCES = "schema|engine_shaders|runtime|exporter|trainer|players|samples|docs|tests"
NAMED = re.compile(rf"`((?:{SOURCES})/[\w./-]+)`")
DOCUMENTS = sorted(
    {*(path for folder in FOLDERS for path in (ROOT / folder).glob("*.md"))} | {*ROOT.glob("docs/**/*.md")}
)


def name_of(path: Path) -> str:
    return path.relative_to(ROOT).as_posix()


def prose_of(document: Path) -> str:
    return re.sub(r"^```.*?^```|`[^`\n]+`", "", document.read_text("utf-8"), flags=re.DOTALL | re.MULTILINE)


def anchors_of(document: Path) -> set[str]:
    headings = re.findall(r"^#+ (.*)$", document.read_text("utf-8"), re.MULTILINE)
    return {re.sub(r"[^\w -]", "", heading.lower()).strip().replace(" ", "-") for heading in headings}


def wrong_links(document: Path, place: Path, made: Callable[[], Path]) -> list[str]:
    """Links of a document that lead nowhere, if it stands at `place`. `made` has the pages that stand in SITE."""
    wrong = []
    for target, anchor in re.findall(r"\]\(([^)#\s]*)#?([^)\s]*)\)", prose_of(document)):
        if re.match(r"[a-z]+:", target):
            wrong += [] if target.startswith("https://") else [target]
            continue
        path = Path(os.path.normpath(place.parent / target)) if target else place
        if path.is_relative_to(SITE):
            path = made() / path.relative_to(SITE)
        elif not path.is_relative_to(ROOT):
            wrong.append(target)
        if not path.exists() or (anchor and anchor not in anchors_of(path)):
            wrong.append(f"{target}#{anchor}")
    return wrong


@pytest.mark.parametrize("document", DOCUMENTS, ids=name_of)
def test_links_lead_somewhere(document: Path, request: pytest.FixtureRequest) -> None:
    assert not wrong_links(document, document, lambda: request.getfixturevalue("command_pages"))


def test_links_of_the_pages_of_commands_lead_somewhere(command_pages: Path) -> None:
    pages = sorted(command_pages.rglob("*.md"))
    assert len(pages) > 25
    wrong = [
        wrong_links(page, SITE / page.relative_to(command_pages), lambda: command_pages) for page in pages
    ]
    assert not [targets for targets in wrong if targets]


@pytest.mark.parametrize("document", DOCUMENTS, ids=name_of)
def test_paths_that_documents_name_exist(document: Path) -> None:
    named = [name for name in NAMED.findall(document.read_text("utf-8")) if not re.search(r"[A-Z]{4,}", name)]
    assert not [name for name in named if not (ROOT / name).exists()]


def test_make_targets_that_documents_name_exist() -> None:
    makefile = (ROOT / "Makefile").read_text("utf-8")
    named = {
        name
        for document in DOCUMENTS
        for name in re.findall(r"(?:^|`)make ([a-z-]+)", document.read_text("utf-8"), re.M)
    }
    assert {"demo", "test", "docs", "bench"} <= named
    assert not [name for name in named if f"\n{name}:" not in makefile]


def test_commands_that_documents_name_exist(command_pages: Path) -> None:
    """By the pages made of the commands' help."""
    known = {
        page.relative_to(command_pages).with_suffix("").as_posix() for page in command_pages.glob("*/*.md")
    }
    known |= {name.rpartition("_")[0] for name in known if name.startswith("avatar-train/asm")}
    found = {
        f"avatar-{program}/{command}"
        for document in DOCUMENTS
        for block in re.findall(r"^```sh\n(.*?)^```", document.read_text("utf-8"), re.M | re.S)
        for program, command in re.findall(r"^avatar-(export|train) ([a-z_]+)", block, re.M)
    }
    assert len(found) > 12
    assert not found - known


TESTS = Path(__file__).parents[1]
DOCS = TESTS.parent / "docs" / "engines"
TESTED = re.compile(r"\*\*\[tested here\]\*\*<!-- ([\w, ]+) -->")  # readers see no name of a test


def test_what_is_called_tested_has_a_test() -> None:
    texts = "\n".join(page.read_text("utf-8") for page in DOCS.glob("*.md"))
    named = {name.strip() for names in TESTED.findall(texts) for name in names.split(",")}
    code = "\n".join(p.read_text("utf-8") for p in TESTS.rglob("test_*.py") if "node_modules" not in p.parts)
    assert len(named) > 40 and not named - set(re.findall(r"^def (test_\w+)", code, re.M))


SOURCE = ROOT / "docs" / "porter" / "first_stage.c"
BUNDLES = [ROOT / "samples" / "trained" / name for name in ("head_blendshapes", "head_splatting")]


def program(text: str, folder: Path) -> Path:
    compiler = shutil.which("cc") or shutil.which("gcc")
    assert compiler, "the guide's program needs a C compiler: sh .ci/packages tests"
    (folder / "first_stage.c").write_text(text, "utf-8")
    flags = ("-std=c99", "-Wall", "-Wextra", "-Werror", "-O2")
    subprocess.run([compiler, *flags, "-o", "first_stage", "first_stage.c", "-lm"], cwd=folder, check=True)
    return folder / "first_stage"


def test_it_agrees_with_every_case(tmp_path: Path) -> None:
    first_stage = program(SOURCE.read_text("utf-8"), tmp_path)
    for bundle in BUNDLES:
        cases = json.loads((bundle / "reference" / "cases.json").read_text("utf-8"))["cases"]
        names = [case["name"] for case in cases if any(stage["stage"] == "skin" for stage in case["stages"])]
        assert len(names) >= 3
        for name in names:
            command = [first_stage, bundle, name]
            done = subprocess.run(command, capture_output=True, text=True, check=False)
            assert done.returncode == 0 and "right" in done.stdout, done.stdout + done.stderr


@pytest.mark.parametrize(
    ("right", "wrong"),
    [
        ("posed += late_weight", "posed -= late_weight"),
        ("skin_weight[e] * matrix", "skin_weight[e] * NAN * matrix"),
        ("float posed = m[0]", "float posed = (row ? 0.0f : NAN) + m[0]"),  # one vertex alone
    ],
)
def test_it_notices_a_fault(right: str, wrong: str, tmp_path: Path) -> None:
    text = SOURCE.read_text("utf-8")
    assert right in text
    first_stage = program(text.replace(right, wrong), tmp_path)
    done = subprocess.run([first_stage, BUNDLES[0], "posed"], capture_output=True, text=True, check=False)
    assert done.returncode == 1 and "WRONG" in done.stdout
