"""Frames of the native player beside backend `gl` of Python, and what targets that round cost.

    python -m bench.native_player.gles PACK [--size 512x512]... [--copies N] [--rounds 5] [--api es|gl|d3d11]...

For each size: milliseconds of CPU time a frame of both, one after the other in each round, their medians; frames per
second of the native player; wall milliseconds of a frame's parts, each of which waits for the GPU. Every frame has a
new pose. Then the largest error of RGBA16F and RGBA8 against RGBA32F. The device's name comes first; on a machine
without a GPU that is llvmpipe. d3d11 is Wine's Direct3D on this machine's OpenGL, under a made-up name of a GPU: it is
no driver, and its times say nothing about Windows.
"""

from __future__ import annotations

import argparse
import statistics
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from tests.players.native.gles import Job, desk_program

from avatar_export.images import frame_camera, seen
from avatar_runtime.avatar import Avatar
from avatar_runtime.backends.gl.backend import GlBackend
from avatar_runtime.camera import Camera
from avatar_runtime.packs import decode_pack
from avatar_runtime.player import Player
from avatar_runtime.pose import Pose
from bench.backends import busy_pose

POSES, FRAMES = 8, 16
TARGETS = ("rgba32f", "rgba16f", "rgba8")


@dataclass(frozen=True)
class Bench:
    """What is measured."""

    pack: Path
    avatar: Avatar
    kind: str  # es, gl or d3d11
    copies: int

    def native(self, camera: Camera) -> tuple[float, float, str, str]:
        """Milliseconds a frame of the CPU and of the wall, the renderer's name, and the parts."""
        with tempfile.TemporaryDirectory() as folder:
            job = self._job(Path(folder), camera)
            poses = [job.pose(self.avatar, busy_pose(self.avatar, seed)) for seed in range(POSES)]
            job.say("bench", FRAMES, *poses)
            job.say("end")
            said = job.run(_program(self.kind))
            words = next(line for line in said if line[0] == "bench")
            parts = ", ".join(f"{line[1]} {float(line[2]):.1f}" for line in said if line[0] == "part")
            return float(words[1]), float(words[2]), " ".join(words[3:]), parts

    def errors(self, camera: Camera) -> dict[str, float]:
        """The largest error of each target against RGBA32F."""
        with tempfile.TemporaryDirectory() as folder:
            job = self._job(Path(folder), camera)
            for number, target in enumerate(TARGETS):
                job.say("target", number)
                job.draw(target)
            job.say("end")
            job.run(_program(self.kind))
            exact = job.image(TARGETS[0])
            if exact[..., 3].max() < 0.5:
                raise RuntimeError("nothing is seen in the image: no error can be measured")
            return {name: float(np.abs(job.image(name) - exact).max()) for name in TARGETS[1:]}

    def _job(self, folder: Path, camera: Camera) -> Job:
        job = Job(folder)
        job.say("begin", self.kind, camera.width, camera.height)
        job.camera(camera)
        for _ in range(self.copies):
            job.add(self.pack, self.avatar, busy_pose(self.avatar, 0))
        return job


class PythonFrames:
    """The same frames by backend `gl`, of one avatar."""

    def __init__(self, avatar: Avatar, camera: Camera, is_es: bool) -> None:
        self._player = Player(avatar, "gl", target="rgba32f", es=is_es)
        backend = self._player.backend
        assert isinstance(backend, GlBackend)
        self._backend, self._camera = backend, camera
        self._poses = [busy_pose(avatar, seed) for seed in range(POSES)]
        with backend.context:
            texture = backend.context.texture((camera.width, camera.height), 4)
            self._canvas = backend.context.framebuffer([texture])
        self.driver = " ".join(backend.context.info[name] for name in ("GL_RENDERER", "GL_VERSION"))
        self.cpu_ms(3)  # compiles

    def cpu_ms(self, frames: int) -> float:
        """Milliseconds of CPU time a frame."""
        start = time.process_time()
        for index in range(frames):
            posed = self._player.posed(self._poses[index % POSES])
            self._backend.draw_into(self._canvas, posed, self._camera)
        with self._backend.context:
            self._backend.context.finish()
        return 1000 * (time.process_time() - start) / frames


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("pack", type=Path)
    parser.add_argument(
        "--size", action="append", help="WIDTHxHEIGHT; as often as you like. Default: 512x512"
    )
    parser.add_argument("--copies", type=int, default=1, help="avatars in the scene")
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument(
        "--api", action="append", choices=["es", "gl", "d3d11"], help="as often as you like. Default: es"
    )
    args = parser.parse_args()
    avatar = decode_pack(args.pack.read_bytes(), args.pack.name).avatar
    for size in args.size or ["512x512"]:
        for kind in args.api or ["es"]:
            bench = Bench(args.pack.resolve(), avatar, kind, args.copies)
            print(*_lines(bench, size, args.rounds), sep="\n")


def _lines(bench: Bench, size: str, rounds: int) -> list[str]:
    width, height = map(int, size.split("x"))
    camera = frame_camera(seen(bench.avatar, Pose()), width, height)
    python = PythonFrames(bench.avatar, camera, bench.kind == "es")
    found = [(bench.native(camera), python.cpu_ms(FRAMES)) for _ in range(rounds)]
    cpu = statistics.median(native[0] for native, _ in found)
    wall = statistics.median(native[1] for native, _ in found)
    own = statistics.median(other for _, other in found)
    what = f"{bench.copies} x {bench.avatar.gaussians.count} Gaussians, {size}"
    errors = ", ".join(f"{name} {error:.5f}" for name, error in bench.errors(camera).items())
    return [
        f"{found[0][0][2]}, {bench.kind}: {what}",
        f"  CPU time a frame: native {cpu:.1f} ms; Python, one avatar, {own:.1f} ms",
        f"  native: {1000 / wall:.1f} frames per second",
        f"  parts, ms: {found[0][0][3]}",
        f"  largest error against RGBA32F: {errors}",
    ]


def _program(kind: str) -> Path:
    return desk_program(kind, "desk_bench", ("-O2",))


if __name__ == "__main__":
    main()
