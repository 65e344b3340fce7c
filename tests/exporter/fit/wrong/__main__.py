"""`python -m tests.exporter.fit.wrong`: how many cases of each mistake are found as stated, and the false alarms."""

from __future__ import annotations

import argparse
import csv
import shutil
import tempfile
from dataclasses import fields
from pathlib import Path

from tests.exporter.fit.table import said
from tests.exporter.fit.wrong import doubtful, known
from tests.exporter.fit.wrong.inputs import Inputs
from tests.exporter.fit.wrong.line import tried

LINES = (*known.LINES, *doubtful.LINES)
RESULTS = Path(__file__).parents[4] / "tests" / "results" / "wrong_files.csv"
COLUMNS = ("mistake", "stated", "case", "found", "said")


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m tests.exporter.fit.wrong", description=__doc__)
    parser.add_argument("--only", default="", help="lines with this text alone; other rows stay")
    only = parser.parse_args().only
    rows: list[tuple[str, ...]] = []
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        inputs = Inputs.make(folder / "sound")
        for line in LINES:
            if only not in line.mistake:
                rows += [tuple(row.values()) for row in stored() if row["mistake"] == line.mistake]
                continue
            found = []
            for case, make in line.cases.items():
                text = tried(make, inputs, folder / "case")
                shutil.rmtree(folder / "case")
                found.append(line.found(text))
                rows.append((line.mistake, line.stated, case, "yes" if found[-1] else "no", text))
                if not found[-1]:
                    print(f"   missed: {case}: {text[:160]}")
            print(f"{line.mistake}: {sum(found)} of {len(found)} {line.stated}")
        sound = [field.name for field in fields(inputs) if field.name != "bases"]
        alarms = {one: said(getattr(inputs, one)) for one in sound}
    wrong = {one: text for one, text in alarms.items() if text}
    count = sum(row[3] == "yes" for row in rows)
    print(
        f"{count} of {len(rows)} as stated; false alarms: {len(wrong)} of {len(sound)} sound inputs {wrong or ''}"
    )
    with RESULTS.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerows([COLUMNS, *rows])
        writer.writerows(("", "", one, "no" if text else "yes", text) for one, text in alarms.items())


def stored() -> list[dict[str, str]]:
    """The rows as they were written."""
    with RESULTS.open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


if __name__ == "__main__":
    main()
