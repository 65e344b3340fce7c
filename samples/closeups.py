"""Whether an avatar is clean close up: `python -m samples.closeups BUNDLE TRUTH [--sheet FILE.png]`.

TRUTH is a folder of `python -m samples.capture TRUTH --unseen 20 --size 1024`: poses that no training saw. The bundle
plays them, and the crops of eyes, mouth, glasses and the whole head are compared. PSNR and SSIM say how sharp and how
true a crop is as a whole. One needle or a trace of an iris on a closed lid hardly changes them. So what does not belong
there (`stray`) is judged by its worst block of 16x16 pixels, too, and once more by the worst where the truth is smooth.

Exit code 1, and a line for each limit that is missed.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import reduce
from operator import attrgetter
from pathlib import Path
from statistics import fmean

import numpy as np
import numpy.typing as npt
from PIL import Image

from avatar_runtime.avatar import Avatar
from avatar_runtime.bundle import load as load_bundle
from avatar_runtime.io.errors import AvatarError
from avatar_runtime.player import Player
from avatar_trainer.captures.load import load
from avatar_trainer.captures.model import Capture, Frame
from avatar_trainer.captures.targets import read
from avatar_trainer.evaluation.bundle import PROFILE, left_out, pose_of
from avatar_trainer.losses import psnr_db, ssim
from samples.capture.unseen import Box, read_crops

F32 = npt.NDArray[np.float32]
F64 = npt.NDArray[np.float64]
Drawn = Callable[[Frame], F32]  # the image [H, W, 3] of a frame, over black

BLOCK, STEP = 16, 8  # pixels: edge of a block, distance of two
REACH = 3  # pixels: how far a colour of the truth may lie from where the avatar shows it
# A block is smooth where, in it and SURROUND pixels around it, colours within REACH differ by less than SMOOTH
# on average.
SURROUND, SMOOTH = 8, 0.04


@dataclass(frozen=True)
class Limits:
    """What every crop of a region reaches; dB with peak 1."""

    mean_db: float
    worst_db: float
    mean_ssim: float
    worst_ssim: float
    block_db: float  # of `stray` in the worst block
    smooth_db: float  # in the worst of the smooth blocks


# By the last word of a region's name. Set on earlier samples, trained at 256x256, which miss them, and on blurred
# truth, not on the samples that are shipped. A lid is an eye that is shut: on smooth skin less shows through.
LIMITS = {
    "head": Limits(29, 28, 0.95, 0.94, 20, 24),
    "face": Limits(27, 25, 0.93, 0.91, 16, 24),
    "eye": Limits(26, 22, 0.90, 0.83, 18, 24),
    "lid": Limits(31, 30, 0.93, 0.92, 26, 26),
    "mouth": Limits(26, 24, 0.90, 0.88, 16, 24),
    "glasses": Limits(25, 22, 0.85, 0.80, 14, 22),
}


@dataclass(frozen=True)
class Crop:
    """A region of one frame, compared."""

    frame: str
    region: str
    box: Box
    psnr_db: float
    ssim: float
    block_db: float
    block: tuple[int, int]  # left and top of the worst block, pixels of the frame
    smooth_db: float
    smooth: tuple[int, int]
    wanted: F32  # [h, w, 3] 0..1
    drawn: F32


def stray(drawn: F32, wanted: F32) -> tuple[F32, F32]:
    """([H, W] mean square over the channels of how far `drawn` is outside the range of the colours that `wanted` has
    within REACH pixels, [H, W] the mean width of that range).

    A soft edge stays inside the range; a needle, a hole and a trace of what should be hidden do not.
    """
    low, high = _nearby(wanted, np.minimum), _nearby(wanted, np.maximum)
    off = np.maximum(drawn - high, 0) + np.maximum(low - drawn, 0)
    return np.square(off).mean(axis=-1), (high - low).mean(axis=-1)


def _nearby(image: F32, pick: Callable[[F32, F32], F32]) -> F32:
    """The smallest or largest value of each channel within REACH pixels."""
    height, width = image.shape[:2]
    padded, shifts = np.pad(image, ((REACH, REACH), (REACH, REACH), (0, 0)), "edge"), range(2 * REACH + 1)
    below = reduce(pick, (padded[k : k + height] for k in shifts))
    return reduce(pick, (below[:, k : k + width] for k in shifts))


def block_means(plane: F32, around: int = 0) -> F64:
    """Means [rows, columns] of the blocks of a plane [H, W], with `around` pixels on every side that the plane has."""
    total = np.pad(plane.astype(np.float64), ((1, 0), (1, 0))).cumsum(0).cumsum(1)
    starts = [np.arange(0, max(n - BLOCK, 0) + 1, STEP) for n in plane.shape]
    top, left = (np.maximum(start - around, 0) for start in starts)
    bottom, right = (np.minimum(s + BLOCK + around, n) for s, n in zip(starts, plane.shape, strict=True))
    inside = total[np.ix_(bottom, right)] - total[np.ix_(top, right)]
    inside -= total[np.ix_(bottom, left)] - total[np.ix_(top, left)]
    result: F64 = inside / np.outer(bottom - top, right - left)
    return result


def worst(means: F64) -> tuple[float, tuple[int, int]]:
    """(PSNR in dB of the worst block, its left and top in pixels)."""
    row, column = np.unravel_index(means.argmax(), means.shape)
    return float(-10 * np.log10(max(means[row, column], 1e-10))), (STEP * int(column), STEP * int(row))


def compared(truth: Capture, drawn: Drawn) -> Iterator[Crop]:
    """Every crop of the truth's frames. AvatarError for a folder without boxes and an image that cannot be read."""
    boxes = read_crops(truth.folder)
    for frame in truth.test:
        target = read(frame)
        wanted = target.over(target.mask.new_zeros(3))
        shown = wanted.new_tensor(np.clip(drawn(frame), 0, 1))
        off, varied = stray(shown.numpy(), wanted.numpy())
        for region, (left, top, right, bottom) in boxes[frame.name].items():
            part = (slice(top, bottom), slice(left, right))
            blocks = block_means(off[part])
            block_db, (x, y) = worst(blocks)
            smooth_db, (u, v) = worst(np.where(block_means(varied[part], SURROUND) < SMOOTH, blocks, 0))
            yield Crop(
                frame.name,
                region,
                (left, top, right, bottom),
                psnr_db(shown[part], wanted[part]),
                float(ssim(shown[part], wanted[part])),
                block_db,
                (left + x, top + y),
                smooth_db,
                (left + u, top + v),
                wanted[part].numpy(),
                shown[part].numpy(),
            )


def played(avatar: Avatar, truth: Capture, backend: str | None = "cpu") -> Drawn:
    """The frames of the truth by the avatar, in the poses that `avatar-train evaluate` plays."""
    player = Player(avatar, backend)

    def drawn(frame: Frame) -> F32:
        return player.frame(
            pose_of(truth, avatar, frame), frame.camera, (0.0, 0.0, 0.0), PROFILE
        ).image.colour

    return drawn


def judged(crops: list[Crop]) -> tuple[list[str], list[str]]:
    """(a table, a line for every limit that is missed)."""
    titles = f"{'PSNR dB':>9}{'worst':>7}{'SSIM':>8}{'worst':>8}{'worst block dB':>16}{'smooth':>8}"
    lines = [f"{'region':<10}{'crops':>6}{titles}"]
    missed = []
    for region in dict.fromkeys(crop.region for crop in crops):
        own, limit = [crop for crop in crops if crop.region == region], LIMITS[region.rpartition("_")[2]]
        measures = ("psnr_db", "ssim", "block_db", "smooth_db")
        dim, unlike, spoilt, stained = (min(own, key=attrgetter(name)) for name in measures)
        mean, like = fmean(c.psnr_db for c in own), fmean(c.ssim for c in own)
        lines.append(
            f"{region:<10}{len(own):>6}{mean:>9.2f}{dim.psnr_db:>7.2f}{like:>8.4f}{unlike.ssim:>8.4f}"
            f"{spoilt.block_db:>16.2f}{stained.smooth_db:>8.2f}"
        )
        for what, found, least, at in (
            ("mean PSNR, dB", mean, limit.mean_db, ""),
            ("PSNR, dB", dim.psnr_db, limit.worst_db, f", frame {dim.frame}"),
            ("mean SSIM", like, limit.mean_ssim, ""),
            ("SSIM", unlike.ssim, limit.worst_ssim, f", frame {unlike.frame}"),
            ("block, dB", spoilt.block_db, limit.block_db, f", frame {spoilt.frame} at {spoilt.block}"),
            (
                "smooth, dB",
                stained.smooth_db,
                limit.smooth_db,
                f", frame {stained.frame} at {stained.smooth}",
            ),
        ):
            if not found >= least:
                missed.append(f"{region}: {what}: {found:.4g}, the least is {least:g}{at}")
    return lines, missed


def main() -> None:
    """The command."""
    parser = argparse.ArgumentParser(
        prog="python -m samples.closeups",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("bundle", type=Path, help="bundle or pack of a sample head")
    parser.add_argument("truth", type=Path, help="folder of samples.capture --unseen")
    parser.add_argument(
        "--sheet", type=Path, metavar="FILE.png", help="truth, avatar and difference of every crop"
    )
    given = parser.parse_args()
    try:
        avatar, truth = load_bundle(given.bundle), load(given.truth)
        crops = list(compared(truth, played(avatar, truth)))
    except AvatarError as error:
        parser.exit(2, f"error: {error}\n")
    lines, missed = judged(crops)
    print("\n".join([*(f"note: {note}" for note in left_out(truth, avatar)), *lines, *missed]))
    if given.sheet:
        sheet(crops).save(given.sheet)
    sys.exit(bool(missed))


TILE = (220, 150)  # pixels of a crop in the sheet
GAIN = 4  # of the difference


def sheet(crops: list[Crop]) -> Image.Image:
    """A row for each pose; of each crop the truth, the avatar and GAIN times the difference, the worst block framed."""
    rows: list[list[Crop]] = []
    for crop in crops:
        if crop.region == "head":
            rows.append([])
        rows[-1].append(crop)
    page = Image.new("RGB", (3 * TILE[0] * max(map(len, rows)), TILE[1] * len(rows)))
    for j, row in enumerate(rows):
        for i, crop in enumerate(row):
            for k, values in enumerate((crop.wanted, crop.drawn, _difference(crop))):
                tile = Image.fromarray(np.round(np.clip(values, 0, 1) * 255).astype(np.uint8))
                tile.thumbnail(TILE, Image.Resampling.LANCZOS)
                page.paste(tile, ((3 * i + k) * TILE[0], j * TILE[1]))
    return page


def _difference(crop: Crop) -> F32:
    shown: F32 = np.abs(crop.drawn - crop.wanted) * np.float32(GAIN)
    x, y = crop.block[0] - crop.box[0], crop.block[1] - crop.box[1]
    inner = shown[y + 1 : y + BLOCK - 1, x + 1 : x + BLOCK - 1].copy()
    shown[y : y + BLOCK, x : x + BLOCK] = (0, 1, 0)
    shown[y + 1 : y + BLOCK - 1, x + 1 : x + BLOCK - 1] = inner
    return shown


if __name__ == "__main__":
    main()
