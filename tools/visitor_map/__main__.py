"""`python -m tools.visitor_map`: draws people, asks MediaPipe, writes the page's table, and says how well it reads."""

from __future__ import annotations

import argparse
import base64
from pathlib import Path

import numpy as np
from mediapipe.tasks.python.vision.face_landmarker import Blendshapes

from avatar_trainer.film.fit.landmark_map import load
from avatar_trainer.head import load_head_model
from tools.landmark_map.faces import Array
from tools.visitor_map.faces import AT_REST, drawn
from tools.visitor_map.fit import People, Row, mirrored_columns, rows, turns, turns_off
from tools.visitor_map.measures import LANDMARKS, STABLE, features, too_little

MADE = Path(__file__).parents[2] / "players" / "web" / "src" / "made"
CACHE = Path(__file__).parents[2] / ".cache" / "visitor_map"
PEOPLE = 28


def score_names() -> list[str]:
    """MediaPipe's, as it spells them."""
    words = [shape.name.lower().strip("_").split("_") for shape in Blendshapes]
    return [
        "_neutral" if word == ["neutral"] else word[0] + "".join(part.capitalize() for part in word[1:])
        for word in words
    ]


def gathered(files: list[dict[str, Array]]) -> People:
    """Every picture, and once more as a mirror shows it."""
    names = list(load_head_model().expression_names)
    order, signs, weights = mirrored_columns(names, score_names(), mirrored_landmarks())
    x, y, turned, person = [], [], [], []
    for number, file in enumerate(files):
        at_rest = file["number"] < AT_REST
        seen = features(file["landmarks"], file["scores"], file["matrix"], at_rest)
        off = too_little(file["matrix"], file["rotation"], at_rest)
        x += [seen, seen[:, order] * signs]
        y += [file["weights"], file["weights"][:, weights]]
        turned += [off, off * (-1, 1, -1)]
        person += [np.full(len(seen), number)] * 2
    return People(*map(np.concatenate, (x, y, turned, person)))


def mirrored_landmarks() -> Array:
    """[478] the landmark on the other side of the face."""
    x, y = load().template.T
    return np.array([np.argmin(np.hypot(x + x[k], y - y[k])) for k in range(len(x))])


def text(table: Array) -> str:
    """The table [52 + 3, C] as TypeScript: a signed byte a number, and the scale of each row."""
    scales = np.abs(table).max(axis=1) / 127
    small = np.round(table / np.where(scales > 0, scales, 1)[:, None]).astype(np.int8)
    numbers = ", ".join(f"{scale:.6g}" for scale in scales)
    names = " ".join(score_names())
    return f"""// Made by `python -m tools.visitor_map`.

/** MediaPipe's landmarks that are measured. */
export const LANDMARKS: readonly number[] = [{", ".join(map(str, LANDMARKS))}];
/** Which of them, by place, the face's muscles hardly move. */
export const STABLE: readonly number[] = [{", ".join(str(LANDMARKS.index(one)) for one in STABLE)}];
/** MediaPipe's scores, in its order. */
export const SCORE_NAMES: readonly string[] = "{names}".split(" ");
/** A row for each ARKit name, then yaw, pitch, roll; over scores, x and y of landmarks, turn. Times SCALES. */
export const TABLE = Int8Array.from(atob("{base64.b64encode(small.tobytes()).decode()}"), (one) => one.charCodeAt(0));
export const SCALES: readonly number[] = [{numbers}];
"""


def trust(found: dict[str, Row]) -> str:
    """How well each weight is read, as TypeScript."""
    lines = "".join(f"  {name}: {max(np.nan_to_num(row.r), 0):.2f},\n" for name, row in found.items())
    return f"""// Made by `python -m tools.visitor_map`.

/** Correlation of a weight that is read with the true one, on drawn people who were held out; 0: it is not read. */
export const TRUST: Readonly<Record<string, number>> = {{
{lines}}};
"""


def main() -> None:
    """The command."""
    parser = argparse.ArgumentParser(prog="python -m tools.visitor_map", description=__doc__)
    parser.add_argument("--people", type=int, default=PEOPLE, help="of whom each is drawn 60 times")
    people = gathered(drawn(CACHE, parser.parse_args().people))
    found = rows(people, list(load_head_model().expression_names), score_names())
    print(f"{'':20}  score alone  as read")
    for name, row in found.items():
        print(f"{name:20} {row.score_r:8.2f} {row.r:12.2f}")
    for axis, before, after in zip(("yaw", "pitch", "roll"), *turns_off(people), strict=True):
        print(f"head {axis:15} {before:8.2f} {after:12.2f}  degrees")
    table = np.concatenate([[row.table for row in found.values()], turns(people)])
    (MADE / "face_map.ts").write_text(text(table), "utf-8")
    (MADE / "face_trust.ts").write_text(trust(found), "utf-8")


if __name__ == "__main__":
    main()
