"""`make demo`: plays the trained sample avatars; every step is a command a user would type."""

from __future__ import annotations

import os
import shlex
import shutil
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

RECORDING = Path(__file__).parent / "drive" / "live_link_face_udp.gesichter"
TRAINED = (
    Path(__file__).parent / "trained"
)  # normative files and reference/; `python -m samples.trained` makes them

Command = tuple[str, ...]  # the arguments after `python -m`


def blendshapes(out: Path) -> list[Command]:
    """A head of Gaussian blendshapes, smiling and driven by recorded packets."""
    bundle = out / "avatar"
    smile = ("-a", "mouthSmileLeft=0.9", "-a", "mouthSmileRight=0.9", "-a", "jawOpen=0.25")
    drive = ("--drive", str(RECORDING), "--every", "3", "--size", "288")
    return [
        ("avatar_export", "convert", str(TRAINED / "head_blendshapes"), "-o", str(bundle)),
        ("avatar_export", "validate", str(bundle)),
        render(bundle, out / "smile.png", *smile, "--yaw", "20", "--size", "384"),
        render(bundle, out / "driven.webp", *drive),
    ]


def talking_head(out: Path) -> list[Command]:
    """A head embedded in a body model's mesh, in a part of its take that was held out of training."""
    bundle = out / "splatting_head"
    talk = ("--clip", "held_out", "--every", "2", "--zoom", "1.15", "--size", "288")
    return [
        ("avatar_export", "conform", str(TRAINED / "head_splatting")),
        ("avatar_export", "convert", str(TRAINED / "head_splatting"), "-o", str(bundle)),
        render(bundle, out / "splatting_head.webp", *talk),
    ]


def walking_body(out: Path) -> list[Command]:
    """A clothed body embedded in the mesh of a rigged glb, which walks."""
    bundle = out / "body"
    walk = ("--clip", "training", "--frames", "0:48", "--every", "2")
    view = ("--yaw", "35", "--pitch", "6", "--size", "224x320")
    return [
        ("avatar_export", "convert", str(TRAINED / "body_splatting"), "-o", str(bundle)),
        render(bundle, out / "walk.webp", *walk, *view),
    ]


def glasses(out: Path) -> list[Command]:
    """Points on and off a body model's mesh: glasses that the mesh lacks, in frames never trained on."""
    bundle = out / "points_head"
    turn = ("--clip", "held_out", "--every", "5", "--yaw", "-35", "--zoom", "1.15", "--size", "256")
    return [
        ("avatar_export", "convert", str(TRAINED / "head_points"), "-o", str(bundle), "--no-preview"),
        render(bundle, out / "points_head.webp", *turn),
    ]


def bones(out: Path) -> list[Command]:
    """A face of 84 bones, fitted to a scan, with expressions."""
    bundle = out / "bones_head"
    faces = ("--clip", "expressions", "--every", "8", "--yaw", "15", "--size", "224")
    return [
        ("avatar_export", "convert", str(TRAINED / "head_bones.npz"), "-o", str(bundle), "--no-preview"),
        render(bundle, out / "bones_head.webp", *faces),
    ]


DEMOS = (blendshapes, talking_head, walking_body, glasses, bones)
IMAGES = (
    "avatar/preview.png",
    "smile.png",
    "driven.webp",
    "splatting_head/preview.png",
    "splatting_head.webp",
    "body/preview.png",
    "walk.webp",
    "points_head.webp",
    "bones_head.webp",
)


def render(bundle: Path, image: Path, *options: str) -> Command:
    """Draw a bundle into a file, on the default backend: the first time it compiles what draws."""
    return ("avatar_export", "render", str(bundle), "-o", str(image), *options)


def main(out: Path) -> None:
    """Everything under `out`, which is replaced; the demos run in parallel, the steps of each in order."""
    shutil.rmtree(out, ignore_errors=True)
    with ThreadPoolExecutor(min(len(DEMOS), os.cpu_count() or 1)) as pool:
        codes = list(pool.map(lambda demo: run(demo(out)), DEMOS))
    if any(codes):
        sys.exit(max(codes, key=abs))
    print("\nLook at:")
    for image in IMAGES:
        print(f"  {(out / image).resolve()}")
    print("\nMove it in a browser:")
    print(f"  avatar-export view {shlex.quote(os.path.relpath(out / 'avatar'))}")


def run(commands: list[Command]) -> int:
    """Run commands in order and print each with its output; the exit code of the first that fails, or 0."""
    for module, *arguments in commands:
        words = [*(("avatar-export",) if module == "avatar_export" else ("python", "-m", module)), *arguments]
        command = [sys.executable, "-m", module, *arguments]
        done = subprocess.run(
            command, check=False, text=True, stdout=subprocess.PIPE, stderr=subprocess.STDOUT
        )
        print(f"$ {' '.join(words)}\n{done.stdout}", end="", flush=True)
        if done.returncode:
            return done.returncode
    return 0


if __name__ == "__main__":
    main(Path(sys.argv[1]))
