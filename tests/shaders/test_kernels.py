"""The WebAssembly kernels play whole packs as the reference backend does, and promise nothing that they lack."""

from __future__ import annotations

import base64
import re
from pathlib import Path

import numpy as np
import pytest

from avatar_export.images import frame_camera, robust_box
from avatar_export.packing.steps import Fineness
from avatar_export.packing.write import pack
from avatar_runtime.avatar import Avatar
from avatar_runtime.bundle import load
from avatar_runtime.clips import frame_pose
from avatar_runtime.player import Player
from avatar_runtime.pose import Pose
from avatar_runtime.program.bake import program_of
from avatar_runtime.program.chunks import BUFFER_LIMIT
from avatar_runtime.stages.project import project
from avatar_shaders import ENTRIES
from avatar_shaders.__main__ import ROOT, WEB
from avatar_shaders.kernels import USUAL, kernel_entries
from tests.avatars import full_avatar
from tests.shaders import wasm_host

PACKS = sorted((ROOT / "tests" / "data" / "packs" / "1.0").glob("*.avatar"))
ROUNDINGS = 64  # of float32 at an array's largest value, as for golden packs
SHARED = ("sort_count", "sort_scan", "sort_scatter")
MODULE = re.search(r'KERNELS = "(.+)"', (ROOT / WEB / "kernels.ts").read_text("utf-8"))


def near(found: np.ndarray, want: np.ndarray, name: str) -> None:
    limit = ROUNDINGS * np.finfo(np.float32).eps * max(np.abs(want).max(), 1e-6)
    assert found.shape == want.shape, name
    assert np.abs(found - want).max() <= limit, name


def compare(avatar: Avatar) -> None:
    """Every array up to stage project."""
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


def test_the_loop_of_usual_constants_plays_the_same(tmp_path: Path) -> None:
    path = tmp_path / "usual.avatar"
    path.write_bytes(pack([full_avatar(3)], Fineness(0.5)).file)
    avatar = load(path)
    program, level = program_of(avatar, BUFFER_LIMIT)
    for entry, values in USUAL.items():
        constants = [one.constants for one in program.levels[level].deform if one.entry == entry]
        assert constants and all(values.items() <= told.items() for told in constants)
    compare(avatar)


def test_the_module_exports_what_it_promises_and_imports_nothing() -> None:
    answer = wasm_host.run({"buffers": {}, "passes": [], "read": [], "repeat": 0})
    names = kernel_entries(wasm_host.TABLE)
    assert answer["imports"] == []
    assert set(answer["exports"]) == {"memory", "__heap_base", *names}
    assert set(names) == {name for name, row in ENTRIES.items() if row.kind == "compute"} - set(SHARED)


def test_the_module_is_small_and_tells_nothing_of_the_machine_that_made_it() -> None:
    assert MODULE
    module = base64.b64decode(MODULE[1])
    assert len(module) < 60_000
    assert b"/tmp" not in module and b".cpp" not in module and b"producers" not in module


def test_keys_and_quads_are_what_sorting_and_drawing_take() -> None:
    """sort_keys numbers the splats of all chunks; raster_gather lays splats of one chunk in drawing order."""
    rng = np.random.default_rng(3)
    count, first, total = 5, 2, 8
    projected = rng.random((3, count, 4)).astype(np.float32)
    projected[1, 1, 3] = 0  # a radius of 0: not drawn
    order = np.array([[0, i] for i in (6, 0, 3, 7, 2, 5, 1, 4)], np.uint32)

    def step(entry: str, rows: int, names: list[str], constants: list[int]) -> dict[str, object]:
        block = base64.b64encode(np.array(constants, np.uint32).tobytes()).decode()
        return {"entry": entry, "rows": rows, "buffers": names, "constants": block}

    answer = wasm_host.run(
        {
            "buffers": {
                "Projected": {"bytes": projected.nbytes, "words": wasm_host.base64_of(projected)},
                "Keys": {"bytes": 8 * total},
                "Order": {"bytes": order.nbytes, "words": wasm_host.base64_of(order)},
                "Quads": {"bytes": 48 * 4},
            },
            "passes": [
                step("sort_keys", count, ["Projected", "Keys"], [count, first, 0, 0]),
                step("raster_gather", 4, ["Projected", "Order", "Quads"], [total, 1, 4, first, count, 1]),
            ],
            "read": ["Keys", "Quads"],
            "repeat": 1,
        }
    )
    keys = np.frombuffer(base64.b64decode(answer["buffers"]["Keys"]), np.uint32).reshape(total, 2)
    depth = projected[0, :, 2].view(np.uint32).copy()
    depth[1] = 0xFFFFFFFF
    np.testing.assert_array_equal(keys[first : first + count], np.stack([depth, first + np.arange(count)], 1))
    assert not keys[:first].any() and not keys[first + count :].any()
    quads = np.frombuffer(base64.b64decode(answer["buffers"]["Quads"]), np.float32).reshape(4, 3, 4)
    for instance, identifier in enumerate(order[::-1, 1][1:5]):  # back to front, from the second
        row = int(identifier) - first
        if 0 <= row < count:
            p = projected[:, row]
            want = [[p[0, 0], p[0, 1], p[2, 3], p[0, 3]], [*p[1, :3], 0], [*p[2, :3], 0]]
            np.testing.assert_array_equal(quads[instance], np.array(want, np.float32))
        else:
            assert not quads[instance].any()
