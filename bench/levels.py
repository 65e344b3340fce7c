"""What levels of detail cost and how they look: `python -m bench.levels` prints a row for each level.

Levels are fitted without the avatar's longest clip and judged on it, as a pack plays them. PSNR: 8 poses of that clip
and of the ranges, each from the front and from 40 degrees to both sides, 512x512, backend `cpu`, over black, where the
source covers more than half of a pixel.

In motion: 30 frames of that clip that follow each other, from the front, and from a camera that turns by a degree a
frame. Flicker is the mean of |I(t+1) - 2 I(t) + I(t-1)| where the source covers more than half of a pixel, divided by
that of the source: over all frames, and in the worst one. Holes are the share of those pixels in which the level covers
less than half of what the source covers, in the worst frame.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import numpy.typing as npt

from avatar_export.images import frame_camera
from avatar_export.levels import coarser, heights_px
from avatar_export.levels.views import SEED, View, posed_box, some_poses
from avatar_export.ops.active_sh import with_active_sh
from avatar_export.packing.steps import Fineness
from avatar_export.packing.write import prepare, write
from avatar_runtime.avatar import F32, Avatar
from avatar_runtime.bundle import load
from avatar_runtime.clips import frame_pose
from avatar_runtime.packs import placed
from avatar_runtime.player import Player

TRAINED = Path("samples/trained")
NAMES = ("head_blendshapes", "head_splatting", "head_points", "body_splatting")
KEEP = (0.5, 0.25)
SIZE, FRAMES = 512, 30
CAMERAS = (np.zeros(FRAMES), np.radians(25.0 + np.arange(FRAMES)))  # yaw of each frame
COLUMNS = "avatar             part  Gaussians  mean dB  worst dB  most px  flicker  worst frame  holes %  CPU s to make"
POSES, YAWS = 8, tuple(np.radians([0.0, 40.0, -40.0]))
COVERED = 0.5  # alpha of the source above which a pixel belongs to the avatar
BLACK = (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class Motion:
    """How a level moves, against its source."""

    flicker: float
    worst: float  # the same in the worst frame
    holes: float  # part of the pixels that the source covers, in the worst frame


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--avatars", nargs="+", type=Path, default=[TRAINED / name for name in NAMES])
    parser.add_argument("--keep", nargs="+", type=float, default=KEEP)
    args = parser.parse_args()
    print(COLUMNS)
    for path in args.avatars:
        measure(with_active_sh(load(path)), path.name, args.keep)


def measure(avatar: Avatar, name: str, keep: Sequence[float]) -> None:
    """Print the rows of an avatar's levels, the finest first."""
    longest = max(avatar.clips, key=lambda clip: clip.frames)
    judged = replace(avatar, clips=(longest,))
    levels, seconds = [avatar], [0.0]
    for part in keep:
        began = time.process_time()
        levels.append(
            coarser(replace(avatar, clips=tuple(c for c in avatar.clips if c is not longest)), part)
        )
        seconds.append(time.process_time() - began)
    prepared = prepare(levels, Fineness())
    seen, moving = judging_views(judged, SIZE), [_moving(judged, yaws) for yaws in CAMERAS]
    truth = [_drawn(avatar, views) for views in moving]
    played = [placed(stored) for stored in prepared.levels]
    began = time.process_time()
    heights = ["any", *heights_px(played[0], played[1:])]
    judging = time.process_time() - began
    for part, took, level, most in zip((1.0, *keep), seconds, played, heights, strict=True):
        found = psnr_db(avatar, level, seen)
        moved = motion(truth, [_drawn(level, views) for views in moving])
        print(
            f"{name:18s} {part:.2f} {level.gaussians.count:10d} {np.mean(found):8.2f} {min(found):9.2f} {most:>8} "
            f"{moved.flicker:8.2f} {moved.worst:12.2f} {100 * moved.holes:8.3f} {took:14.1f}",
            flush=True,
        )
    whole, finest = (len(write(one).file) for one in (prepared, prepare([avatar], Fineness())))
    print(
        f"{name:18s} its levels below the finest add {100 * (whole / finest - 1):.0f} % to the file, if all are kept; "
        f"their heights were measured in {judging:.1f} CPU s",
        flush=True,
    )


def judging_views(avatar: Avatar, size: int) -> list[View]:
    """8 poses that no level was fitted in, each from three sides, in images of `size` x `size` pixels."""
    poses = some_poses(avatar, POSES, 0.0, SEED + 1)
    box = posed_box(avatar, poses)
    return [View(pose, frame_camera(box, size, size, yaw)) for pose in poses for yaw in YAWS]


def psnr_db(avatar: Avatar, level: Avatar, seen: Sequence[View]) -> list[float]:
    """PSNR of each view over black, where `avatar` covers more than half of a pixel; infinite if nothing differs."""
    truth, player, result = Player(avatar), Player(level), []
    for view in seen:
        wanted, drawn = (p.frame(view.pose, view.camera, BLACK).image for p in (truth, player))
        mask = 1 - wanted.transmittance > COVERED
        error = (drawn.colour[mask] - wanted.colour[mask]).astype(np.float64)
        square = float(np.mean(error**2)) if len(error) else 0.0
        result.append(-10 * float(np.log10(square)) if square else np.inf)
    return result


def _moving(judged: Avatar, yaws: npt.NDArray[np.float64]) -> list[View]:
    """Frames that follow each other in the middle of the only clip; the avatar as a whole stays."""
    clip = judged.clips[0]
    first = max(0, (clip.frames - FRAMES) // 2)
    still = [
        replace(frame_pose(judged, clip, first + k), world_from_avatar=np.eye(4))
        for k in range(min(FRAMES, clip.frames))
    ]
    box = posed_box(judged, still[::6])
    return [
        View(pose, frame_camera(box, SIZE, SIZE, float(yaw))) for pose, yaw in zip(still, yaws, strict=False)
    ]


def _drawn(avatar: Avatar, seen: Sequence[View]) -> tuple[F32, F32]:
    """(images over black [T, H, W, 3], their alpha [T, H, W])."""
    player = Player(avatar)
    images = [player.frame(view.pose, view.camera, BLACK).image for view in seen]
    return np.stack([i.colour for i in images]), 1 - np.stack([i.transmittance for i in images])


def motion(truth: Sequence[tuple[F32, F32]], level: Sequence[tuple[F32, F32]]) -> Motion:
    """What each camera saw of the source and of a level, compared."""
    source_sum = level_sum = worst = holes = 0.0
    for (source, alpha), (drawn, drawn_alpha) in zip(truth, level, strict=True):
        inside = alpha > COVERED
        lost = (drawn_alpha < alpha / 2) & inside
        holes = max(holes, float((lost.sum(axis=(1, 2)) / inside.sum(axis=(1, 2))).max()))
        here = [
            [float(c[m].sum()) for c, m in zip(_change(i), inside[1:-1], strict=True)]
            for i in (source, drawn)
        ]
        worst = max(worst, float(np.max(np.divide(here[1], here[0]))))
        source_sum, level_sum = source_sum + sum(here[0]), level_sum + sum(here[1])
    return Motion(level_sum / source_sum, worst, holes)


def _change(images: F32) -> F32:
    """[T - 2, H, W] how far each image is from the mean of its neighbours in time, doubled; mean over RGB."""
    result: F32 = np.abs(images[2:] - 2 * images[1:-1] + images[:-2]).mean(axis=3)
    return result


if __name__ == "__main__":
    main()
