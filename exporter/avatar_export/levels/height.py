"""How large on the screen a level may be shown: as long as nobody can tell it from full detail, in its worst image."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any, cast

import numpy as np
import numpy.typing as npt

from avatar_export.images import frame_camera, seen
from avatar_export.levels.judging import centre_rows, judged_poses
from avatar_export.measure.framing import framing
from avatar_export.measure.height_px import height_px
from avatar_export.notes.note import Note, fact
from avatar_runtime.avatar import F32, I64, Avatar
from avatar_runtime.backends import SplatBackend, default_backend
from avatar_runtime.camera import Camera
from avatar_runtime.player import ABSURD, Player
from avatar_runtime.pose import Pose
from avatar_runtime.posed import Clock
from avatar_runtime.stages.activate import Splats
from avatar_runtime.stages.raster import Image

# A level looks like full detail if every image of every pose and view has at least these PSNRs.
IMAGE_DB = 40.0  # inside the outline: a root mean square error of 1 % of white
FACE_DB = 36.0  # inside the box of the Gaussians that expressions move most
BLOCK_DB = 30.0  # of every block of BLOCK x BLOCK pixels
BLOCK = 16
LEAST_PX = 64  # a level that serves no larger height is not worth its bytes
STEPS_AN_OCTAVE, OCTAVES = 4, 5  # heights that are tried: 64, 76, 91, 108, 128 ... 2048
YAWS = tuple(np.radians([0.0, 40.0, -40.0]))
FRAMED_POSES = 8
SIDE = 512  # pixels of the image that tells how high the avatar is in its frame
COVERED = 0.5  # alpha of full detail above which a pixel belongs to the avatar
BLACK = np.zeros(3, np.float32)
Mask = npt.NDArray[np.bool_]


@dataclass(frozen=True)
class Served:
    """Which levels are worth their bytes."""

    kept: tuple[int, ...]  # indices of the levels, 0 first
    heights: tuple[int | None, ...]  # their `height_px`; None for level 0, which serves any
    notes: tuple[Note, ...]  # why the others are left out


def served(levels: Sequence[Avatar]) -> Served:
    """Of `levels`, finest first, the finest and those that serve heights above 64 pixels that no coarser one does."""
    heights = heights_px(levels[0], levels[1:])
    kept: list[tuple[int, int | None]] = [(0, None)]
    notes = []
    for index, height in enumerate(heights, 1):
        count = levels[index].gaussians.count
        if height <= LEAST_PX:
            notes.append(fact("level_unlike", count=count, least=LEAST_PX))
        elif height <= max(heights[index:], default=0):
            notes.append(fact("level_served", count=count, height=height))
        else:
            kept.append((index, height))
    indices, of_kept = zip(*kept, strict=True)
    return Served(indices, of_kept, tuple(notes))


def heights_px(full: Avatar, levels: Sequence[Avatar]) -> list[int]:
    """Of each level the largest `height_px` up to which it looks like `full`; 0 without one.

    Tried heights rise from 64 to 2048 physical pixels, and none beyond is claimed. Each image is judged at the height
    that is still hoped for and at every octave below, so a level serves all heights up to its own. 0 also where the
    avatar has no framing, because players then show level 0.
    """
    whole = framing(full)["whole"]
    if whole is None or not levels:
        return [0] * len(levels)
    poses = judged_poses(full)
    cameras = _Cameras(full, poses, whole)
    truth, players = _Drawing(full), [_Drawing(level) for level in levels]
    centre, best = centre_rows(full), [cameras.count - 1] * len(levels)
    for pose in poses:
        shown = _Shown(truth, pose, cameras, centre)
        for index, player in enumerate(players):
            if best[index] >= 0:
                best[index] = _judged(best[index], shown, player)
    return [cameras.height(step) if step >= 0 else 0 for step in best]


def _judged(best: int, shown: _Shown, player: _Drawing) -> int:
    """The last step up to `best` at which `player` is like what is shown from every side; -1 without one."""
    drawn = player.posed(shown.pose)
    for view in range(len(YAWS)):

        def alike(step: int, view: int = view) -> bool:
            image = player.image(drawn, shown.cameras.at(step, view))
            return not differ(shown.image(step, view), image, shown.face(step, view))

        best = _served(best, alike)
    return best


def _served(best: int, alike: Callable[[int], bool]) -> int:
    """The last step up to `best` at which an image is `alike`, as it is at all octaves below; -1 without one."""
    for step in range(0, best, STEPS_AN_OCTAVE):
        if not alike(step):
            best = step - 1
            break
    while best >= 0 and not alike(best):
        best -= 1
    return best


def differ(wanted: Image, drawn: Image, face: tuple[slice, slice] | None) -> bool:
    """Whether `drawn` looks different from `wanted`, both over black: as a whole, in the box `face`, or in a block."""
    inside = 1 - wanted.transmittance > COVERED
    with np.errstate(all="ignore"):
        error = np.mean((drawn.colour - wanted.colour) ** 2, axis=2)
    error = np.where(inside, error, np.float32(0))
    if not _mean(error, inside) <= 10 ** (-IMAGE_DB / 10):
        return True
    if face is not None and not _mean(error[face], inside[face]) <= 10 ** (-FACE_DB / 10):
        return True
    count = _windows(inside.astype(np.float32))
    dense = count >= BLOCK * BLOCK / 2
    return not bool((_windows(error)[dense] <= 10 ** (-BLOCK_DB / 10) * count[dense]).all())


def box_of(mean: F32, camera: Camera) -> tuple[slice, slice]:
    """Rows and columns of the image that hold the middle 96 % of the positions [n, 3]."""
    clip = np.concatenate([mean, np.ones((len(mean), 1))], axis=1) @ camera.clip_from_world.T
    with np.errstate(all="ignore"):
        at = (clip[:, :2] / clip[:, 3:] + 1) / 2 * (camera.width, camera.height)
    low, high = np.percentile(np.nan_to_num(at), [2, 98], axis=0).clip(0, camera.width)
    return slice(int(low[1]), int(np.ceil(high[1]))), slice(int(low[0]), int(np.ceil(high[0])))


def _mean(error: F32, inside: Mask) -> float:
    """Mean of `error`, which is 0 outside, over `inside`; 0 where that is nowhere."""
    return float(error.sum(dtype=np.float64)) / max(int(np.count_nonzero(inside)), 1)


def _windows(values: F32) -> npt.NDArray[np.float64]:
    """Sums of [H, W] over blocks that begin at every BLOCK / 2 pixels; what hangs over an edge is padded with 0."""
    half = BLOCK // 2
    height, width = (max(2, -(-size // half)) for size in values.shape)
    padded = np.zeros((height * half, width * half))
    padded[: values.shape[0], : values.shape[1]] = values
    cells = padded.reshape(height, half, width, half).sum(axis=(1, 3))
    result: npt.NDArray[np.float64] = cells[1:, 1:] + cells[:-1, 1:] + cells[1:, :-1] + cells[:-1, :-1]
    return result


class _Cameras:
    """The judging cameras at every step of the heights; all stand at the same distance."""

    def __init__(self, full: Avatar, poses: Sequence[Pose], whole: Mapping[str, Any]) -> None:
        self.box = seen(full, *poses[:: -(-len(poses) // FRAMED_POSES)])
        self.whole = whole
        self.at = cache(self._at)
        self.unit = min(self._height(self._camera(SIDE, view)) for view in range(len(YAWS))) / SIDE
        self.count = OCTAVES * STEPS_AN_OCTAVE + 1

    def _at(self, step: int, view: int) -> Camera:
        """The camera of a view in whose image the avatar is at least as high as `step` says."""
        return self._camera(int(np.ceil(LEAST_PX * 2 ** (step / STEPS_AN_OCTAVE) / self.unit)), view)

    def height(self, step: int) -> int:
        """The `height_px` that every image of `step` reaches."""
        return int(min(self._height(self.at(step, view)) for view in range(len(YAWS))))

    def _camera(self, side: int, view: int) -> Camera:
        return frame_camera(self.box, side, side, float(YAWS[view]))

    def _height(self, camera: Camera) -> float:
        return height_px(self.whole, camera.clip_from_world, None, camera.height)


class _Drawing:
    """Deforms an avatar once a pose and draws it from many sides; on one thread, because the images are small."""

    def __init__(self, avatar: Avatar) -> None:
        name = default_backend()
        self.player = Player(avatar, name, threads=1 if name == "cpu" else None)
        self.backend = cast(SplatBackend, self.player.backend)

    def posed(self, pose: Pose) -> Splats:
        return self.player.animate(pose)

    @ABSURD
    def image(self, splats: Splats, camera: Camera) -> Image:
        return self.backend.draw(splats, camera, BLACK, self.backend.profiles[0], Clock())


class _Shown:
    """Full detail in one pose: its images, each drawn once, and where the centre of the face is in them."""

    def __init__(self, player: _Drawing, pose: Pose, cameras: _Cameras, centre: I64 | None) -> None:
        self.pose, self.cameras = pose, cameras
        splats = player.posed(pose)
        self.image = cache(lambda step, view: player.image(splats, cameras.at(step, view)))
        self.centre = None if centre is None else splats.mean[centre]

    def face(self, step: int, view: int) -> tuple[slice, slice] | None:
        """Rows and columns of the image around the centre of the face; None without."""
        return None if self.centre is None else box_of(self.centre, self.cameras.at(step, view))
