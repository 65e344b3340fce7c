"""`python -m tools.fuzz.readers`: the four readers of packs judge the same mutants; counts where they disagree.

Python, TypeScript, C++ and C# must give one verdict, and of a pack that is taken the same tensors and pose numbers.
"""

from __future__ import annotations

import argparse
import base64
import contextlib
import json
import subprocess
import sys
import tempfile
import time
from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from random import Random
from typing import Any

import numpy as np
from tests.exporter.packing.cases import AVATARS, COARSE, levels_of
from tests.players.hostile.judges import GUARDED

from avatar_export.measure.framing import framing
from avatar_export.packing.write import driving_facts, prepare, write
from avatar_export.relight import relightable
from avatar_runtime.handedness import mirrored
from tools.fuzz.pack_mutants import mutant

GOLDEN = Path(__file__).parents[2] / "tests" / "data" / "packs" / "1.0"

BATCH = 256
TOLERANCE = 1e-5  # of pose numbers, of the largest one of a pose or 1: that of the kit for stage joints
Said = dict[str, Any]


class Judge:
    """One reader, in a process of its own."""

    def __init__(self, name: str, command: list[str]) -> None:
        self.name, self._command = name, command
        self._process = self._started()

    def _started(self) -> subprocess.Popen[bytes]:
        pipe, away = subprocess.PIPE, subprocess.DEVNULL
        return subprocess.Popen(self._command, stdin=pipe, stdout=pipe, stderr=away)

    def judge(self, packs: list[bytes]) -> list[Said]:
        """What it says of each. If it ends, that is a crash, and it is started anew."""
        return [self._judge(pack) for pack in packs]  # one by one: no pipe is ever full on both sides

    def _judge(self, pack: bytes) -> Said:
        stdin, stdout = self._process.stdin, self._process.stdout
        assert stdin is not None and stdout is not None
        line = b""
        with contextlib.suppress(BrokenPipeError):
            stdin.write(len(pack).to_bytes(4, "little") + pack)
            stdin.flush()
            line = stdout.readline()
        if line:
            said: Said = json.loads(line)
            return said
        code, self._process = self._process.wait(), self._started()
        return {"ok": "crash", "why": f"crash: it ended with {code}"}

    def most_memory(self) -> int:
        """The most bytes that it has held; Linux says them."""
        text = Path(f"/proc/{self._process.pid}/status").read_text("utf-8")
        return 1024 * int(text.partition("VmHWM:")[2].split()[0])

    def end(self) -> None:
        """Lets it go."""
        with self._process:
            self._process.kill()


def difference(said: dict[str, Said]) -> str:
    """What the judges disagree about; "" if nothing."""
    if len({one["ok"] for one in said.values()}) > 1:
        return "verdict"
    verdict = next(iter(said.values()))["ok"]
    if verdict is not True:
        return "all crash" if verdict else ""
    for part in ("buffers", "arrays", "clips"):
        if len({one[part] for one in said.values()}) > 1:
            return part
    first, *others = (one["poses"] for one in said.values())
    angles = max(one.get("largest", 1.0) for one in said.values())
    for name, floats in first.items():
        tolerance = TOLERANCE * (angles if name == "driven" else 1)
        if any(_apart(floats, other[name], tolerance) for other in others):
            return f"pose {name}"
    return ""


def _apart(one: str, other: str, tolerance: float) -> bool:
    a, b = (np.frombuffer(base64.b64decode(text), "<f4").astype(np.float64) for text in (one, other))
    if a.shape != b.shape:
        return True
    sound = np.isfinite(a) & np.isfinite(b)
    if not (np.isfinite(a) == np.isfinite(b)).all():
        return True
    size = max(float(np.abs(a[sound]).max(initial=0)), 1.0)
    return bool((np.abs(a[sound] - b[sound]) > tolerance * size).any())


def bases() -> list[bytes]:
    """Sound packs of every kind: small, wide, exact, embedded, left-handed, relit, with levels, names, no driving."""
    made = [path.read_bytes() for path in sorted(GOLDEN.glob("*.avatar"))]
    joints, surface = AVATARS["joints"], AVATARS["surface"]
    named = replace(joints, driving=replace(joints.driving, mode="names", inputs=(), outputs=(), matrix=None))
    error = {"psnr_mask_db": {"mean": 50.0, "worst": None}}
    facts = {"framing": framing(named), **driving_facts(named), "error": error}
    made.append(write(prepare(levels_of(named), COARSE), facts, b"a picture").file)
    made.append(write(prepare(levels_of(surface), COARSE), {"packing": {}}).file)
    made.append(write(prepare([relightable(joints)], COARSE), driving_facts(joints)).file)
    made.append(write(prepare(levels_of(relightable(surface)), COARSE)).file)
    left = mirrored(joints)
    return [*made, write(prepare([left], COARSE), driving_facts(left), None, "left").file]


def compare(count: int, seed: int, names: list[str], keep: Path, most: int) -> Counter[str]:
    """How often the readers took, refused and disagreed; what they disagree about is kept in a folder."""
    rng, whole, tally, kept = Random(seed), bases(), Counter[str](), 0
    with tempfile.TemporaryDirectory() as folder, ThreadPoolExecutor(len(names)) as pool:
        judges = [Judge(name, GUARDED[name](Path(folder))) for name in names]
        began = time.monotonic()
        for first in range(0, count, BATCH):
            packs = [mutant(rng.choice(whole), rng) for _ in range(min(BATCH, count - first))]
            said = list(pool.map(Judge.judge, judges, [packs] * len(judges)))
            for number, pack in enumerate(packs):
                ours = {judge.name: said[k][number] for k, judge in enumerate(judges)}
                what = difference(ours)
                tally["differ" if what else "taken" if ours[names[0]]["ok"] else "refused"] += 1
                tally[f"differ: {what}"] += bool(what)
                if what and kept < most:
                    keep.mkdir(parents=True, exist_ok=True)
                    path = keep / f"{seed}-{first + number}.avatar"
                    path.write_bytes(pack)
                    part = ("why", "taken") if what == "verdict" else (what, None)
                    short = {name: one.get(*part) for name, one in ours.items()}
                    print(f"{path.name}: {what}: {json.dumps(short)[:900]}", flush=True)
                    kept += 1
            if sys.stderr.isatty():
                print(f"\r{first + len(packs)} in {time.monotonic() - began:.0f} s", end="", file=sys.stderr)
        for judge in judges:
            judge.end()
    return +tally


def main() -> None:
    """Print the figures; the exit code is 1 where readers disagree."""
    parser = argparse.ArgumentParser(prog="python -m tools.fuzz.readers", description=__doc__)
    parser.add_argument("--mutants", type=int, default=100_000, help="of each seed")
    parser.add_argument("--seed", type=int, action="append", help="may be repeated; 1, 2 and 3 by default")
    parser.add_argument("--reader", choices=GUARDED, action="append", help="these alone; may be repeated")
    kept = Path("out/disagreements")
    parser.add_argument("--keep", type=Path, default=kept, help="folder for what they differ in")
    parser.add_argument("--most", type=int, default=40, help="mutants that are kept and shown")
    given = parser.parse_args()
    wrong = 0
    for seed in given.seed or (1, 2, 3):
        tally = compare(given.mutants, seed, given.reader or list(GUARDED), given.keep, given.most)
        print(f"seed {seed}: {given.mutants} mutants, {dict(tally)}")
        wrong += tally["differ"]
    sys.exit(1 if wrong else 0)


if __name__ == "__main__":
    main()
