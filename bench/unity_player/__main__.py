"""What a pose costs in the core of the Unity player, under mono: `python -m bench.unity_player` prints it.

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


def main() -> None:
    """A line for each part: its name, milliseconds."""
    with tempfile.TemporaryDirectory() as scratch:
        program = Path(scratch) / "PoseSpeed.exe"
        compile_csharp([*core_sources(), Path(__file__).parent / "PoseSpeed.cs"], program)
        for joints in (HEAD_JOINTS, WIDE_JOINTS):
            pack = Path(scratch) / "wide.avatar"
            pack.write_bytes(wide_pack(joints))
            command = ["mono", str(program), str(pack)]
            printed = subprocess.run(command, check=True, capture_output=True, text=True).stdout
            for line in printed.splitlines():
                name, milliseconds = line.split()
                print(f"{name}_{joints}_joints {milliseconds}")


if __name__ == "__main__":
    main()
