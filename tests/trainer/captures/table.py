"""Captures with a mistake, and what `check` says.

`python -m tests.trainer.captures.table OUT [--before CHECKOUT]` writes
results/wrong_captures.csv.

OUT is filled with synthetic captures, or holds those of an earlier run. The last rows are right captures, in which
nothing may be found. With --before the captures of the first subject are also given to another checkout's `check`.
"""

from __future__ import annotations

import argparse
import csv
import os
import shutil
import subprocess
import sys
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
SOURCES = ("schema", "engine_shaders", "runtime", "exporter", "trainer")
COLUMNS = ("capture", "wrong", "found", "subjects", "before", "now")
SIZE, FRAMES = 64, 6
INVERTED = Mistake("masks inverted", lambda _: None, "", False)


def main() -> None:
    """The command."""
    parser = argparse.ArgumentParser(prog="python -m tests.trainer.captures.table", description=__doc__)
    parser.add_argument("out", type=Path)
    parser.add_argument("--before", type=Path, help="checkout of the version to compare with")
    arguments = parser.parse_args()
    right = dict(captures(arguments.out))
    takes = [right["head"], right["head with hair and glasses"], right["body"]]
    old = {row["capture"]: row["before"] for row in stored()}
    rows = [_wrong(mistake, takes, arguments.out, arguments.before, old) for mistake in (*MISTAKES, INVERTED)]
    rows += [_right(name, take) for name, take in right.items()]
    with RESULTS.open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, COLUMNS, lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)
    alarms = sum(row["wrong"] == "no" and row["now"] != "" for row in rows)
    named = sum(row["wrong"] == "yes" and row["found"] == row["subjects"] for row in rows)
    print(f"{named} of {len(MISTAKES) + 1} wrong captures named on every subject")
    print(f"{alarms} alarms in {len(right)} right captures")


def stored() -> list[dict[str, str]]:
    """The rows of the results."""
    if not RESULTS.exists():
        return []
    with RESULTS.open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def _wrong(
    mistake: Mistake, takes: list[Path], out: Path, checkout: Path | None, old: dict[str, str]
) -> dict[str, str]:
    """The mistake on each subject; the sentences are those of the first."""
    texts, before = [], old.get(mistake.what, "")
    subjects = takes[: 2 if mistake.faces_only else 3]
    for take in subjects:
        folder = out / "wrong"
        shutil.rmtree(folder, ignore_errors=True)
        made(take, mistake, folder)
        if mistake is INVERTED:
            invert_masks(folder)
        texts.append(_plain(said(folder), folder))
        if checkout is not None and take == takes[0]:
            before = _elsewhere(folder, checkout)
    found = sum(bool(text) and mistake.says in text for text in texts)
    print(f"{mistake.what}: {found} of {len(texts)}", flush=True)
    return _row(mistake.what, "yes", found, len(texts), before, texts[0])


def _right(name: str, take: Path) -> dict[str, str]:
    now = _plain(said(take), take)
    print(f"{name}: {now or 'nothing'}", flush=True)
    return _row(name, "no", int(now != ""), 1, "", now)


def _row(*values: str | int) -> dict[str, str]:
    return dict(zip(COLUMNS, map(str, values), strict=True))


def _plain(text: str, folder: Path) -> str:
    return text.replace(f"{folder}/", "").replace(f"{folder}: ", "").partition(" If they are right")[0]


def _elsewhere(folder: Path, checkout: Path) -> str:
    """What another checkout's `check` ends with; "" if it accepts the capture."""
    paths = os.pathsep.join(str(checkout / source) for source in SOURCES)
    done = subprocess.run(
        [sys.executable, "-m", "avatar_trainer", "check", str(folder)],
        env={**os.environ, "PYTHONPATH": paths}, cwd=folder.parent, capture_output=True, text=True, check=False,
    )  # fmt: skip
    text = done.stderr.strip().splitlines()[-1].partition(": ")[2] if done.returncode else ""
    return _plain(text, folder)


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
