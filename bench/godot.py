"""What an avatar costs in Godot, Forward+, beside backend `gl` of Python on the same Mesa.

    python -m bench.godot [PACK ...] [--size 512] [--frames 40] [--rounds 5]

Without a pack, of the trained head and of the sample head of 70,000 Gaussians. Every frame has a new pose. CPU time a
frame, all threads, medians of the rounds: of frames with the avatar less those without it, and of backend `gl`, one
after the other in each round. Needs what `make godot` gets; both name the driver that they drew with.
"""

from __future__ import annotations

import argparse
import json
import os
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

from tests.players.godot.desk import Job, posed
from tests.players.godot.engine import engine

from avatar_export.images import frame_camera, seen
from avatar_export.packing.steps import Fineness
from avatar_export.packing.write import pack
from avatar_runtime.avatar import Avatar
from avatar_runtime.camera import Camera
from avatar_runtime.packs import decode_pack
from avatar_runtime.pose import Pose
from bench.backends import busy_pose
from bench.native_player.gles import POSES, PythonFrames
from bench.pack_avatars import AVATARS

NAMES = ("head_blendshapes", "head_70000")
SYSTEM = "/usr/lib/x86_64-linux-gnu:/usr/lib/aarch64-linux-gnu:/usr/lib"  # for what the engine's folder does not have


def main() -> None:
    """Prints a line a pack."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("packs", nargs="*", type=Path)
    parser.add_argument("--size", type=int, default=512)
    parser.add_argument("--frames", type=int, default=40)
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument(
        "--gl", action="store_true", help=argparse.SUPPRESS
    )  # one round of backend `gl`, as JSON
    args = parser.parse_args()
    if args.gl:
        print(json.dumps(python_cost(args.packs[0], args.size, args.frames)))
        return
    with tempfile.TemporaryDirectory() as folder:
        for file in args.packs or [packed(name, Path(folder)) for name in NAMES]:
            print(line(file.resolve(), args.size, args.frames, args.rounds), flush=True)


def packed(name: str, folder: Path) -> Path:
    """A pack of a sample, without levels."""
    file = folder / f"{name}.avatar"
    file.write_bytes(pack([AVATARS[name].load(folder)], Fineness()).file)
    return file


def line(file: Path, size: int, frames: int, rounds: int) -> str:
    """What is printed of a pack."""
    avatar, camera = opened(file, size)
    found = [
        (godot_cost(file, avatar, camera, frames), on_same_mesa(file, size, frames)) for _ in range(rounds)
    ]
    empty, filled = (
        statistics.median(one[0][f"cost {name}"][0] for one in found) for name in ("empty", "filled")
    )
    own = statistics.median(one[1][0] for one in found)
    took = filled - empty
    return (
        f"{avatar.gaussians.count} Gaussians, {size}x{size}, CPU time a frame: Godot {took:.1f} ms ({filled:.1f} with "
        f"the avatar, {empty:.1f} without), backend gl {own:.1f} ms: {took / own:.2f} times as much\n"
        f"  Godot: {found[0][0]['adapter']}; gl: {found[0][1][1]}"
    )


def opened(file: Path, size: int) -> tuple[Avatar, Camera]:
    """The avatar of a pack, and the camera of both."""
    avatar = decode_pack(file.read_bytes(), file.name).avatar
    return avatar, frame_camera(seen(avatar, Pose()), size, size)


def godot_cost(file: Path, avatar: Avatar, camera: Camera, frames: int) -> dict[str, Any]:
    """The answers of one start of Godot: frames without the avatar, and with it."""
    with tempfile.TemporaryDirectory() as folder:
        job = Job(Path(folder))
        job.camera(camera)
        job.say("viewport", "use_hdr_2d", False)
        job.say("cost", "warm", 10, [])
        job.say("cost", "empty", frames, [])
        job.avatar("a", file)
        poses = [posed("a", avatar, busy_pose(avatar, seed)) for seed in range(POSES)]
        job.say("cost", "warm", 10, poses)
        job.say("cost", "filled", frames, poses)
        return job.play().answers


def on_same_mesa(file: Path, size: int, frames: int) -> tuple[float, str]:
    """The cost by backend `gl`: a process with the drivers that the engine was unpacked with, if it was."""
    own = [os.path.realpath(sys.executable), "-m", "bench.godot", str(file), "--gl", "--size", str(size)]
    own += ["--frames", str(frames)]
    started = list(engine().editor[:-1])
    if started:
        started[-1] += f":{SYSTEM}"
    environment = {**os.environ, **engine().environment, "PYTHONPATH": os.pathsep.join(sys.path)}
    done = subprocess.run([*started, *own], env=environment, check=True, capture_output=True, text=True)
    cpu, driver = json.loads(done.stdout)
    return float(cpu), str(driver)


def python_cost(file: Path, size: int, frames: int) -> tuple[float, str]:
    """Milliseconds of CPU time a frame by backend `gl`, and the driver."""
    drawn = PythonFrames(*opened(file, size), is_es=False)
    return drawn.cpu_ms(frames), drawn.driver


if __name__ == "__main__":
    main()
