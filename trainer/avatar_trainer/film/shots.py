"""What of a track goes into a capture: the person's body model, joints and weights, and masks."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from avatar_runtime import F64
from avatar_runtime.io import write_text
from avatar_trainer.captures.own import Shot
from avatar_trainer.film.fit.pose import Fit
from avatar_trainer.film.torso import Chest
from avatar_trainer.head import (
    GAUSSIAN_SHAPES,
    JOINTS,
    BodyModel,
    Head,
    driving,
    head_for,
    rotvec,
    write_body,
)

HELD_OUT = 5  # every so many frames one is held out

Picture = npt.NDArray[np.uint8]


@dataclass(frozen=True)
class Person:
    """The fitted head and its body model."""

    head: Head  # at rest
    body: BodyModel  # of the coarse mesh
    names: tuple[str, ...]  # expressions that a capture gives
    drive: F64  # [outputs, K] from weights to the body's parameters
    outputs: tuple[str, ...]

    @staticmethod
    def of(identity: F64, folder: Path) -> Person:
        """The person with this identity, whose body model's files are written into `folder`, driving.json beside it."""
        head = head_for(identity)
        body = write_body(head, folder)
        way = driving(body, head.expression_names)
        write_text(folder.parent / "driving.json", json.dumps(way, indent=1) + "\n", force=True)
        names = tuple(body.expression_names[:GAUSSIAN_SHAPES])
        return Person(head, body, names, np.array(way["matrix"]), tuple(way["outputs"]))

    def pose(self, weights: F64) -> tuple[list[float], dict[str, F64]]:
        """(expression weights, rotation vectors of joints) of one frame's weights [K]."""
        values = dict(zip(self.outputs, (self.drive @ weights).tolist(), strict=True))
        joints = {
            joint: np.array([values.get(f"joint/{joint}/{axis}", 0.0) for axis in "xyz"]) for joint in JOINTS
        }
        return [values[f"expression/{name}"] for name in self.names], joints


def shots(
    person: Person, chest: Chest, fit: Fit, pictures: Iterator[tuple[int, Picture, Picture]], face: float
) -> Iterator[tuple[str, Shot]]:
    """A shot for each picture: its row in `fit`, image, mask of the whole person; `face`: its height in pixels."""
    k = np.array([[fit.focal, 0, fit.principal[0]], [0, fit.focal, fit.principal[1]], [0, 0, 1]])
    for count, (row, image, mask) in enumerate(pictures):
        one = fit.of(slice(row, row + 1))
        rotation, translation, turned = chest.root_pose(one)
        expression, joints = person.pose(one.weights[0])
        joints |= {joint: rotvec(turn) for joint, turn in turned.items()}
        kept = mask * chest.kept(one, (mask.shape[1], mask.shape[0]), face)
        split = "test" if count % HELD_OUT == HELD_OUT - 1 else "train"
        yield (
            f"{row:05d}",
            Shot(
                image,
                np.rint(kept).astype(np.uint8),
                k,
                rotation,
                translation,
                expression,
                joints,
                split=split,
            ),
        )
