"""The GUIDs of the Unity package: each asset has one in the table, and those of the first package never change."""

from __future__ import annotations

import csv
import re
import shutil
from pathlib import Path

import pytest
from tools.unity_project import ProjectError, add_rows

from avatar_export.players import unity
from avatar_runtime.io.errors import AvatarError

ROOT = Path(__file__).parents[3]
WRITTEN = ROOT / "players" / "unity"
FIRST = ROOT / "tests" / "data" / "unity_guids.csv"  # as of 5bf3be5, when each .meta file was in git
NAMED = "Core/LoadedAvatar.cs"
ADD = "run `make unity`, which adds rows for new files and says what is wrong with others"


@pytest.fixture
def package(tmp_path: Path) -> Path:
    """A copy of the hand-written files."""
    return Path(shutil.copytree(WRITTEN, tmp_path / "unity", ignore=shutil.ignore_patterns("*.meta")))


def found(root: Path) -> set[str]:
    return set(unity.assets([*unity.hand_written(root), *unity.unity_made(root)]))


def test_every_asset_has_one_row_and_every_row_an_asset() -> None:
    assert sorted(found(WRITTEN) ^ unity.guids(WRITTEN).keys()) == [], ADD
    head, *rows = (WRITTEN / unity.TABLE).read_text("utf-8").splitlines()
    assert head == "path,guid" and rows == sorted(rows, key=lambda row: row.rpartition(",")[0])
    table = unity.guids(WRITTEN)
    assert len(table) == len({*table.values()}) == len(rows)
    assert all(re.fullmatch("[0-9a-f]{32}", guid) for guid in table.values())


def test_guids_of_the_first_package_are_kept() -> None:
    """A file may get another path, its GUID may not: scenes and prefabs of users point at it."""
    with FIRST.open(encoding="utf-8", newline="") as file:
        first = {row["path"]: row["guid"] for row in csv.DictReader(file)}
    now = unity.guids(WRITTEN)
    assert len(first) == 263
    lost = [path for path, guid in first.items() if guid not in now.values()]
    assert lost == [], "a renamed file keeps its row under the new path"
    assert not [path for path in first.keys() & now.keys() if first[path] != now[path]]


def test_a_file_without_a_row_is_refused(package: Path) -> None:
    with pytest.raises(AvatarError, match=r"^guids.csv: Core/New.cs has no GUID: run `make unity`"):
        unity.metas([*unity.hand_written(package), "Core/New.cs"], unity.guids(package))


def test_new_files_get_rows(package: Path) -> None:
    """The GUID that Unity gave, or one of the path, which stays the same for the same path."""
    unitys, before = "0123456789abcdef" * 2, unity.guids(package)
    (package / "Core" / "Seen").mkdir()
    for name in ("Core/Seen/A.cs", "Core/B.cs"):
        (package / name).write_text("// new\n", "utf-8")
    (package / "Core/Seen/A.cs.meta").write_text(
        f"fileFormatVersion: 2\nguid: {unitys}\nMonoImporter:\n", "utf-8"
    )
    assert add_rows(package) == ["Core/B.cs", "Core/Seen", "Core/Seen/A.cs"]
    after = unity.guids(package)
    assert before.items() <= after.items() and after["Core/Seen/A.cs"] == unitys
    assert list(after) == sorted(after) and len({*after.values()}) == len(after)
    assert add_rows(package) == [] and unity.guids(package) == after


def test_a_file_moved_or_copied_with_its_meta(package: Path) -> None:
    """A moved one keeps its GUID, a copied one gets one of its own."""
    guid = unity.guids(package)[NAMED]
    for name in ("Core/Pose/Moved.cs", "Core/Copy.cs"):
        (package / f"{name}.meta").write_text(f"fileFormatVersion: 2\nguid: {guid}\n", "utf-8")
    (package / "Core/Copy.cs").write_text("// copy\n", "utf-8")
    assert add_rows(package) == ["Core/Copy.cs"]
    assert unity.guids(package)["Core/Copy.cs"] != guid == unity.guids(package)[NAMED]
    (package / NAMED).rename(package / "Core/Pose/Moved.cs")
    assert add_rows(package) == ["Core/Pose/Moved.cs"]
    assert unity.guids(package)["Core/Pose/Moved.cs"] == guid
    assert NAMED not in unity.guids(package)


def test_a_file_renamed_outside_of_unity_is_asked_about(package: Path) -> None:
    table = (package / unity.TABLE).read_text("utf-8")
    (package / NAMED).rename(package / "Core/Renamed.cs")
    with pytest.raises(
        ProjectError, match=rf"guids.csv: {NAMED} is gone. If it was renamed, write its new path"
    ):
        add_rows(package)
    assert (package / unity.TABLE).read_text("utf-8") == table
    (package / unity.TABLE).write_text(table.replace(f"{NAMED},", "Core/Renamed.cs,"), "utf-8")
    assert add_rows(package) == []
