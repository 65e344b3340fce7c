"""What loading and posing cost in the native player's core."""

from __future__ import annotations

import re
import subprocess
from pathlib import Path

from tests.players.unity_pose_cases import WIDE_JOINTS, wide_pack
from tests.session.native import NATIVE, build

HEAD_JOINTS = 5
FLAGS = ("-O2",)
RUNS, POSES = 9, 500
_LINE = re.compile(r"load ([0-9.]+) ms, driving and pose ([0-9.]+) ms")


def native_rows(folder: Path) -> list[tuple[str, float, str]]:
    """Milliseconds of a pose, driven by ARKit: 51 expressions and anchors."""
    rows = []
    for joints in (HEAD_JOINTS, WIDE_JOINTS):
        pack = folder / f"joints_{joints}.avatar"
        pack.write_bytes(wide_pack(joints))
        load, pose = measured(pack)
        rows.append((f"native_load_{joints}_joints", load, "ms"))
        rows.append((f"native_pose_{joints}_joints", pose, "ms"))
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
