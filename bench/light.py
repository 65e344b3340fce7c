"""Whether a relit avatar is true: `python -m bench.light BUNDLE TRUTH [--sheet FILE.png]`.

TRUTH is a folder of `python -m samples.capture TRUTH --light --size 512`, with what the avatar wears: poses and lights
that no training saw. PSNR of the pixels whose mask is above 0.5, over black. `given` divides by the light that the
truth states for the captures, `estimated` by what `--relight` finds. The baseline is the unlit avatar times the best
RGB gain of each picture, in display values or in linear light, whichever comes closer.

A truth with --shadows also has the shadow on a floor: what the avatar casts is held against it, by intersection over
union.

Exit code 1, and MISSED, where a limit is missed.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from statistics import fmean
from typing import Any

import numpy as np
import numpy.typing as npt
from PIL import Image
from samples.capture.light import CAPTURE_LIGHT, CAPTURED, FLOOR, FOLDER
from samples.capture.linear_light import display, floor, linear

from avatar_export.formats.json_text import parse_json
from avatar_export.relight import captured, relightable
from avatar_runtime.avatar import Avatar
from avatar_runtime.bundle import load as load_bundle
from avatar_runtime.io.errors import AvatarError
from avatar_runtime.light import SHADOW_SIZE, Light, light_arrays, light_of
from avatar_runtime.player import Player
from avatar_runtime.stages.light import casting, shadow_map, shadow_points
from avatar_trainer.captures.load import load, pixels
from avatar_trainer.captures.model import Capture, Frame
from avatar_trainer.evaluation.bundle import PROFILE, left_out, pose_of

Array = npt.NDArray[Any]

MEAN_DB, WORST_DB, ESTIMATED_DB, ABOVE_DB, IOU = 27.0, 23.0, 2.0, 3.0, 0.9
INSIDE = 0.5  # of the mask
GAINS, FINER, EVERY = np.geomspace(0.02, 4, 24), 24, 8  # the gain of the baseline is found on every 8th pixel
WAYS = ("given", "estimated", "baseline")


@dataclass(frozen=True)
class Score:
    """One picture; dB with peak 1, inside the mask."""

    light: str
    pose: str
    db: dict[str, float]  # by WAYS
    images: dict[str, Array]  # truth and WAYS, if kept


def db(drawn: Array, wanted: Array) -> float:
    """PSNR, peak 1."""
    return float(-10 * np.log10(max(np.mean(np.square(drawn - wanted)), 1e-10)))


def best_gain(unlit: Array, wanted: Array, inside: Array) -> Array:
    """`unlit` [H, W, 3] times the RGB gain that comes closest to `wanted` inside."""
    tried = []
    for decode, encode in ((linear, display), (np.asarray, lambda x: np.clip(x, 0, 1))):
        values, gained = decode(unlit.astype(np.float64)), np.zeros(unlit.shape)
        for c in range(3):
            gain = _closest(values[inside, c][::EVERY], encode, wanted[inside, c][::EVERY])
            gained[..., c] = encode(gain * values[..., c])
        tried.append(gained)
    return max(tried, key=lambda image: db(image[inside], wanted[inside]))


def _closest(values: Array, encode: Callable[[Array], Array], wanted: Array) -> float:
    """The gain that brings `values` nearest to `wanted`: on a grid, then on a finer one about the best."""
    grid = GAINS
    for _ in range(2):
        at = int(np.argmin([np.mean(np.square(encode(gain * values) - wanted)) for gain in grid]))
        low, high = grid[max(at - 1, 0)], grid[min(at + 1, len(grid) - 1)]
        best, grid = float(grid[at]), np.linspace(low, high, FINER)
    return best


def made_of(avatar: Avatar, truth: Capture) -> dict[str, Avatar]:
    """The avatar with the light of its capture, given and estimated."""
    found = relightable(avatar)
    assert found.relight is not None
    ambient, frame = captured(truth.folder / CAPTURE_LIGHT)
    return {
        "given": replace(found, relight=replace(found.relight, ambient=ambient, frame=frame)),
        "estimated": found,
    }


def scores(
    made: dict[str, Avatar], truth: Capture, backend: str | None = None, kept: tuple[str, ...] = ()
) -> Iterator[Score]:
    """Every picture of the truth, by what `made_of` gives; images of the poses `kept`."""
    avatar, players = made["given"], {way: Player(one, backend) for way, one in made.items()}
    lights = {file.stem: _light(file) for file in sorted((truth.folder / FOLDER).glob("*.json"))}

    def drawn(frame: Frame, way: str, light: Light | None) -> Array:
        players[way].light = light
        image = (
            players[way].frame(pose_of(truth, avatar, frame), frame.camera, (0.0, 0.0, 0.0), PROFILE).image
        )
        return np.clip(image.colour, 0, 1)

    unlit: Array = np.zeros(0, np.float32)
    for frame in truth.frames:
        name, _, pose = frame.name.rpartition("_")
        image, mask = pixels(frame)
        wanted, inside = image * mask[..., None], mask > INSIDE
        if name == CAPTURED:
            unlit = drawn(frame, "given", None)
            yield Score(name, pose, {"unlit": db(unlit[inside], wanted[inside])}, {})
            continue
        images = {way: drawn(frame, way, lights[name]) for way in players}
        images["baseline"] = best_gain(unlit, wanted, inside)
        found = {way: db(image[inside], wanted[inside]) for way, image in images.items()}
        yield Score(name, pose, found, {"truth": wanted, **images} if pose in kept else {})


def floors(avatar: Avatar, truth: Capture) -> Iterator[tuple[str, float]]:
    """(picture, intersection over union of the shadows that `avatar`, made relightable, and the truth's mesh throw)."""
    player, frames = Player(avatar), {frame.name: frame for frame in truth.frames}
    for file in sorted((truth.folder / FLOOR).glob("*.png")):
        light, frame = _light(truth.folder / FOLDER / f"{file.stem[:-3]}.json"), frames[file.stem]
        pose, at = pose_of(truth, avatar, frame), floor(light)
        assert avatar.relight is not None and at is not None
        arrays = light_arrays(light, avatar.relight, pose.world_from_avatar)
        mesh = casting(avatar, player.mesh(pose), pose.world_from_avatar)
        cast = shadow_map(player.animate(pose), arrays, mesh)
        texel, distance, _ = shadow_points(at.astype(np.float32), arrays)
        column, row = np.clip(np.rint(texel), 0, SHADOW_SIZE - 1).astype(int).T
        dark, wanted = cast[row, column] < distance, np.asarray(Image.open(file)).ravel() == 0
        yield file.stem, float((dark & wanted).sum() / (dark | wanted).sum())


def _light(file: Path) -> Light:
    return light_of(parse_json(file.read_bytes(), file.name), file.name)


def judged(found: list[Score]) -> Iterator[tuple[str, bool]]:
    """(what a limit says, whether it is missed), of each limit."""
    mean = {way: fmean(s.db[way] for s in found) for way in WAYS}
    worst = min(found, key=lambda s: s.db["given"])
    yield f"mean {mean['given']:.2f} dB, at least {MEAN_DB:g}", mean["given"] < MEAN_DB
    at = f"{worst.light}, pose {worst.pose}"
    yield f"worst {worst.db['given']:.2f} dB ({at}), at least {WORST_DB:g}", worst.db["given"] < WORST_DB
    less = mean["given"] - mean["estimated"]
    yield f"estimated {less:.2f} dB less, at most {ESTIMATED_DB:g}", less > ESTIMATED_DB
    above = mean["given"] - mean["baseline"]
    yield f"{above:.2f} dB above the baseline, at least {ABOVE_DB:g}", above < ABOVE_DB


def judged_floors(found: dict[str, float]) -> Iterator[tuple[str, bool]]:
    """As `judged`, where there are shadows on a floor."""
    if found:
        name, worst = min(found.items(), key=lambda item: item[1])
        mean = fmean(found.values())
        yield f"shadow on a floor: IoU {mean:.3f}, worst {worst:.3f} ({name}), at least {IOU:g}", worst < IOU


def table(found: list[Score]) -> Iterator[str]:
    """A row for each light."""
    yield f"{'light':<12}" + "".join(f"{way:>12}{'worst':>8}" for way in WAYS)
    for name in [*dict.fromkeys(s.light for s in found), "all"]:
        own = [s.db for s in found if name in (s.light, "all")]
        columns = ([one[way] for one in own] for way in WAYS)
        yield f"{name:<12}" + "".join(f"{fmean(values):>12.2f}{min(values):>8.2f}" for values in columns)


def sheet(found: list[Score], size: int = 200) -> Image.Image:
    """A row for each light: truth, given, estimated and baseline of each pose that was kept."""
    rows: dict[str, list[Array]] = {}
    for score in found:
        rows.setdefault(score.light, []).extend(score.images.values())
    page = Image.new("RGB", (size * max(map(len, rows.values())), size * len(rows)))
    for j, row in enumerate(rows.values()):
        for i, values in enumerate(row):
            tile = Image.fromarray(np.round(np.clip(values, 0, 1) * 255).astype(np.uint8))
            page.paste(tile.resize((size, size), Image.Resampling.LANCZOS), (i * size, j * size))
    return page


def main() -> None:
    """The command."""
    parser = argparse.ArgumentParser(
        prog="python -m bench.light",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("bundle", type=Path, help="bundle or pack of a sample head")
    parser.add_argument("truth", type=Path, help="folder of samples.capture --light")
    parser.add_argument("--backend", help="that draws; the default is the fastest that needs no GPU")
    parser.add_argument("--sheet", type=Path, metavar="FILE.png", help="a row for each light, of two poses")
    given = parser.parse_args()
    try:
        avatar, truth = load_bundle(given.bundle), load(given.truth)
        made = made_of(avatar, truth)
        found = list(scores(made, truth, given.backend, ("01", "08") if given.sheet else ()))
        shadows = list(judged_floors(dict(floors(made["given"], truth))))
    except AvatarError as error:
        parser.exit(2, f"error: {error}\n")
    plain = [s.db["unlit"] for s in found if s.light == CAPTURED]
    found = [s for s in found if s.light != CAPTURED]
    print("\n".join([*(f"note: {note}" for note in left_out(truth, avatar)), *table(found)]))
    print(f"unlit, in the light of the captures: mean {fmean(plain):.2f} dB, worst {min(plain):.2f}")
    limits = [*judged(found), *shadows]
    for said, missed in limits:
        print(f"{'MISSED' if missed else 'holds'}: {said}")
    if given.sheet:
        sheet(found).save(given.sheet)
    sys.exit(any(missed for _, missed in limits))


if __name__ == "__main__":
    main()
