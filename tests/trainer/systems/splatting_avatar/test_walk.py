"""Walking on triangles against the released walker's numbers and against a straight line drawn in an unfolded strip."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from avatar_trainer.systems.splatting_avatar.walk import (
    PAPER_DECAY,
    RELEASED_DECAY,
    Neighbours,
    neighbours,
    walk,
)
from tests.measured import Measure
from tests.shared_data import shared
from tests.trainer.systems.splatting_avatar.scene import sheet

Array = npt.NDArray[Any]
GOLDEN = "golden/splatting_avatar/splatting_avatar/triangle_walk"
TOPOLOGY = "golden/splatting_avatar/head_poses/topology.npz"
# A cube's sides, two triangles each, wound outwards: closed, no border.
CUBE = np.array(
    [
        *([0, 2, 1], [0, 3, 2], [4, 5, 6], [4, 6, 7], [0, 1, 5], [0, 5, 4]),
        *([1, 2, 6], [1, 6, 5], [2, 3, 7], [2, 7, 6], [3, 0, 4], [3, 4, 7]),
    ]
)


def side(a: Array, b: Array, point: Array) -> float:
    """On which side of the line from a to b, and how far, a point of the plane is."""
    return float((b - a)[0] * (point - a)[1] - (b - a)[1] * (point - a)[0])


def straight(triangles: Array, start: int, weights: Array, delta: Array, decay: float) -> Any:
    """(triangle, weights, crossings) of one walk, drawn in the plane of (u, v) of the first triangle.

    Each triangle that is entered is laid beside the last one: its new corner lies so that both make a parallelogram.
    """
    plane = dict(zip(triangles[start].tolist(), np.array([[1.0, 0], [0, 1], [0, 0]]), strict=True))
    here, inside = start, weights[:2] @ np.array([[1.0, 0], [0, 1]])
    goal, last, crossings = inside + delta, None, 0
    while True:
        corners = triangles[here].tolist()
        exits = []
        for a, b, c in (corners, corners[1:] + corners[:1], corners[2:] + corners[:2]):
            if {a, b} != last:
                here_side, goal_side, other_side = (
                    side(plane[a], plane[b], p) for p in (inside, goal, plane[c])
                )
                if goal_side * other_side < 0:
                    exits.append((here_side / (here_side - goal_side), a, b, c))
        if not exits:
            break
        share, a, b, c = min(exits)
        inside = inside + share * (goal - inside)
        over = [t for t in range(len(triangles)) if t != here and {a, b} <= set(triangles[t].tolist())]
        if not over:
            goal = inside
            break
        (fourth,) = set(triangles[over[0]].tolist()) - {a, b}
        plane = {a: plane[a], b: plane[b], fourth: plane[a] + plane[b] - plane[c]}
        goal, here, last = inside + decay * (goal - inside), over[0], {a, b}
        crossings += 1
    system = np.stack([np.append(plane[corner], 1) for corner in triangles[here].tolist()], axis=1)
    return here, np.linalg.solve(system, np.append(goal, 1)), crossings


def starts(
    rng: np.random.Generator, triangles: Array, count: int, reach: float
) -> tuple[Array, Array, Array]:
    """Random (triangle, weights, change)."""
    return (
        rng.integers(0, len(triangles), count),
        rng.dirichlet([1, 1, 1], count),
        rng.normal(size=(count, 2)) * reach,
    )


@pytest.mark.parametrize("triangles", [CUBE, sheet(5), sheet(2)], ids=["cube", "sheet", "two triangles"])
@pytest.mark.parametrize("decay", [PAPER_DECAY, RELEASED_DECAY])
def test_a_walk_is_a_straight_line(triangles: Array, decay: float, measured: Measure) -> None:
    triangle, weights, delta = starts(np.random.default_rng(0), triangles, 300, 2.0)
    walked = walk(neighbours(triangles), triangle, weights, delta, decay)
    expected = [straight(triangles, *row, decay) for row in zip(triangle, weights, delta, strict=True)]
    np.testing.assert_array_equal(walked.triangle, [row[0] for row in expected])
    np.testing.assert_array_equal(walked.crossings, [row[2] for row in expected])
    apart = np.abs(walked.barycentric - [row[1] for row in expected]).max()
    measured("walk against an unfolded straight line, weights", float(apart))
    assert apart < 1e-10
    assert walked.crossings.max() > 3 or len(triangles) == 2


@pytest.mark.parametrize("name", ["head", "small_open"])
def test_the_released_walker_goes_the_same_way(name: str, measured: Measure) -> None:
    with np.load(shared(f"{GOLDEN}/{name}.npz"), allow_pickle=False) as file:
        golden = {key: file[key] for key in file.files}
    triangles = golden.get("faces")
    if triangles is None:
        with np.load(shared(TOPOLOGY), allow_pickle=False) as file:
            triangles = file["faces"]
    weights = np.c_[golden["start_uv"], 1 - golden["start_uv"].sum(axis=1)]
    walked = walk(neighbours(triangles), golden["start_face"], weights, golden["delta_uv"], RELEASED_DECAY)
    agrees = golden["plain_agrees"]
    assert agrees.sum() >= 90
    np.testing.assert_array_equal(walked.triangle[agrees], golden["end_face"][agrees])
    np.testing.assert_array_equal(walked.crossings[agrees], golden["plain_crossings"][agrees])
    apart = np.abs(walked.barycentric[:, :2] - golden["end_uv"])[agrees].max()
    measured("walk against the released walker, weights", float(apart))
    assert apart < 1e-5  # it computes in float32


def test_wrong_calls_are_refused() -> None:
    mesh = Neighbours(np.full((1, 3), -1, np.int32), np.full((1, 3), -1, np.int32))
    inside = np.full((2, 3), 1 / 3)
    with pytest.raises(ValueError, match="2 points"):
        walk(mesh, np.zeros(2, np.int64), inside[:1], np.zeros((2, 2)))
    with pytest.raises(ValueError, match=r"0\.\.0"):
        walk(mesh, np.array([0, 1]), inside, np.zeros((2, 2)))
