"""Frames per second of backend `gl` with everything on: pose, deform, sort and draw, nothing read back.

    python -m bench.gl_speed BUNDLE [--seconds 5]

Prints the renderer's name; on a machine without a GPU that is llvmpipe. Drawn into RGBA16F, a new pose each frame,
512x512 and 1920x1080, the camera as in the other benches.
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path

import numpy as np

from avatar_export.images import frame_camera, robust_box
from avatar_runtime.avatar import Avatar
from avatar_runtime.backends.gl.backend import GlBackend
from avatar_runtime.bundle import load
from avatar_runtime.player import Player
from bench.backends import busy_pose

SIZES = ((512, 512), (1920, 1080))
POSES = 32


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("bundle", type=Path)
    parser.add_argument("--seconds", type=float, default=5.0)
    args = parser.parse_args()
    avatar = load(args.bundle)
    for width, height in SIZES:
        renderer, rate = frames_per_second(avatar, width, height, args.seconds)
        print(
            f"{renderer}: {avatar.gaussians.count} Gaussians, {width}x{height}: {rate:.1f} frames per second"
        )


def speed_rows(avatar: Avatar) -> list[tuple[str, float, str]]:
    """The rows of `make bench`."""
    sizes = ((width, height, frames_per_second(avatar, width, height, 5.0)[1]) for width, height in SIZES)
    return [(f"gl_{width}x{height}", rate, "frames/s") for width, height, rate in sizes]


def frames_per_second(avatar: Avatar, width: int, height: int, seconds: float) -> tuple[str, float]:
    """(renderer, frames per second): poses resolved beforehand, stage `joints` and all later ones counted."""
    player = Player(avatar, "gl", target="rgba16f")
    backend = player.backend
    assert isinstance(backend, GlBackend)
    context = backend.context
    camera = frame_camera(robust_box(avatar.gaussians.mean), width, height)
    poses = [busy_pose(avatar, seed) for seed in range(POSES)]
    with context:
        canvas = context.framebuffer([context.texture((width, height), 4, dtype="f2")])
    frames, background = 0, (0.0, 0.0, 0.0)
    for pose in poses[:3]:
        backend.draw_into(canvas, player.posed(pose), camera, background=background)
    start = time.perf_counter()
    while time.perf_counter() - start < seconds:
        posed = player.posed(poses[frames % POSES])
        backend.draw_into(canvas, posed, camera, background=background)
        frames += 1
        if frames % POSES == 0:
            with context:
                context.finish()
    with context:
        np.frombuffer(canvas.read(components=4, dtype="f2"), np.float16)  # waits for the last frame
    return context.info["GL_RENDERER"], frames / (time.perf_counter() - start)


if __name__ == "__main__":
    main()
