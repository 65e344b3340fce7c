"""What `convert` costs in this tree and in an older commit: CPU seconds of a process, the two in turns.

python -m tests.bench.convert_cost OUT --against REVISION [--gaussians 70000] [--rounds 3]
"""

from __future__ import annotations

import argparse
import resource
import statistics
import subprocess
from pathlib import Path

from tests.bench.bundle_bytes import ROOT, run


def children_s() -> float:
    """CPU seconds of all processes that have ended."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def converted_s(tree: Path, sample: Path, out: Path) -> float:
    """CPU seconds of one conversion with the code of `tree`."""
    before = children_s()
    arguments = (f"{sample}/model", "--dataset", str(sample), "-o", str(out), "--force")
    run(tree, "-m", "avatar_export", "convert", *arguments)
    return children_s() - before


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("out", type=Path)
    parser.add_argument("--against", required=True, metavar="REVISION")
    parser.add_argument(
        "--gaussians", type=int, default=70_000, help="of the face; the teeth have a fifth as many"
    )
    parser.add_argument("--rounds", type=int, default=3)
    given = parser.parse_args()
    out, old = given.out.absolute(), given.out.absolute() / "tree"
    out.mkdir(parents=True)
    subprocess.run(
        ["git", "-C", ROOT, "worktree", "add", "--quiet", "--detach", old, given.against], check=True
    )
    try:
        make = ("-m", "samples.make", "--system", "gaussian_blendshapes", "--gaussians", str(given.gaussians))
        run(ROOT, *make, str(out / "made"))
        rows = []
        for _ in range(given.rounds):
            rows.append(
                [converted_s(t, out / "made" / "gaussian_blendshapes", out / "bundle") for t in (old, ROOT)]
            )
            print("CPU seconds before {:.1f}, now {:.1f}".format(*rows[-1]), flush=True)
        before, now = (statistics.median(column) for column in zip(*rows, strict=True))
        print(f"median before {before:.1f}, now {now:.1f}: {100 * (now / before - 1):+.0f} %")
    finally:
        subprocess.run(["git", "-C", ROOT, "worktree", "remove", "--force", old], check=True)


if __name__ == "__main__":
    main()
