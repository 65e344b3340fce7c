"""`make demo`: builds the sample checkpoint, converts it, plays it; every step is a command a user would type."""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

GAUSSIANS = 20_000
RECORDING = Path(__file__).parent / "drive" / "live_link_face_udp.gesichter"


def main(out: Path) -> None:
    """Everything under `out`, which is made anew."""
    shutil.rmtree(out, ignore_errors=True)
    sample = out / "checkpoint"
    run("-m", "samples.make", str(sample), "--gaussians", str(GAUSSIANS), "--form", "dump")
    trained = sample / "gaussian_blendshapes"
    bundle = out / "avatar"
    run(
        *("-m", "avatar_export", "convert", str(trained / "model"), "--dataset", str(trained)),
        *("--driving", str(trained / "driving.json"), "-o", str(bundle)),
    )
    run("-m", "avatar_export", "validate", str(bundle))
    picture, animation = out / "smile.png", out / "driven.webp"
    smile = ("-a", "mouthSmileLeft=0.9", "-a", "mouthSmileRight=0.9", "-a", "jawOpen=0.25")
    run(
        "-m",
        "avatar_export",
        "render",
        str(bundle),
        "-o",
        str(picture),
        *smile,
        "--yaw",
        "20",
        "--size",
        "384",
    )
    run(
        *("-m", "avatar_export", "render", str(bundle), "-o", str(animation), "--drive", str(RECORDING)),
        *("--every", "3", "--size", "288"),
    )
    print("\nLook at:")
    for path in (bundle / "preview.png", picture, animation):
        print(f"  {path.resolve()}")


def run(*arguments: str) -> None:
    """Run and show one command; the first that fails ends the demo."""
    shown = [a for a in arguments if a != "-m"]
    print(
        "$",
        " ".join(["avatar-export", *shown[1:]] if shown[0] == "avatar_export" else ["python -m", *shown]),
        flush=True,
    )
    finished = subprocess.run([sys.executable, *arguments], check=False)
    if finished.returncode:
        sys.exit(finished.returncode)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
