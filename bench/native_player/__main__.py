"""Prints milliseconds of packs in the native player's core: `python -m bench.native_player PACK ...`.

Without a pack, of a head of 5 and of one of 262 joints.
"""

from __future__ import annotations

import sys
from pathlib import Path

from bench.native_player import measured, native_rows

for word in sys.argv[1:]:
    load, pose = measured(Path(word))
    print(f"{Path(word).name}: load {load:.2f} ms, driving and pose {pose:.4f} ms")
if len(sys.argv) == 1:
    for name, value, unit in native_rows():
        print(f"{name}: {value} {unit}")
