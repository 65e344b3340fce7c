"""Scans and their keypoints from files."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

from avatar_runtime import F64, AvatarError
from avatar_runtime.io import no_such, read_bytes
from avatar_trainer.asm.align import KEYPOINTS, Scan
from avatar_trainer.asm.mesh_files import FURTHEST, read_points

MAX_KEYPOINT_BYTES = 1 << 20
EYES = (0.04, 0.25)  # metres between the outer corners of the eyes, of infants and giants
NEAR = 0.5  # of the keypoints' spread: the largest distance from a keypoint to the scan


def read_scan(path: Path, keypoints: dict[str, F64]) -> Scan:
    """The scan of a file of `read_points`, in its frame and unit. Raises AvatarError as that does."""
    points, triangles = read_points(path)
    return Scan(path.stem, points, triangles, keypoints)


def expect_eyes(right: F64, left: F64, file: Path) -> None:
    """Raise AvatarError unless the distance of the outer eye corners [3], in metres, is that of a person."""
    apart = float(np.linalg.norm(right - left))
    if not EYES[0] <= apart <= EYES[1]:
        raise AvatarError(
            f"the outer corners of the eyes are {apart:.3g} m apart; {EYES[0]:g} to {EYES[1]:g} make sense: "
            "is --units right?",
            file=file,
        )


def expect_on_scan(scan: Scan, file: Path) -> None:
    """Raise AvatarError, which names `file`, for a keypoint that lies far from all points of its scan."""
    spread = np.linalg.norm(np.ptp(list(scan.keypoints.values()), axis=0))
    for name, place in scan.keypoints.items():
        if np.square(scan.points - place).sum(axis=1).min() > (NEAR * spread) ** 2:
            raise AvatarError(
                "lies far from the scan; are the keypoints in its unit?", file=file, field=f"keypoint {name}"
            )


def read_keypoints(path: Path) -> dict[str, F64]:
    """KEYPOINTS of a scan: JSON {name: [x, y, z]} in its frame and unit.

    Raises AvatarError for any other file, an unknown or missing name, and a position that is
    not three finite numbers.
    """
    try:
        given = json.loads(read_bytes(path, MAX_KEYPOINT_BYTES))
    except (ValueError, RecursionError):
        raise AvatarError('is not JSON; {"nose_bottom": [x, y, z], ...} is needed', file=path) from None
    if not isinstance(given, dict):
        raise AvatarError('is not an object; {"nose_bottom": [x, y, z], ...} is needed', file=path)
    for name in given:
        if name not in KEYPOINTS:
            raise no_such("keypoint", name, KEYPOINTS, file=path)
    missing = [name for name in KEYPOINTS if name not in given]
    if missing:
        raise AvatarError(
            f"is missing; the scan's seven keypoints are {', '.join(KEYPOINTS)}", file=path, field=missing[0]
        )
    return {name: _place(value, path, name) for name, value in given.items()}


def _place(value: object, path: Path, name: str) -> F64:
    numbers = value if isinstance(value, list) else []
    sound = all(type(number) in (int, float) and abs(number) <= FURTHEST for number in numbers)
    if len(numbers) != 3 or not sound:
        raise AvatarError("is not three finite numbers", file=path, field=name)
    return np.array(numbers, np.float64)
