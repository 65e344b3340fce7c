"""Lists of small avatars of all six systems, for batches."""

from __future__ import annotations

import csv
import json
import subprocess
import sys
from collections.abc import Mapping, Sequence
from itertools import cycle, islice
from pathlib import Path

SMALL = {"preview": "no", "reference": "no", "engine_files": "no"}  # columns: what takes longest is left out
ROWS = "rows.json"

Row = Mapping[str, str]


def avatars_in(folder: Path) -> list[Row]:
    """Rows of the avatars in FOLDER/avatars, which are made if they are not there."""
    place = folder / "avatars"
    if not (place / ROWS).exists():
        place.mkdir(parents=True)
        subprocess.run([sys.executable, "-m", "tests.exporter.batch.avatars", str(place)], check=True)
    return rows_of(place)


def mostly_cheap(made: Sequence[Row]) -> list[Row]:
    """Twelve rows: each avatar of `make_all`, and those that convert quickly twice more."""
    cheap = [made[2], made[3], made[5]]
    return [*made, *cheap, *cheap]


def rows_of(folder: Path) -> list[Row]:
    """A row for each avatar of `make_all`: values by column of a list, without names."""
    rows: list[Row] = json.loads((folder / ROWS).read_text())
    return rows


def write_list(path: Path, made: Sequence[Row], count: int, columns: Row = SMALL) -> list[Row]:
    """A CSV of `count` rows over the avatars in `made`, each with names of its own; returns the rows."""
    rows = [
        {**row, **columns, "name": f"row_{index:03d}", "avatar_name": f"avatar {index}"}
        for index, row in enumerate(islice(cycle(made), count))
    ]
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, list(dict.fromkeys(column for row in rows for column in row)))
        writer.writeheader()
        writer.writerows(rows)
    return rows
