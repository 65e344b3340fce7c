"""A film and the avatar that it became, side by side: `python -m samples.films.picture MADE OUT.webp`.

MADE is a folder that `avatar-export make` wrote: capture/ and bundle/. Left the film, right the avatar from aside.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
from PIL import Image

from avatar_runtime import Camera, Player, load, rotation
from avatar_trainer.captures.load import load as load_capture
from avatar_trainer.captures.mesh_raster import intrinsics
from avatar_trainer.evaluation.bundle import pose_of

FRAMES, EVERY, SIZE, FPS = 50, 3, 256, 10.0
ASIDE, PAPER = -24.0, 0.12  # degrees that the camera goes aside; grey behind the avatar


def turned(camera: Camera, degrees: float, width: int) -> Camera:
    """A camera that goes around what it sees, at the distance of the head, on images of `width` pixels."""
    seen = camera.camera_from_world.astype(np.float64)
    turn, shift = seen[:3, :3], seen[:3, 3]
    about = rotation.matrix_from_rotvec(np.array([0.0, np.radians(degrees), 0.0]))
    focal = intrinsics(camera)[0, 0] * width / camera.width
    k = np.array([[focal, 0, width / 2], [0, focal, width / 2], [0, 0, 1]])
    return Camera.from_opencv(about @ turn, shift * (0, 1, 1), k, width, width)


def main() -> None:
    """The command."""
    parser = argparse.ArgumentParser(prog="python -m samples.films.picture", description=__doc__)
    parser.add_argument("made", type=Path)
    parser.add_argument("out", type=Path)
    given = parser.parse_args()
    capture, avatar = load_capture(given.made / "capture"), load(given.made / "bundle")
    player, pictures = Player(avatar), []
    for frame in capture.frames[: FRAMES * EVERY : EVERY]:
        film = Image.open(frame.image).convert("RGB").resize((SIZE, SIZE), Image.Resampling.LANCZOS)
        camera = turned(frame.camera, ASIDE, SIZE)
        drawn = player.frame(pose_of(capture, avatar, frame), camera, (PAPER,) * 3).image.colour
        right = Image.fromarray(np.round(np.clip(drawn, 0, 1) * 255).astype(np.uint8))
        both = Image.new("RGB", (2 * SIZE, SIZE))
        both.paste(film, (0, 0))
        both.paste(right, (SIZE, 0))
        pictures.append(both)
    first, *others = pictures
    first.save(
        given.out,
        save_all=True,
        append_images=others,
        duration=round(1000 / FPS),
        loop=0,
        quality=60,
        method=6,
    )


if __name__ == "__main__":
    main()
