"""What the checks of one avatar for itself cost in `convert`: CPU seconds, and their share of the whole.

    python -m bench.checks [--gaussians 84000]

A head of Gaussian Blendshapes and one of SplattingAvatar are made (that does not count) and converted in this process,
under a profiler. The share is that of the time that the same conversion takes without the checks.
"""

from __future__ import annotations

import argparse
import cProfile
import pstats
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from samples.make import make_gaussian_blendshapes, make_splatting_head

from avatar_export import ConvertOptions, convert

CHECKS = ("whole_fit", "stored_positions", "stored_doubts", "regressor_notes", "exchanged_columns")


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--gaussians", type=int, default=84_000)
    count = parser.parse_args().gaussians
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        face = make_gaussian_blendshapes(folder, count)
        given = {
            "body_model": face / "body" / "body_model.npz",
            "shape": Path("zero"),
            "anchor_faces": face / "body" / "back_of_head.txt",
            "eyelids": face / "body",
        }
        _measure("gaussian_blendshapes", face / "model", given, folder / "a")
        head = make_splatting_head(folder, count)
        given = {"body_model": head / "body" / "body_model.npz", "poses": head / "flame_params.json"}
        _measure("splatting_avatar", head / "run", given, folder / "b")


def _measure(system: str, source: Path, options: Mapping[str, Any], out: Path) -> None:
    profile = cProfile.Profile()
    profile.runcall(convert, source, out, ConvertOptions(**options))
    stats: Any = pstats.Stats(profile)
    spent = {name: 0.0 for name in CHECKS}
    for (file, _, name), (_, _, _, cumulative, _) in stats.stats.items():
        if name in spent and "/fit/" in file:
            spent[name] += cumulative
    checks = sum(spent.values())
    rest = stats.total_tt - checks
    print(f"{system}: {rest:.2f} s without the checks, {rest + checks:.2f} s with them, {checks / rest:+.1%}")
    print("  " + ", ".join(f"{name} {seconds:.3f} s" for name, seconds in spent.items()))


if __name__ == "__main__":
    main()
