"""What surrounds the kernels of backend `cpu`: threads, arrays that do not fit, kernels kept on disk."""

from __future__ import annotations

import importlib.util
import pickle
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numba
import numpy as np
import pytest

from avatar_runtime.backends import make_backend
from avatar_runtime.backends.cpu.deform.skinned import animate_skinned
from avatar_runtime.backends.cpu.jit import SOURCES, kernel
from avatar_runtime.camera import Camera
from avatar_runtime.player import Player
from avatar_runtime.pose import Pose
from tests.avatars import full_avatar, surface_avatar

CAMERA = Camera.orbit(np.zeros(3), 0.6, 0.3, 0.1, 0.5, 48, 40)


@pytest.mark.parametrize("threads", [0, -1])
def test_less_than_one_thread_is_refused(threads: int) -> None:
    with pytest.raises(ValueError, match=f"threads is {threads}; at least 1"):
        Player(full_avatar(), "cpu", threads=threads)


@pytest.mark.parametrize("threads", [1.0, True, "2", np.bool_(True), np.ones(2, int)])
def test_a_number_of_threads_is_whole(threads: Any) -> None:
    with pytest.raises(TypeError, match="whole number"):
        Player(full_avatar(), "cpu", threads=threads)


def test_the_callers_number_of_threads_stays() -> None:
    numba.set_num_threads(1)
    try:
        Player(full_avatar(), "cpu", threads=2).frame(Pose(), CAMERA)
        assert numba.get_num_threads() == 1
    finally:
        numba.set_num_threads(numba.config.NUMBA_NUM_THREADS)


def test_indices_that_point_nowhere_are_refused() -> None:
    """A kernel would read what lies behind the array."""
    avatar = full_avatar()
    b = avatar.blendshapes
    ends = b.geometry.row_ptr.copy()
    ends[5] = 60000
    joint = avatar.skin.column.copy()
    joint[3] = 5
    wrong = (
        replace(avatar, blendshapes=replace(b, geometry=replace(b.geometry, row_ptr=ends))),
        replace(avatar, skin=replace(avatar.skin, column=joint)),
        replace(avatar, groups=(*avatar.groups[:-1], replace(avatar.groups[-1], count=9))),
    )
    for case in wrong:
        with pytest.raises(ValueError):
            make_backend("cpu", case)
    surface = surface_avatar()
    assert surface.embedding is not None
    triangle = surface.embedding.triangle.copy()
    triangle[0] = 20
    with pytest.raises((ValueError, IndexError)):
        make_backend("cpu", replace(surface, embedding=replace(surface.embedding, triangle=triangle)))


def test_a_stage_refuses_arrays_of_another_shape() -> None:
    backend = make_backend("cpu", full_avatar())
    for weights in (np.zeros(3, np.float32), np.zeros((4, 1), np.float32)):
        with pytest.raises(ValueError, match="shape"):
            backend.stage("blend", {"expression_weights": weights}, None, "trainer")


def test_an_unreadable_index_of_kernels_is_dropped(tmp_path: Path) -> None:
    """Pickles of another version may name classes that are gone."""
    source = tmp_path / "old.py"
    source.write_text("def twice(x):\n    return 2 * x\n")
    spec = importlib.util.spec_from_file_location("old", source)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    assert kernel()(module.twice)(2) == 4
    (index,) = (tmp_path / "__pycache__").glob("*.nbi")
    version = pickle.dumps(numba.__version__)
    index.write_bytes(version + b"cavatar_runtime.backends.cpu.arrays\nGone\n.")
    again = kernel()(module.twice)
    assert again(3) == 6
    assert sum(again.stats.cache_misses.values()) == 1


def test_kernels_come_from_disk_in_the_next_process() -> None:
    """And are compiled anew when any file of the package has changed, not only the kernel's own."""
    Player(full_avatar(), "cpu").animate(Pose())
    assert animate_skinned._cache._cache_file._source_stamp == SOURCES
    program = (
        "from tests.avatars import full_avatar\n"
        "from avatar_runtime.player import Player\n"
        "from avatar_runtime.pose import Pose\n"
        "from avatar_runtime.backends.cpu.deform.skinned import animate_skinned\n"
        "Player(full_avatar(), 'cpu').animate(Pose())\n"
        "print(sum(animate_skinned.stats.cache_hits.values()), len(animate_skinned.stats.cache_misses))\n"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, check=True, text=True)
    assert done.stdout.split() == ["1", "0"], done.stderr
