"""Captures with a mistake, and what `check` says.

`python -m tests.trainer.captures.table OUT` writes results/wrong_captures.csv. OUT is filled with synthetic captures,
or holds those of an earlier run. The last rows are right captures, in which nothing may be found.
"""

from __future__ import annotations

import argparse
import csv
import shutil
from collections.abc import Iterator
from pathlib import Path

from samples.capture.body import write_body
from samples.capture.head import write_head
from samples.capture.shots import Noise

from avatar_runtime.io.errors import AvatarError
from avatar_trainer.captures.checks.verdict import judge
from avatar_trainer.captures.load import load
from tests.trainer.captures import vhap_files
from tests.trainer.captures.wrong import MISTAKES, Mistake, invert_masks, made

ROOT = Path(__file__).parents[3]
RESULTS = ROOT / "tests" / "results" / "wrong_captures.csv"
COLUMNS = ("capture", "wrong", "found", "subjects", "now")
SIZE, FRAMES = 64, 6
INVERTED = Mistake("masks inverted", lambda _: None, "", False)


def main() -> None:
    """The command."""
    parser = argparse.ArgumentParser(prog="python -m tests.trainer.captures.table", description=__doc__)
    parser.add_argument("out", type=Path)
    out = parser.parse_args().out
    right = dict(captures(out))
    takes = [right["head"], right["head with hair and glasses"], right["body"]]
    rows = [_wrong(mistake, takes, out) for mistake in (*MISTAKES, INVERTED)]
    for name, take in right.items():
        now = _plain(said(take), take)
        rows.append((name, "no", int(now != ""), 1, now))
    with RESULTS.open("w", newline="", encoding="utf-8") as file:
        csv.writer(file, lineterminator="\n").writerows([COLUMNS, *rows])


def _wrong(mistake: Mistake, takes: list[Path], out: Path) -> tuple[str | int, ...]:
    """The mistake on each subject; the sentences are those of the first."""
    texts, folder = [], out / "wrong"
    for take in takes[: 2 if mistake.faces_only else 3]:
        shutil.rmtree(folder, ignore_errors=True)
        made(take, mistake, folder)
        if mistake is INVERTED:
            invert_masks(folder)
        texts.append(_plain(said(folder), folder))
    found = sum(bool(text) and mistake.says in text for text in texts)
    return mistake.what, "yes", found, len(texts), texts[0]


def _plain(text: str, folder: Path) -> str:
    return text.replace(f"{folder}/", "").replace(f"{folder}: ", "").partition(" If they are right")[0]


def said(folder: Path) -> str:
    """What is found wrong or odd in a capture; "" for nothing."""
    try:
        capture = load(folder)
        verdict = judge(capture)
        verdict.refuse(capture)
    except AvatarError as error:
        return str(error)
    return "; ".join(verdict.odd)


def captures(out: Path) -> Iterator[tuple[str, Path]]:
    """Right captures by name, made in `out` where they are not there yet."""
    makers = {
        "head": lambda to: write_head(to, SIZE, FRAMES, Noise()),
        "head with hair and glasses": lambda to: write_head(
            to, SIZE, FRAMES, Noise(), worn=("hair", "glasses")
        ),
        "body": lambda to: write_body(to, SIZE, FRAMES, Noise()),
        "head, trackers' noise 0.02": lambda to: write_head(to, SIZE, FRAMES, Noise(tracking=0.02)),
        "head, trackers' noise 0.1": lambda to: write_head(to, SIZE, FRAMES, Noise(tracking=0.1)),
        "head, noise of calibration 0.005": lambda to: write_head(to, SIZE, FRAMES, Noise(calibration=0.005)),
        "body, trackers' noise 0.02": lambda to: write_body(to, SIZE, FRAMES, Noise(tracking=0.02)),
        "head, as VHAP exports it": lambda to: vhap_files.write(out / "head", to),
    }
    for name, make in makers.items():
        folder = out / name.replace(" ", "_").replace(",", "").replace("'", "")
        if not (folder / "images").is_dir():
            make(folder)
        yield name, folder


if __name__ == "__main__":
    main()
