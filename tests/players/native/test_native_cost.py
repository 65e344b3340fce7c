"""What the native player takes for the worst small files: memory above idle and time, an opened instance included."""

from __future__ import annotations

import pytest
from tools.fuzz.costs import cost

from tests.players.core_cases import GOLDEN
from tests.players.hostile.worst import WORST, worst
from tests.players.native import need_compilers

SIZE = 16 << 10  # bytes of a file
MOST_MB, MOST_S = 100, 2.0


@pytest.mark.parametrize("kind", WORST)
def test_the_worst_small_files_take_little(kind: str) -> None:
    need_compilers()
    small = (GOLDEN / "joints.avatar").read_bytes()
    seconds, memory = cost("native", worst(kind, small, SIZE), small)
    print(f"{kind}: {memory:.1f} MB, {seconds:.3f} s")
    assert memory < MOST_MB and seconds < MOST_S
