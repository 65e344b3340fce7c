"""Hostile inputs that look for code which none before them has reached, by atheris; nothing where it is not installed.

The bytes that atheris makes are the draws of the mutations, so that what it learns keeps the structure of the files.
"""

from __future__ import annotations

import argparse
import importlib.util
import re
import subprocess
import sys
import tempfile
from random import Random

SECONDS = 60  # of each target


class Draws(Random):
    """A generator whose numbers are given; behind their end all are 0."""

    def __init__(self, data: bytes) -> None:
        super().__init__(0)
        self._data, self._at = data, 0

    def getrandbits(self, k: int, /) -> int:
        """The next `k` bits."""
        size = -(-k // 8)
        piece = self._data[self._at : self._at + size].ljust(size, b"\0")
        self._at += size
        return int.from_bytes(piece, "little") >> (8 * size - k)

    def random(self) -> float:
        """The next number from 0 to 1."""
        return self.getrandbits(53) * 2.0**-53


def main() -> None:
    """Attack every target for some time; the exit code is 1 after a finding."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=int, default=SECONDS, help="of each target")
    parser.add_argument("--target", action="append")
    given = parser.parse_args()
    if importlib.util.find_spec("atheris") is None:
        print("atheris is not installed: no guided inputs (pip install atheris)")
        return
    from tools.fuzz.targets import TARGETS

    failed = []
    for name in given.target or TARGETS:
        words = [sys.executable, "-m", "tools.fuzz.guided_target", name, str(given.seconds)]
        with tempfile.TemporaryDirectory(prefix="avatar-guided-") as folder:
            ended = subprocess.run([*words, folder], capture_output=True, text=True, check=False)
        said = re.search(r"Done (\d+) runs in (\d+) second", ended.stderr)
        memory = re.search(r"peak_rss_mb:\s*(\d+)", ended.stderr)
        figures = f"{said[1]} inputs in {said[2]} s" if said else "ended early"
        most = f"most memory {memory[1] if memory else '?'} MB"
        print(f"{name}: {figures}, {most}, exit code {ended.returncode}", flush=True)
        if ended.returncode:
            failed.append(f"{name}: {ended.stdout[-1500:]}{ended.stderr[-1500:]}")
    print("\n".join(failed))
    sys.exit(1 if failed else 0)


if __name__ == "__main__":
    main()
