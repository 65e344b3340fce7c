"""A real LAM head, distilled from its own dumps and compared with what LAM's reader plays."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from samples.dumps import random_poses, write_dumps

from avatar_export.distill.make import distill
from avatar_export.readers.table import read
from avatar_runtime.player import Player
from avatar_runtime.subset import subset
from tests.shared_data import shared


@pytest.mark.more
def test_a_real_head_is_repeated(tmp_path: Path) -> None:
    head = read(shared("lam/p2-1.zip"))
    part = subset(head, np.arange(0, head.gaussians.count, 40), head.rig.anchor_vertices).avatar
    takes = [random_poses(part, 112, 8.0), random_poses(part, 8, 8.0, seed=8)]
    result = distill(write_dumps(part, takes, tmp_path / "dumps"))
    assert result.avatar.rules.rotation == "none", "LAM trains so: joints do not turn its Gaussians"
    assert result.errors.rms < 0.1 and result.errors.decibels > 50
    source, found = Player(part, "reference"), Player(result.avatar, "reference")
    off = [source.animate(pose).mean - found.animate(pose).mean for pose in takes[1]]
    assert 1e3 * np.sqrt(np.square(off).sum(axis=2).mean()) < 0.1
