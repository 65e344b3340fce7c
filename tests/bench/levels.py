"""What levels of detail cost and how they look: `python -m tests.bench.levels [OUT]` prints a row for each level.

The level is fitted without the avatar's first clip and judged on that clip and on other poses within the ranges:
8 poses, each from the front and from 40 degrees to both sides, 512x512, backend `cpu`, PSNR over black where the source
covers more than half of a pixel. With OUT, contact sheets are written there: source, level and ten times their
difference, in motion.
"""

from __future__ import annotations

import argparse
import resource
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
from PIL import Image

from avatar_export.levels import coarser, height_px
from avatar_export.levels.height import BLACK, psnr_db
from avatar_export.levels.views import View, judging_views
from avatar_runtime.avatar import Avatar
from avatar_runtime.bundle import load
from avatar_runtime.player import Player
from avatar_runtime.pose import clip_pose

TRAINED = Path("samples/trained")
NAMES = ("head_blendshapes", "head_splatting", "head_points", "body_splatting")
KEEP = (0.5, 0.25)
SIZE, SHOWN = 512, 6
COLUMNS = "avatar               keep  Gaussians  mean dB  worst dB  most px  CPU s  peak MB"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("out", type=Path, nargs="?", help="folder for contact sheets")
    parser.add_argument("--avatars", nargs="+", type=Path, default=[TRAINED / name for name in NAMES])
    parser.add_argument("--keep", nargs="+", type=float, default=KEEP)
    args = parser.parse_args()
    print(COLUMNS)
    for path in args.avatars:
        avatar = load(path)
        for keep in args.keep:
            measure(avatar, path.name, keep, args.out)


def measure(avatar: Avatar, name: str, keep: float, out: Path | None) -> None:
    """Print the row of one level."""
    began = time.process_time()
    level = coarser(replace(avatar, clips=avatar.clips[1:]), keep)
    seconds = time.process_time() - began
    judged = replace(avatar, clips=avatar.clips[:1])
    seen = judging_views(judged, SIZE)
    found = psnr_db(avatar, level, seen)
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024 / 1e6
    print(
        f"{name:20s} {keep:.2f} {level.gaussians.count:10d} {np.mean(found):8.2f} {min(found):9.2f}"
        f" {height_px(judged, level):8d} {seconds:6.1f} {peak:8.0f}",
        flush=True,
    )
    if out is not None:
        out.mkdir(parents=True, exist_ok=True)
        sheet(avatar, level, seen).save(out / f"{name}_{keep:g}.png")


def sheet(avatar: Avatar, level: Avatar, seen: list[View]) -> Image.Image:
    """Rows: source, level, ten times the difference; columns: judged views, then following frames of a clip."""
    player, other = Player(avatar), Player(level)
    views = seen[:: len(seen) // SHOWN][:SHOWN]
    if avatar.clips:
        clip = avatar.clips[0]
        poses = [replace(clip_pose(avatar, clip, k), world_from_avatar=np.eye(4)) for k in range(SHOWN // 2)]
        views += [View(pose, seen[0].camera) for pose in poses[: clip.frames]]
    columns = []
    for view in views:
        a, b = (p.frame(view.pose, view.camera, BLACK).image.colour for p in (player, other))
        columns.append(np.concatenate([a, b, 10 * np.abs(a - b)]))
    pixels = np.clip(np.concatenate(columns, axis=1), 0, 1)
    return Image.fromarray((255 * pixels + 0.5).astype(np.uint8))


if __name__ == "__main__":
    main()
