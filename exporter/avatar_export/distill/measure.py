"""How far a distilled avatar is from the dumps: positions, every attribute, and images of both."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from avatar_export.distill.dumps.frames import Rows, read_frame
from avatar_export.distill.learn import Task
from avatar_export.distill.sh_turn import turned_sh
from avatar_export.images import Box, frame_camera, robust_box
from avatar_export.measure.yardstick import MASK_ALPHA, psnr
from avatar_export.sparse import no_deltas
from avatar_runtime.avatar import (
    F32,
    F64,
    I64,
    Avatar,
    Gaussians,
    Group,
    RasterSettings,
    Rules,
    SparseRows,
)
from avatar_runtime.camera import Camera
from avatar_runtime.clips import frame_pose
from avatar_runtime.player import Player
from avatar_runtime.pose import Pose
from avatar_runtime.stages.activate import Splats

SIZE = 256  # pixels
YAWS = (0.0, 40.0, -40.0)  # degrees, of the cameras in turn
BLACK = (0.0, 0.0, 0.0)
MOST = 120  # frames that are measured
WORST = 3  # frames whose images are kept
PARTS = ("position", "rotation", "log scale", "opacity", "colour")


@dataclass(frozen=True)
class Picture:
    """Both images of a frame, over black."""

    frame: int
    truth: F32  # [H, W, 3]
    distilled: F32  # [H, W, 3]
    decibels: float  # PSNR where the truth's alpha is above 0.5


@dataclass(frozen=True)
class Errors:
    """Errors over some frames."""

    frames: I64  # [M] their numbers
    rms_mm: F64  # [M] of all positions
    seen_mm: F64  # [M] the same, weighted by the share of each Gaussian in the picture
    foreground_db: F64  # [M] PSNR where the truth's alpha is above 0.5
    height: float  # metres, of the figure
    left: dict[str, F64]  # part -> [N] sum over the frames of squared errors
    moved: dict[str, F64]  # part -> [N] the same of the truth about its mean
    worst: tuple[Picture, ...]

    @property
    def rms(self) -> float:
        """RMS of all positions in all frames, mm."""
        return float(np.sqrt(np.square(self.rms_mm).mean()))

    @property
    def seen(self) -> float:
        """The same, weighted by the share in the picture, mm."""
        return float(np.sqrt(np.square(self.seen_mm).mean()))

    @property
    def decibels(self) -> float:
        """Mean PSNR of the foreground, dB."""
        return float(np.nanmean(self.foreground_db))


def box_of(task: Task, frames: I64) -> Box:
    """The box of the Gaussians in some of `frames`."""
    some = frames[:: max(1, len(frames) // 8)]
    means = [read_frame(task.dumps, task.layout, int(f), task.order).mean[0] for f in some]
    low, high = np.stack([robust_box(mean) for mean in means]).transpose(1, 0, 2)
    return low.min(axis=0), high.max(axis=0)


def cameras(box: Box) -> list[Camera]:
    """The cameras in turn: in front of the avatar, and 40 degrees to each side."""
    return [frame_camera(box, SIZE, SIZE, float(np.radians(yaw))) for yaw in YAWS]


def errors(
    task: Task,
    avatar: Avatar,
    frames: I64,
    share: F64 | None = None,
    progress: Callable[[str], None] = lambda _: None,
) -> Errors:
    """The errors of `avatar` on `frames`, of which at most MOST are measured; `share` [N] weights the positions."""
    some = frames[np.unique(np.linspace(0, len(frames) - 1, min(len(frames), MOST)).astype(np.int64))]
    box = box_of(task, some)
    count = task.layout.rows
    weight = np.ones(count) if share is None else np.maximum(share, 0)
    rms, seen, decibels = [], [], []
    tally = _Tally(count)
    worst: list[Picture] = []
    for picture, truth, splats in pictures(task, avatar, some, box):
        progress(f"measuring frame {picture.frame}")
        off = np.square(splats.mean.astype(np.float64) - truth.mean[0]).sum(axis=1)
        rms.append(1e3 * float(np.sqrt(off.mean())))
        seen.append(1e3 * float(np.sqrt((weight * off).sum() / max(weight.sum(), 1e-30))))
        decibels.append(picture.decibels)
        tally.add(truth, splats)
        worst = sorted([*worst, picture], key=lambda one: one.decibels)[:WORST]
    height = float(box[1][1] - box[0][1])
    left, moved = tally.sums()
    return Errors(some, np.array(rms), np.array(seen), np.array(decibels), height, left, moved, tuple(worst))


def pictures(task: Task, avatar: Avatar, frames: I64, box: Box) -> Iterator[tuple[Picture, Rows, Splats]]:
    """Both images of each frame, the frame, and what the avatar makes of it."""
    views, player = cameras(box), Player(avatar)
    for index, frame in enumerate(frames.tolist()):
        camera, pose = views[index % len(views)], pose_of_frame(task, avatar, frame)
        rows = read_frame(task.dumps, task.layout, frame, task.order)
        splats = player.animate(pose)
        truth = Player(_posed(task, rows, splats, avatar.raster.near)).frame(Pose(), camera, BLACK).image
        drawn = player.frame(pose, camera, BLACK).image
        inside = psnr(truth.colour, 1 - truth.transmittance > MASK_ALPHA, drawn.colour)[1]
        yield Picture(frame, truth.colour, drawn.colour, inside), rows, splats


def pose_of_frame(task: Task, avatar: Avatar, frame: int) -> Pose:
    """The pose of `avatar` in a frame of the dumps: that of the take's clip."""
    take = int(task.dumps.drivers.take[frame])
    at = np.flatnonzero(task.dumps.drivers.take == take)
    clip = next(clip for clip in avatar.clips if clip.name == task.dumps.take_name(take))
    return frame_pose(avatar, clip, int(np.searchsorted(at, frame)))


def _posed(task: Task, rows: Rows, splats: Splats, near: float) -> Avatar:
    """One frame of dumps as an avatar that nothing moves; unrotated SH turn as the distilled Gaussians do."""
    n, count = rows.mean.shape[1], rows.sh.shape[2]
    sh = rows.sh[0]
    if task.dumps.encoding.sh == "unrotated" and count > 1 and splats.sh_rotation is not None:
        sh = turned_sh(sh, splats.sh_rotation)
    g = Gaussians(rows.mean[0], rows.log_scale[0], rows.quat_wxyz[0], rows.opacity_logit[0], sh)
    return Avatar(
        name="frame",
        gaussians=g,
        groups=(Group("frame", 0, n, "none"),),
        rules=Rules(sh_direction="world"),
        expressions=(),
        eyelids=(),
        blendshapes=no_deltas(n, coefficients=count),
        skin=SparseRows.empty(n, 0, {"weight": ()}),
        rig=None,
        sh_degree=g.sh_degree,
        raster=RasterSettings(near=near),
    )


class _Tally:
    """Squared errors of every attribute, and how much of it moved, summed over the frames."""

    def __init__(self, count: int) -> None:
        self._left = {name: np.zeros(count) for name in PARTS}
        self._first: dict[str, F64] = {}
        self._sum: dict[str, F64] = {}
        self._square: dict[str, F64] = {}
        self._frames = 0

    def add(self, truth: Rows, splats: Splats) -> None:
        """Add a frame."""
        a, b = _values(truth), _splat_values(splats)
        self._frames += 1
        for name in PARTS:
            x = a[name].astype(np.float64)
            y = b[name].astype(np.float64)
            if name == "rotation":
                y *= np.where((x * y).sum(axis=1, keepdims=True) < 0, -1, 1)
            first = self._first.setdefault(name, x)
            if name == "rotation":
                x = x * np.where((x * first).sum(axis=1, keepdims=True) < 0, -1, 1)
                y = y * np.where((y * x).sum(axis=1, keepdims=True) < 0, -1, 1)
            self._left[name] += np.square(x - y).sum(axis=1)
            self._sum[name] = self._sum.get(name, 0) + (x - first)
            self._square[name] = self._square.get(name, 0) + np.square(x - first)

    def sums(self) -> tuple[dict[str, F64], dict[str, F64]]:
        """(squared errors, squared motion about the mean), each [N], of each part."""
        moved = {
            name: (self._square[name] - np.square(self._sum[name]) / self._frames).sum(axis=1)
            for name in PARTS
        }
        return self._left, moved


def _values(rows: Rows) -> dict[str, F32]:
    return {
        "position": rows.mean[0],
        "rotation": rows.quat_wxyz[0],
        "log scale": rows.log_scale[0],
        "opacity": 1 / (1 + np.exp(-rows.opacity_logit[0][:, None])),
        "colour": rows.sh[0, :, 0],
    }


def _splat_values(splats: Splats) -> dict[str, F32]:
    return {
        "position": splats.mean,
        "rotation": splats.quat_wxyz,
        "log scale": np.log(np.maximum(splats.scale, np.float32(1e-30))),
        "opacity": splats.opacity[:, None],
        "colour": splats.sh[:, 0],
    }
