"""What loading and posing cost in the native player's core."""

from __future__ import annotations

import re
import subprocess
import tempfile
from pathlib import Path

from tests.players.unity_pose_cases import WIDE_JOINTS, wide_pack
from tests.session.native import NATIVE, build

HEAD_JOINTS = 5
FLAGS = ("-O2",)
RUNS, POSES = 9, 500
_LINE = re.compile(r"load ([0-9.]+) ms, driving and pose ([0-9.]+) ms")


def native_rows() -> list[tuple[str, float, str]]:
    """Milliseconds of a pose, driven by ARKit: 51 expressions and anchors."""
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        pack = Path(folder) / "wide.avatar"
        for joints in (HEAD_JOINTS, WIDE_JOINTS):
            pack.write_bytes(wide_pack(joints))
            parts = zip(("load", "pose"), measured(pack), strict=True)
            rows += [(f"native_{part}_{joints}_joints", value, "ms") for part, value in parts]
    return rows


def measured(pack: Path, poses: int = POSES) -> tuple[float, float]:
    """Milliseconds of loading a pack, inflating and checking included, and of driving and posing it."""
    program = build("bench", [NATIVE / "bench" / "bench.cpp"], FLAGS)
    done = subprocess.run(
        [str(program), str(pack), str(RUNS), str(poses)], check=True, capture_output=True, text=True
    )
    found = _LINE.search(done.stdout)
    assert found, done.stdout
    return float(found[1]), float(found[2])
