"""Vectors of `height_px` and of the choice of a level, for every player: SPEC.md section 18.

    python -m tests.conformance.height_vectors

rewrites `height_px.json`. No code of the project is used: a pinhole camera shows a length at a depth with focal / depth
pixels a metre, and levels of sequences are written by hand.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

FILE = Path(__file__).with_suffix("").with_name("height_px.json")
TARGET, SIZE = np.array([0.03, 1.25, -0.02]), np.array([0.5, 1.75, 0.25])
Array = npt.NDArray[np.float64]
# Heights up to which each level is meant, None: any; the level that is shown before, -1: none; then height:level.
SEQUENCES = {
    "far": ([None, 400, 100], -1, "1000:0 410:0 380:0 364:0 363:1 111:1 100:1 91:1 90:2"),
    "near": ([None, 400, 100], 2, "50:2 105:2 109:2 111:1 420:1 439:1 441:0 inf:0"),
    "none is shown yet": ([None, 400, 100], -1, "399:1"),
    "a border serves the coarser": ([None, 400, 100], -1, "400:1"),
    "a border keeps the finer": ([None, 400, 100], 0, "400:0 100:2"),
    "equal borders": ([None, 300, 300], -1, "300:2 320:2 331:0 280:0 272:2"),
    "a coarser level serves more": ([None, 100, 300], -1, "250:2 90:2 331:0"),
    "a level without a height": ([None, None, 200], -1, "150:2 221:0"),
    "one level": ([None], -1, "1:0 inf:0"),
    "nothing is seen": ([None, 400, 100], 0, "0:2 inf:0"),
}


def turn(*angles: float) -> Array:
    """A rotation about x, then y, then z, radians."""
    made = np.eye(3)
    for axis, angle in enumerate(angles):
        one, (a, b) = np.eye(3), ((axis + 1) % 3, (axis + 2) % 3)
        one[a, a] = one[b, b] = math.cos(angle)
        one[b, a], one[a, b] = math.sin(angle), -math.sin(angle)
        made = one @ made
    return made


def placed(scale: float, rotation: Array, at: tuple[float, float, float]) -> Array:
    """[4, 4]"""
    made = np.eye(4)
    made[:3, :3], made[:3, 3] = scale * rotation, at
    return made


def case(
    name: str,
    distance: float,  # metres along the axis of the camera, from the target; below 0: behind it
    focal: float,  # pixels; of an orthographic camera, pixels a metre
    image: tuple[int, int],
    camera_turn: Array,
    place: Array,
    pose: Array | None = None,
    *,
    orthographic: bool = False,
) -> dict[str, Any]:
    """A camera that sees the placed target a little beside its axis."""
    pose = np.eye(4) if pose is None else pose
    world = place @ pose
    target = world[:3, :3] @ TARGET + world[:3, 3]
    right, down, forward = camera_turn
    width, height = image
    centre = target - distance * forward + 0.1 * right - 0.07 * down
    rows = [2 * focal / width * right, 2 * focal / height * down, 0.5 * forward, forward]
    clip = np.array([[*row, -row @ centre] for row in rows])
    if orthographic:
        clip[3] = [0, 0, 0, 1]
    scale = math.sqrt(sum(world[:3, 0] ** 2))
    seen = focal * scale * SIZE[1] / (1 if orthographic else distance)
    return {
        "name": name,
        "clip_from_world": clip.astype(np.float32).ravel().tolist(),
        "image_px": list(image),
        "place": place.ravel().tolist(),
        "pose": pose.ravel().tolist(),  # world_from_avatar of the pose, right-handed and rigid: it comes first
        "world_from_avatar": world.ravel().tolist(),
        "height_px": seen if orthographic or distance > 0 else None,  # None: infinite
    }


def cases() -> Iterator[dict[str, Any]]:
    """Cameras near, far and behind, turned, rolled, orthographic; avatars that are placed, scaled and turned."""
    still, ahead = np.eye(4), turn(math.pi, 0, 0)  # along -z, as an image of a face is taken
    aside, rolled = turn(math.pi + 0.2, 0.5, 0.1), turn(math.pi, 0.3, 1.2)
    moved = placed(1, turn(0.3, -1.2, 0.4), (2.0, -0.5, 3.0))
    yield case("near", 0.8, 900, (640, 480), ahead, still)
    yield case("far", 40, 900, (640, 480), ahead, still)
    yield case("a screen of twice the pixels", 0.8, 1800, (1280, 960), ahead, still)
    yield case("behind", -2, 900, (640, 480), ahead, still)
    yield case("turned camera", 2, 700, (1280, 900), aside, still)
    yield case("rolled camera", 2, 700, (1280, 900), rolled, still)
    yield case("upright image", 2, 700, (390, 844), aside, still)
    yield case("turned and moved avatar", 2, 700, (1280, 900), aside, moved)
    for scale in (0.01, 0.4, 100.0):
        yield case(
            f"scale {scale}",
            3 * scale,
            700,
            (1280, 900),
            aside,
            placed(scale, turn(0.1, 0.7, -0.2), (1, 2, -3)),
        )
    yield case(
        "turned by its pose", 3, 700, (1280, 900), rolled, placed(1.5, turn(0, 2, 0), (1, 0, 0)), moved
    )
    yield case("orthographic", 3, 250, (800, 600), ahead, still, orthographic=True)
    yield case(
        "orthographic, behind and scaled",
        -3,
        250,
        (800, 600),
        rolled,
        placed(2, turn(1, 1, 1), (0, 1, 0)),
        orthographic=True,
    )


def made() -> dict[str, Any]:
    """What the file holds."""
    sequences = []
    for name, (levels, shown, said) in SEQUENCES.items():
        steps = [one.split(":") for one in said.split()]
        told = [[None if height == "inf" else float(height), int(level)] for height, level in steps]
        sequences.append({"name": name, "levels": levels, "shown": shown, "steps": told})
    whole = {"target": TARGET.tolist(), "size": SIZE.tolist()}
    return {"framing_whole": whole, "heights": list(cases()), "sequences": sequences}


def text(document: dict[str, Any]) -> str:
    """JSON with a line for each case."""
    parts = []
    for key, value in document.items():
        lines = ",\n".join("  " + json.dumps(one) for one in value) if isinstance(value, list) else ""
        parts.append(f' "{key}": ' + (f"[\n{lines}\n ]" if lines else json.dumps(value)))
    return "{\n" + ",\n".join(parts) + "\n}\n"


if __name__ == "__main__":
    FILE.write_text(text(made()), "utf-8")
