"""The trained sample avatars: `python -m samples.trained OUT` makes the bundles that lie in samples/trained.

Every step is a command that a user would type: a synthetic capture, training, export and measures of quality.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

Command = tuple[str, ...]  # the arguments after `python -m`
# `convert` makes the other files again from the normative ones.
BARE = ("--no-engine-files", "--no-preview", "--force")


@dataclass(frozen=True)
class Recipe:
    """One sample: what is captured, and how it is trained."""

    capture: Command  # options of samples.capture
    system: str
    training: Command  # options of avatar-train

    def commands(self, name: str, out: Path) -> list[Command]:
        """Everything from nothing to out/bundles/NAME."""
        capture = out / "captures" / "_".join(word.strip("-") for word in self.capture)
        run, bundle = out / "runs" / name, out / "bundles" / name
        made = [("samples.capture", str(capture), *self.capture)] if not capture.exists() else []
        return [
            *made,
            ("avatar_trainer", self.system, str(capture), "-o", str(run), "--preview", *self.training),
            ("avatar_trainer", "evaluate", str(run)),
            ("avatar_trainer", "export", str(run), str(bundle), *BARE),
            ("avatar_trainer", "compare", str(run), str(bundle), "--every", "10"),
            ("avatar_export", "conform", str(bundle)),
        ]


# Jittered and close frames show each expression, one after the other, twice or three times.
HEAD = (
    *("--subject", "head", "--size", "512", "--frames", "360", "--yaw", "110"),
    *("--jitter", "51", "--close", "153"),
)
BODY = ("--subject", "body", "--size", "256", "--frames", "200")
GLASSES = (
    *("--subject", "head", "--glasses", "--size", "512", "--frames", "300", "--yaw", "110"),
    *("--jitter", "102", "--close", "153"),
)
RECIPES = {
    "head_blendshapes": Recipe(
        HEAD,
        "gaussian_blendshapes",
        (
            *("--gaussians", "10500", "--set", "mouth_gaussians=600", "--set", "density.max_gaussians=12800"),
            *("--set", "density.densify_until=4500"),
            *("--iterations", "8000", "--sh-degree", "0", "--seed", "1"),
        ),
    ),
    "head_splatting": Recipe(
        HEAD,
        "splatting_avatar",
        (
            *("--gaussians", "10000", "--set", "density.max_gaussians=18000"),
            *("--iterations", "7000", "--seed", "1"),
        ),
    ),
    "body_splatting": Recipe(
        BODY,
        "splatting_avatar",
        (
            *("--gaussians", "6000", "--set", "density.max_gaussians=12000"),
            *("--iterations", "4000", "--seed", "1"),
        ),
    ),
    "head_points": Recipe(
        GLASSES,
        "psavatar",
        (
            *("--gaussians", "34000", "--set", "off_mesh=0.45", "--set", "r_max=0.06", "--sh-degree", "0"),
            *("--iterations", "8000", "--seed", "1"),
        ),
    ),
}


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m samples.trained", description=__doc__)
    parser.add_argument("out", type=Path, help="folder to work in; bundles come to OUT/bundles")
    parser.add_argument("--only", choices=RECIPES, action="append", help="may be repeated")
    args = parser.parse_args()
    for name in args.only or RECIPES:
        for module, *rest in RECIPES[name].commands(name, args.out):
            print(f"$ python -m {module} {' '.join(rest)}", flush=True)
            code = subprocess.run([sys.executable, "-m", module, *rest], check=False).returncode
            if code:
                sys.exit(code)


if __name__ == "__main__":
    main()
