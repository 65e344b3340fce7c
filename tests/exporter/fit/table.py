"""What is said of each misfit: `python -m tests.exporter.fit.table [--before CHECKOUT]` writes results/misfits.csv.

With --before the files are also given to the code of another checkout, in a process of its own.
"""

from __future__ import annotations

import argparse
import csv
import json
import os
import re
import subprocess
import sys
import tempfile
from pathlib import Path

from avatar_export import AvatarError, ReadOptions, read
from tests.exporter.fit.misfits import MISFITS, Bases, Given

ROOT = Path(__file__).parents[3]
RESULTS = ROOT / "tests" / "results" / "misfits.csv"
DOUBT = "doubtful: "
FOLDERS = re.compile(r"(?<![\w.])/(?:[^\s/:]+/)+")  # of an absolute path
SOURCES = ("schema", "engine_shaders", "runtime", "exporter", "trainer")


def said(given: Given) -> str:
    """ "refused: ..." or "warning: ..." in one line, without the names of folders; "" if nothing is said."""
    source, options = given
    try:
        notes = read(source, ReadOptions(**options)).provenance["notes"]
    except AvatarError as error:
        return f"refused: {_plain(str(error))}"
    doubts = [note.removeprefix(DOUBT) for note in notes if note.startswith(DOUBT)]
    return " / ".join(f"warning: {_plain(doubt)}" for doubt in doubts)


def _plain(text: str) -> str:
    return " ".join(FOLDERS.sub("", text).split())


def every(folder: Path) -> dict[str, str]:
    """Misfit -> what is said of it; files are made in `folder`."""
    bases = Bases.make(folder / "bases")
    found = {}
    for number, (name, make) in enumerate(MISFITS.items()):
        own = folder / str(number)
        own.mkdir()
        found[name] = said(make(bases, own))
    return found


def _elsewhere(checkout: Path) -> dict[str, str]:
    paths = [str(checkout / source) for source in SOURCES] + [str(checkout), str(ROOT)]
    done = subprocess.run(
        [sys.executable, "-m", "tests.exporter.fit.table", "--json"],
        env={**os.environ, "PYTHONPATH": os.pathsep.join(paths)}, cwd=ROOT, capture_output=True, text=True, check=True,
    )  # fmt: skip
    found: dict[str, str] = json.loads(done.stdout)
    return found


def stored() -> dict[str, tuple[str, str]]:
    """Misfit -> (said before, said now), as in the results."""
    if not RESULTS.exists():
        return {}
    with RESULTS.open(newline="", encoding="utf-8") as file:
        return {row["misfit"]: (row["before"], row["now"]) for row in csv.DictReader(file)}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--before", type=Path, help="checkout of the version to compare with")
    parser.add_argument("--json", action="store_true", help="print what this version says, write nothing")
    args = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        now = every(Path(folder))
    if args.json:
        print(json.dumps(now))
        return
    old = {name: before for name, (before, _) in stored().items()}
    before = old if args.before is None else _elsewhere(args.before)
    with RESULTS.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(["misfit", "before", "now"])
        writer.writerows([name, before.get(name, ""), text] for name, text in now.items())
    print(
        f"{sum(map(bool, now.values()))} of {len(now)} misfits found; {sum(map(bool, before.values()))} before"
    )


if __name__ == "__main__":
    main()
