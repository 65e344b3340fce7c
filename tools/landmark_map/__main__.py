"""`python -m tools.landmark_map OUT`: draws heads, asks MediaPipe, writes OUT, and reports on held-out people."""

from __future__ import annotations

import argparse
from pathlib import Path

from samples.capture.head import blinking_head

from tools.landmark_map import table
from tools.landmark_map.faces import Detector, Faces, Studio, gathered, photographed

PEOPLE, PICTURES, SKINS = 72, 25, 16
SEED = 0


def drawn(folder: Path, people: int) -> list[Path]:
    """A file for each person in `folder`, those that are there already as they are; every other person is a film."""
    paths = [folder / f"{number:03d}.npz" for number in range(people)]
    missing = [path for path in paths if not path.exists()]
    if missing:
        studio, detector = Studio(SKINS, SEED), Detector()
    for path in missing:
        number = int(path.stem)
        rows = [row for _, row in photographed(studio, detector, number, PICTURES, film=bool(number % 2))]
        if rows:
            gathered(rows).save(path)
    return [path for path in paths if path.exists()]


def main() -> None:
    """The command."""
    parser = argparse.ArgumentParser(prog="python -m tools.landmark_map", description=__doc__)
    parser.add_argument("out", type=Path, help="the table to write, .npz")
    parser.add_argument(
        "--cache", type=Path, default=Path(".cache/landmark_map"), help="keeps what was drawn"
    )
    parser.add_argument("--people", type=int, default=PEOPLE, help="of whom each is drawn 25 times")
    given = parser.parse_args()
    faces = Faces.load(drawn(given.cache, given.people))
    print(*table.write(given.out, faces, blinking_head()), sep="\n")


if __name__ == "__main__":
    main()
