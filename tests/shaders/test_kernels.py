"""The WebAssembly kernels play whole packs as the reference backend does, and promise nothing that they lack."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from avatar_export.images import frame_camera, robust_box
from avatar_runtime.avatar import Avatar
from avatar_runtime.bundle import load
from avatar_runtime.clips import frame_pose
from avatar_runtime.player import Player
from avatar_runtime.pose import Pose
from avatar_runtime.stages.project import project
from avatar_shaders import ENTRIES
from avatar_shaders.__main__ import ROOT
from avatar_shaders.kernels import kernel_entries
from tests.shaders import wasm_host

PACKS = sorted((ROOT / "tests" / "data" / "packs" / "1.0").glob("*.avatar"))
ROUNDINGS = 64  # of float32 at an array's largest value, as for golden packs
SHARED = ("sort_count", "sort_scan", "sort_scatter")


def near(found: np.ndarray, want: np.ndarray, name: str) -> None:
    limit = ROUNDINGS * np.finfo(np.float32).eps * max(np.abs(want).max(), 1e-6)
    assert found.shape == want.shape, name
    assert np.abs(found - want).max() <= limit, name


def compare(avatar: Avatar) -> None:
    player = Player(avatar, "reference")
    pose = frame_pose(avatar, avatar.clips[0], 2) if avatar.clips else Pose()
    camera = frame_camera(robust_box(avatar.gaussians.mean), 96, 64, yaw=0.3)
    answer = wasm_host.play(avatar, player.posed(pose), camera)
    splats = player.animate(pose)
    n = avatar.gaussians.count
    kinds = {re.split(r"[./]", name)[-2]: found for name, found in answer["buffers"].items()}
    planes = kinds["Splats"].reshape(5, n, 4)
    found = {
        "mean": planes[0, :, :3],
        "opacity": planes[0, :, 3],
        "quat_wxyz": planes[1],
        "scale": planes[2:5, :, 3].T,
        "sh_rotation": planes[2:5, :, :3].transpose(1, 0, 2),
        "sh": kinds["Sh"].reshape(-1, 3, n).transpose(2, 0, 1),
    }
    for name, array in found.items():
        near(array, getattr(splats, name), name)
    seen = project(splats, camera, avatar.raster, avatar.sh_degree)
    planes = kinds["Projected"].reshape(3, n, 4)
    assert (seen.radius > 0).any()
    near(planes[0, :, :2], seen.centre, "centre")
    near(planes[0, :, 2], seen.depth, "depth")
    near(planes[0, :, 3], seen.opacity, "opacity")
    near(planes[2, :, :3], seen.rgb, "rgb")
    np.testing.assert_array_equal(planes[1, :, 3], seen.radius)


@pytest.mark.parametrize("path", PACKS, ids=lambda path: path.stem)
def test_a_pack_plays_as_on_the_reference_backend(path: Path) -> None:
    compare(load(path))


def test_the_module_exports_what_it_promises_and_imports_nothing() -> None:
    answer = wasm_host.run({"buffers": {}, "passes": [], "read": []})
    names = kernel_entries(wasm_host.TABLE)
    assert answer["imports"] == []
    assert set(answer["exports"]) == {"memory", "__heap_base", *names}
    assert set(names) == {name for name, row in ENTRIES.items() if row.kind == "compute"} - set(SHARED)
