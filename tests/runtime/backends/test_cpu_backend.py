"""What surrounds the kernels of backend `cpu`: threads, and arrays that do not fit."""

from __future__ import annotations

from dataclasses import replace

import numba
import numpy as np
import pytest

from avatar_runtime.backends import make_backend
from avatar_runtime.camera import Camera
from avatar_runtime.player import Player
from avatar_runtime.pose import Pose
from tests.avatars import full_avatar, surface_avatar

CAMERA = Camera.orbit(np.zeros(3), 0.6, 0.3, 0.1, 0.5, 48, 40)


@pytest.mark.parametrize("threads", [0, -1])
def test_less_than_one_thread_is_refused(threads: int) -> None:
    with pytest.raises(ValueError, match=f"threads is {threads}; at least 1"):
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
