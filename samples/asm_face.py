"""The sample head as a bone-driven face: `python -m samples.asm_face OUT.npz`.

The ICT topology fitted to the Perry-Smith scan, with the head's colours; then its poses to expressions of the sample
head, with the binding as it is. OUT.npz holds the take `neutral` and the take `expressions`, one ARKit expression
after the other.
"""

from __future__ import annotations

import argparse
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from avatar_export.asm.files import save
from avatar_export.asm.model import AsmFace, Take
from avatar_trainer.machine import reproducible
from avatar_trainer.systems.asm_align import Scan
from avatar_trainer.systems.asm_register import (
    Registration,
    register,
    register_takes,
    scan_error,
    template_keypoints,
)
from avatar_trainer.systems.asm_register_settings import RegisterSettings
from samples.asm_data import load_asm_head
from samples.asm_scans import head_scan
from samples.head import unit
from samples.texture_scan import nearest_points

NAME = "asm_head"
SKIN = ("face", "head")  # parts of the sample head that the template covers
EXPRESSIONS = (
    *("jawOpen", "mouthSmileLeft", "mouthSmileRight", "mouthPucker", "mouthFunnel", "mouthFrownLeft"),
    *("browInnerUp", "browDownLeft", "eyeBlinkLeft", "eyeBlinkRight", "cheekPuff", "noseSneerLeft"),
)
NEUTRAL_FIT = RegisterSettings()
# Poses alone, towards vertices that are known; expressions are larger than what tells people apart.
POSE_FIT = RegisterSettings(
    variant="static",
    placed=True,
    learning_rate=3e-3,
    prior=1e-4,
    widened=9.0,
    last_cap_mm=100.0,
    first_cap_mm=100.0,
)
FPS, RISE, HOLD, REST = 30.0, 8, 4, 4  # frames of an expression
REACH_CM = 2.0

Array = npt.NDArray[Any]


def fitted_face() -> tuple[AsmFace, dict[str, float]]:
    """(the face, mean errors in mm: scan to mesh of the neutral, then vertices of each expression)."""
    scan = head_scan(load_asm_head("lee_perry_smith"))
    head = load_asm_head("ict")
    neutral = register(head.template, head.bindings[2], scan, NEUTRAL_FIT)
    found, colour = expressions(neutral)
    error = {"neutral, scan to mesh": scan_error(neutral, scan).mean_mm}
    rest = neutral.face.takes[0]
    fits = register_takes(head.template, neutral.face.binding, found, POSE_FIT, start=rest)
    for given, vertices in zip(found, fits.vertices, strict=True):
        moved = np.linalg.norm(given.points - neutral.vertices[0], axis=1) > 1e-3
        error[given.name] = float(1e3 * np.linalg.norm(vertices - given.points, axis=1)[moved].mean())
    keys = [rest, *fits.face.takes]
    takes = (rest, in_turn(keys[0], keys[1:]))
    template = replace(head.template, colour=colour)
    return AsmFace(NAME, template, neutral.face.binding, takes), error


def expressions(neutral: Registration) -> tuple[list[Scan], npt.NDArray[np.float32]]:
    """(EXPRESSIONS of a fitted face with its vertices, colours [V, 3]).

    Each vertex goes as the nearest point of the sample head goes that faces its way, so lips and lids stay apart.
    """
    vertices, triangles = neutral.vertices[0], neutral.face.template.triangles.astype(np.int64)
    with np.load(Path(__file__).parent / "data" / "head.npz", allow_pickle=False) as file:
        head = {key: file[key] for key in file.files}
    kept = np.isin(head["part"], [list(head["part_names"]).index(name) for name in SKIN])
    rows = head["triangles"][kept].astype(np.int64)
    corner = head["vertices"].astype(np.float64)[rows]
    facing = unit(np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]))
    near, share, far = (
        np.empty(len(vertices), np.int64),
        np.zeros((len(vertices), 3)),
        np.empty(len(vertices)),
    )
    points = neutral.vertices[0] * 100
    nearest_points(points, _normals(points, triangles), corner, facing, REACH_CM, near, share, far)
    known = near >= 0

    def carried(values: Array) -> Array:
        """Values [V', 3] of the head's vertices at the face's; 0 where nothing is near."""
        at: Array = np.einsum("nk,nkx->nx", share, values.astype(np.float64)[rows[near]]) * known[:, None]
        return at

    names = [str(name) for name in head["expression_names"]]
    keypoints = template_keypoints(neutral.face.template)
    found = []
    for name in EXPRESSIONS:
        k = names.index(name)
        part = slice(*head["expression_ptr"][k : k + 2])
        offset = np.zeros(head["vertices"].shape)
        offset[head["expression_index"][part]] = head["expression_offset"][part]
        goal = vertices + carried(offset) / 100
        found.append(Scan(name, goal, triangles, keypoints, np.where(known, np.arange(len(goal)), -1)))
    colour = np.where(known[:, None], carried(head["colors"]) / 255, 0.5)
    return found, colour.astype(np.float32)


def in_turn(rest: Take, keys: list[Take]) -> Take:
    """One take: from rest to each key and back, at a constant pace; rotation vectors and scales are interpolated."""
    rise = np.arange(1, RISE + 1) / RISE
    weight = np.concatenate([rise, np.ones(HOLD), rise[::-1][1:], np.zeros(1 + REST)])[:, None, None]

    def part(name: str) -> npt.NDArray[np.float64]:
        still = getattr(rest, name)
        return np.concatenate([still, *(still + weight * (getattr(key, name) - still) for key in keys)])

    return Take("expressions", FPS, part("rotation_vector"), part("translation"), part("scale"))


def _normals(vertices: Array, triangles: Array) -> Array:
    corner = vertices[triangles]
    across = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    found = np.zeros_like(vertices)
    for k in range(3):
        np.add.at(found, triangles[:, k], across)
    return unit(found)


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m samples.asm_face", description=__doc__)
    parser.add_argument("out", type=Path, help="FACE.npz to write")
    out: Path = parser.parse_args().out
    with reproducible(0, threads=0):
        face, error = fitted_face()
    save(face, out)
    for name, value in error.items():
        print(f"{value:8.3f} mm  {name}")
    print(f"{out}: {len(face.takes[1].scale)} frames of {len(EXPRESSIONS)} expressions")


if __name__ == "__main__":
    main()
