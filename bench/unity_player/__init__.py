"""What a pose costs in the core of the Unity player, under mono.

CPU time of driving, of stage `joints` with the values of the frame, and of bones, for 51 expressions that all move
rest joints, and anchors.
"""

from __future__ import annotations

import subprocess
import tempfile
from pathlib import Path

from tests.players.unity import compile_csharp, core_sources
from tests.players.unity_pose_cases import WIDE_JOINTS, wide_pack

HEAD_JOINTS = 5


def unity_rows() -> list[tuple[str, float, str]]:
    """Milliseconds of each part."""
    rows = []
    with tempfile.TemporaryDirectory() as scratch:
        program, pack = Path(scratch) / "PoseSpeed.exe", Path(scratch) / "wide.avatar"
        compile_csharp([*core_sources(), Path(__file__).parent / "PoseSpeed.cs"], program)
        for joints in (HEAD_JOINTS, WIDE_JOINTS):
            pack.write_bytes(wide_pack(joints))
            command = ["mono", str(program), str(pack)]
            printed = subprocess.run(command, check=True, capture_output=True, text=True).stdout
            parts = (line.split() for line in printed.splitlines())
            rows += [(f"unity_{name}_{joints}_joints", float(value), "ms") for name, value in parts]
    return rows
