"""What a pose costs before the GPU gets anything: `driving`, names resolved to arrays, and stage `joints`.

Two avatars: the sample head (5 joints, 51 expressions, an anchored group) and a made-up skeleton of 262 joints, each of
which the matrix turns. Both are driven by different weights and rotations in every frame.
"""

from __future__ import annotations

import statistics
import time
from pathlib import Path

import numpy as np
from tests.avatars import avatar_of, rig_of

from avatar_runtime.avatar import Avatar, Driving
from avatar_runtime.bundle import load
from avatar_runtime.driving.arkit import ARKIT_NAMES, CHANNELS
from avatar_runtime.driving.driver import Driver
from avatar_runtime.driving.frame import frame_of
from avatar_runtime.pose import resolve
from avatar_runtime.posed import Poser
from avatar_runtime.rotation import homogeneous, matrix_from_rotvec

HEAD = Path(__file__).parents[1] / "samples" / "trained" / "head_blendshapes"
JOINTS = 262
FRAMES = 100
WARM = 5  # first frames that do not count

Row = tuple[str, float, str]


def posing_rows() -> list[Row]:
    """Median milliseconds of a pose."""
    head = load(HEAD)
    assert head.rig is not None
    assert (head.rig.joint_count, len(head.expressions)) == (5, 51)
    return [*_rows("pose_5_joints_51_expressions", head), *_rows(f"pose_{JOINTS}_joints", skeleton())]


def skeleton() -> Avatar:
    """JOINTS joints, each below one of the ten before it, all turned by the matrix; 51 expressions."""
    rng = np.random.default_rng(0)
    names = tuple(f"joint_{row}" for row in range(JOINTS))
    parents = [-1, *(int(rng.integers(max(0, row - 10), row)) for row in range(1, JOINTS))]
    rest = homogeneous(matrix_from_rotvec(rng.normal(0, 0.3, (JOINTS, 3))), rng.normal(0, 0.02, (JOINTS, 3)))
    expressions = ARKIT_NAMES[:51]
    outputs = [f"expression/{name}" for name in expressions] + [f"joint/{name}/x" for name in names]
    matrix = rng.normal(0, 0.02, (len(outputs), len(ARKIT_NAMES))).astype(np.float32)
    driving = Driving("matrix", ARKIT_NAMES, tuple(outputs), matrix, head_joint=names[0])
    return avatar_of(expressions, rig_of(names, parents, rest), driving)


def _rows(name: str, avatar: Avatar) -> list[Row]:
    rng = np.random.default_rng(1)
    driver, poser = Driver(avatar), Poser(avatar)
    times: list[tuple[float, float, float]] = []
    for _ in range(WARM + FRAMES):
        frame = frame_of(0.0, rng.uniform(0.0, 1.0, len(CHANNELS)))
        start = time.perf_counter()
        pose = driver.pose(frame)
        driven = time.perf_counter()
        arrays = resolve(pose, avatar)
        resolved = time.perf_counter()
        poser.posed(arrays)
        times.append((driven - start, resolved - driven, time.perf_counter() - resolved))
    parts = np.array(times[WARM:]) * 1e3
    whole = statistics.median(parts.sum(axis=1).tolist())
    each = zip(("driving", "resolve", "joints"), np.median(parts, axis=0).tolist(), strict=True)
    return [(name, whole, "ms"), *((f"{name}_{part}", value, "ms") for part, value in each)]
