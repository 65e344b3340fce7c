"""What is said of each misfit: `python -m tests.exporter.fit.table` writes results/misfits.csv."""

from __future__ import annotations

import csv
import re
import tempfile
from pathlib import Path

from avatar_export import AvatarError
from avatar_export.conversion import read_source
from avatar_export.convert_options import SourceOptions
from avatar_export.notes.text import text
from tests.exporter.fit.misfits import MISFITS, Bases, Given

RESULTS = Path(__file__).parents[3] / "tests" / "results" / "misfits.csv"
FOLDERS = re.compile(r"(?<![\w.])/(?:[^\s/:]+/)+")  # of an absolute path


def said(given: Given) -> str:
    """What `convert` says: "refused: ..." or "warning: ..." in one line, without folders; "" for nothing."""
    source, options = given
    try:
        found = read_source(source, SourceOptions(**options), lambda _: None)
    except AvatarError as error:
        return f"refused: {_plain(str(error))}"
    return " / ".join(
        f"warning: {_plain(text(note))}" for note in (*found.notes, *found.clip_notes) if note.doubtful
    )


def _plain(words: str) -> str:
    return " ".join(FOLDERS.sub("", words).split())


def every(folder: Path) -> dict[str, str]:
    """Misfit -> what is said of it; files are made in `folder`."""
    bases = Bases.make(folder / "bases")
    found = {}
    for number, (name, make) in enumerate(MISFITS.items()):
        own = folder / str(number)
        own.mkdir()
        found[name] = said(make(bases, own))
    return found


def stored() -> dict[str, tuple[str, str]]:
    """Misfit -> (said before, said now), as in the results."""
    with RESULTS.open(newline="", encoding="utf-8") as file:
        return {row["misfit"]: (row["before"], row["now"]) for row in csv.DictReader(file)}


def main() -> None:
    with tempfile.TemporaryDirectory() as folder:
        now = every(Path(folder))
    before = {name: words for name, (words, _) in stored().items()}
    with RESULTS.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(["misfit", "before", "now"])
        writer.writerows([name, before.get(name, ""), words] for name, words in now.items())
    print(f"{sum(map(bool, now.values()))} of {len(now)} misfits found")


if __name__ == "__main__":
    main()
