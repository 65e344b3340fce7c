"""The sample head as a bone-driven face: `python -m samples.asm.face OUT.npz`.

The ICT template fitted to the head and to its expressions at once; they have its topology, so that all vertices are
known. OUT.npz holds the head's colours, the take `neutral`, and the take `expressions`: one ARKit expression after
the other.
"""

from __future__ import annotations

import argparse
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import numpy.typing as npt

from avatar_export.asm.files import save
from avatar_export.asm.model import AsmFace, Take
from avatar_runtime.avatar import F64
from avatar_trainer.asm.align import KEYPOINTS, Scan
from avatar_trainer.asm.register.fit import register_takes
from avatar_trainer.asm.register.settings import RegisterSettings
from avatar_trainer.head import head_arrays
from avatar_trainer.loop.machine import reproducible
from samples.asm.data import DATA, AsmHead, load_asm_head

NAME = "asm_head"
COMPONENTS = 5  # of a bone's mixture
MOVES = 1e-3  # metres; a vertex that moves less does not take part in an expression
EXPRESSIONS = (
    *("jawOpen", "mouthSmileLeft", "mouthSmileRight", "mouthPucker", "mouthFunnel", "mouthFrownLeft"),
    *("browInnerUp", "browDownLeft", "eyeBlinkLeft", "eyeBlinkRight", "cheekPuff", "noseSneerLeft"),
)
# All vertices are known, so nothing slides and nothing is left out. Expressions are larger than the differences
# between people, for which the steps and the prior were chosen.
FIT = RegisterSettings(
    iterations=200,
    learning_rate=5e-3,
    prior=1e-4,
    smooth=3.0,
    widened=9.0,
    first_cap_mm=100.0,
    last_cap_mm=100.0,
    placed=True,
)
FPS, RISE, HOLD, REST = 30.0, 6, 3, 2  # frames of an expression


def fitted_face() -> tuple[AsmFace, dict[str, float]]:
    """(the face, mean distance in mm of its vertices from the head's: neutral, then each expression where it moves)."""
    ict, head = load_asm_head("ict"), sample_head()
    rest = head.vertices[: len(ict.template.vertices)]
    goals = [rest, *(rest + offset[: len(rest)] for offset in head.offsets)]
    scans = [known(name, goal, ict) for name, goal in zip((NAME, *EXPRESSIONS), goals, strict=True)]
    found = register_takes(ict.template, ict.bindings[COMPONENTS], scans, FIT)
    error = {"neutral": _mean_mm(found.vertices[0], rest)}
    for name, goal, vertices in zip(EXPRESSIONS, goals[1:], found.vertices[1:], strict=True):
        moves = np.linalg.norm(goal - rest, axis=1) > MOVES
        error[name] = _mean_mm(vertices[moves], goal[moves])
    template = replace(ict.template, colour=head.colour[: len(rest)])
    still, *poses = found.face.takes
    return replace(found.face, template=template, takes=(still, in_turn(still, poses))), error


@dataclass(frozen=True)
class SampleHead:
    """data/head.npz, whose first vertices are the ICT template's, in its order."""

    vertices: F64  # [V', 3] metres
    colour: npt.NDArray[np.float32]  # [V', 3] 0..1
    offsets: list[F64]  # [V', 3] metres, of EXPRESSIONS


def sample_head() -> SampleHead:
    """The head with its expressions."""
    with np.load(DATA / "head.npz", allow_pickle=False) as file:
        vertices, colours = file["vertices"], file["colors"]
    data = head_arrays()
    names = data["expression_names"].tolist()
    offsets = []
    for name in EXPRESSIONS:
        part = slice(*data["expression_ptr"][names.index(name) :][:2])
        offset = np.zeros(vertices.shape)
        offset[data["expression_index"][part]] = data["expression_offset"][part].astype(np.float64) / 100
        offsets.append(offset)
    return SampleHead(vertices.astype(np.float64) / 100, colours.astype(np.float32) / 255, offsets)


def known(name: str, vertices: F64, ict: AsmHead) -> Scan:
    """A scan [V, 3] in the template's own vertices."""
    marks = {key: vertices[ict.template.landmarks[mark]] for key, mark in KEYPOINTS.items()}
    return Scan(name, vertices, None, marks, np.arange(len(vertices)))


def in_turn(rest: Take, keys: list[Take]) -> Take:
    """One take: from rest to each key and back, at a constant pace; rotation vectors and scales are interpolated."""
    rise = np.arange(1, RISE + 1) / RISE
    weight = np.concatenate([rise, np.ones(HOLD), rise[::-1][1:], np.zeros(1 + REST)])[:, None, None]

    def part(name: str) -> npt.NDArray[np.float64]:
        still = getattr(rest, name)
        return np.concatenate([still, *(still + weight * (getattr(key, name) - still) for key in keys)])

    return Take("expressions", FPS, part("rotation_vector"), part("translation"), part("scale"))


def _mean_mm(a: F64, b: F64) -> float:
    return float(1e3 * np.linalg.norm(a - b, axis=1).mean())


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m samples.asm.face", description=__doc__)
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
