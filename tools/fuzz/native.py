"""The native player's loader under libFuzzer: packs and inflated bodies, millions of them.

It begins with a few rows of every sample, and of the packs of the tests; all samples are tried once as they are. Past
findings lie in tests/data/fuzz/native and are tried first.
"""

from __future__ import annotations

import argparse
import os
import re
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

from bench.pack_avatars import AVATARS
from tests.session.native import NATIVE, SANITIZED, build

from avatar_export.packing.steps import Fineness
from avatar_export.packing.write import pack
from tools.fuzz.native_seeds import small, tiny, write_seeds

ROOT = Path(__file__).parents[2]
CORPUS = ROOT / "tests" / "data" / "fuzz" / "native"
PACKS = sorted((ROOT / "tests" / "data" / "packs" / "1.0").glob("*.avatar"))
RUNS = 10_000_000
SAMPLES = [
    name for name in AVATARS if not name.startswith("head_70000_")
]  # the others differ in large numbers
LIMITS = ["-max_len=100000", "-timeout=10", "-rss_limit_mb=2048"]
# A shell's child: the system counts Python's own memory as that of a child of Python.
ALONE = ["sh", "-c", '"$@"; exit $?', "sh"]
# Freed memory is held back for as long as an input takes, and no more of each call is noted than who allocated.
ASAN = "quarantine_size_mb=8:thread_local_quarantine_size_kb=64:malloc_context_size=4"


def fuzzer() -> Path:
    """The program, kept until a source changes."""
    return build("fuzz", sorted((NATIVE / "fuzz").glob("*.cpp")), SANITIZED, ["-fsanitize=fuzzer"])


def fuzz(seconds: int, runs: int, packs: Sequence[bytes], seed: int = 0) -> str:
    """What libFuzzer says of its run, "stat::" lines included. Raises RuntimeError for a finding."""
    with tempfile.TemporaryDirectory(prefix="avatar-native-") as name:
        seeds, listed = Path(name, "seeds"), Path(name, "listed")
        seeds.mkdir()
        write_seeds(seeds, packs)
        # Inputs by name, no folder: what the fuzzer finds worth keeping stays in memory.
        listed.write_text(",".join(map(str, [*sorted(CORPUS.glob("*")), *sorted(seeds.iterdir())])))
        words = [f"-max_total_time={seconds}", f"-runs={runs}", f"-seed={seed}", "-print_final_stats=1"]
        return _run([*words, "-entropic_scale_per_exec_time=1", f"-seed_inputs=@{listed}"])


def try_once(files: Sequence[Path]) -> str:
    """Tries files as they are. Raises RuntimeError for a finding."""
    return _run(list(map(str, files)))


def _run(words: Sequence[str]) -> str:
    program = fuzzer()
    CORPUS.mkdir(parents=True, exist_ok=True)  # past findings are read, new ones kept
    with tempfile.TemporaryDirectory(prefix="avatar-native-") as made:
        command = [*ALONE, str(program), *LIMITS, f"-artifact_prefix={made}/", *words]
        own = {**os.environ, "ASAN_OPTIONS": ASAN}
        said = Path(made, "said.txt")  # for those who watch a long run
        with said.open("wb") as out:
            done = subprocess.run(command, env=own, stdout=out, stderr=out, check=False)
        text = said.read_text(errors="replace")
        if done.returncode == 0:
            return text
        for finding in Path(made).glob("*-*"):
            (CORPUS / finding.name).write_bytes(finding.read_bytes())
    raise RuntimeError(text[-6000:])


def samples(folder: Path) -> tuple[list[Path], list[bytes]]:
    """Files of all samples, and packs of a few of their rows."""
    whole, cut = [], []
    for name in SAMPLES:
        avatar = AVATARS[name].load(folder)
        whole.append(folder / f"{name}.avatar")
        whole[-1].write_bytes(pack([avatar], Fineness()).file)
        cut.append(small(avatar))
    return whole, cut


def executions(said: str) -> int:
    """How many inputs a run tried."""
    found = re.findall(r"stat::number_of_executed_units:\s*(\d+)|^#(\d+):", said, re.MULTILINE)
    return int(next(filter(None, found[-1]))) if found else 0


def peak_mb(said: str) -> int:
    """The most memory that a run took."""
    found = re.findall(r"stat::peak_rss_mb:\s*(\d+)", said)
    return int(found[-1]) if found else 0


def main() -> None:
    """Runs until so many inputs have been tried; the exit code is 1 after a finding."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=RUNS)
    parser.add_argument("--seconds", type=int, default=0, help="stop after this time; 0: none")
    given = parser.parse_args()
    try:
        with tempfile.TemporaryDirectory(prefix="avatar-samples-") as folder:
            whole, cut = samples(Path(folder))
            try_once([*whole, *PACKS])
        said = fuzz(given.seconds, given.runs, [*cut, *tiny()])
    except RuntimeError as error:
        print(error)
        sys.exit(1)
    print(f"native: {executions(said)} inputs, no finding; {peak_mb(said)} MB at most")


if __name__ == "__main__":
    main()
