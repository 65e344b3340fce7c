"""What README.md says of buffers, kernels, files and cases is so."""

from __future__ import annotations

import re
from collections.abc import Iterator

from avatar_shaders import ENTRIES, reflection
from avatar_shaders.generate import PACKAGE
from tests.conformance.cases import CASES
from tests.conformance.faults import FAULTS

README = (PACKAGE.parent / "README.md").read_text("utf-8")
TABLE = reflection("glsl430")


def rows(section: int) -> Iterator[list[str]]:
    """Cells of the last table of a numbered section, without its head."""
    text = re.split(r"^## \d+\. .*$", README, flags=re.MULTILINE)[section]
    last = re.findall(r"(?:^\|.*\n)+", text, re.MULTILINE)[-1]
    lines = last.splitlines()
    for line in lines[2:]:
        yield [cell.strip() for cell in line.strip("|").split("|")]


def quoted(cell: str) -> list[str]:
    return re.findall(r"`([^`]+)`", cell)


def test_entries_bind_what_the_table_says() -> None:
    told = {}
    for entry, file, binds, threads in rows(4):
        writes = {name: f"`{name}` rw" in binds for name in quoted(binds)}
        told[quoted(entry)[0]] = (quoted(file)[0], list(writes.items()), threads)
    assert list(told) == list(ENTRIES)
    for name, row in TABLE.items():
        bound = [(s["name"], not s["readonly"]) for s in row["storage"]]
        bound += [(t["name"], False) for t in row["textures"]]
        threads = str(row["thread_group"][0]) if "thread_group" in row else ""
        assert told[name] == (row["hlsl"], bound, threads)


def test_every_buffer_is_described_with_its_element() -> None:
    told = {quoted(buffer)[0]: element for buffer, element, _ in rows(5)}
    bound = {s["name"]: s["type"] for row in TABLE.values() for s in row["storage"]}
    assert told == bound


def test_every_entry_has_its_place_in_the_order() -> None:
    steps = [(int(step), name) for step, entries, *_ in rows(3) for name in quoted(entries)]
    assert sorted(name for _, name in steps) == sorted(ENTRIES)
    assert [step for step, _ in steps] == sorted(step for step, _ in steps)


def test_every_section_of_a_static_buffer_is_named() -> None:
    sections: dict[str, set[str]] = {}
    for row in TABLE.values():
        for name, told in row.get("access", {}).get("sections", {}).items():
            sections.setdefault(told["buffer"], set()).add(name)
    told_of = {quoted(buffer)[0]: set(quoted(contents)) for buffer, _, contents in rows(5)}
    static = {name for name in told_of if name.endswith("Static")}
    assert static == set(sections)
    for buffer in static:
        named = told_of[buffer] - static - {"bary_vertex_lbs", "triangle_frame"}  # values of rules
        assert named == sections[buffer], buffer


def test_every_key_of_access_is_explained() -> None:
    keys = {key for row in TABLE.values() for key in row.get("access", {})}
    assert {name for key, _ in rows(6) for name in quoted(key)} == keys


def test_traps_name_cases_and_faults_that_exist() -> None:
    cases = {f"{row.avatar}/{row.name}" for row in CASES}
    caught = {fault.name: fault.case for fault in FAULTS}
    named = set()
    for trap, _, case, fault in rows(11):
        assert set(quoted(case)) - {"gl", "vertex_ids"} <= cases, trap
        for name in quoted(fault):
            assert caught[name] in quoted(case), trap
        named |= set(quoted(fault))
    assert named == set(caught)


def test_files_that_are_named_are_there() -> None:
    root = PACKAGE.parent.parent
    for path in re.findall(r"`((?:avatar_shaders|unreal|web)/[\w./]*|\w+\.hlsl)`", README):
        places = (PACKAGE.parent / path, PACKAGE / "hlsl" / path, root / "players/unity/Shaders" / path)
        assert any(place.exists() for place in places), path
    for path in re.findall(r"`((?:schema|tests|players)/[\w./]+)`", README):
        assert (root / path).exists(), path
