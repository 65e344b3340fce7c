"""Places off the mesh are kept where the images show the person, and not before the background or behind the mesh."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from avatar_trainer.captures.load import load
from avatar_trainer.captures.model import Capture
from avatar_trainer.systems.psavatar.hull import seen
from avatar_trainer.systems.psavatar.settings import UNITS
from tests.trainer.systems.psavatar import scene
from tests.trainer.systems.splatting_avatar import scene as sheet

SIZE = sheet.SIZE
HALF = SIZE // 2
RAISED = 1e-3  # metres off the mesh: less than a pixel


def half_covered(path: Path, uncovered: int) -> Capture:
    """A capture whose left half shows the person in all frames but the first `uncovered`, which show nobody."""
    image = np.full((SIZE, SIZE, 3), 128, np.uint8)
    person = np.zeros((SIZE, SIZE), np.uint8)
    person[:, :HALF] = 255
    masks = [0 * person] * uncovered + [person] * (sheet.FRAMES - uncovered)
    return load(sheet.folder(path, [(image, mask) for mask in masks]))


def columns(capture: Capture, triangle: np.ndarray, barycentric: np.ndarray) -> np.ndarray:
    """[frames, M] columns of points on the mesh, by the paper's formulas, in double precision."""
    found = []
    for frame in capture.train:
        posed = scene.mesh(
            frame.pose,
            np.zeros((len(capture.rig.vertices), 3, scene.TURNS)),
            np.zeros((len(capture.rig.vertices), 3, 1)),
        )
        point = np.einsum("mc,mcx->mx", barycentric, posed[capture.rig.triangles[triangle]])
        world = frame.pose.world_from_avatar.astype(np.float64)
        point = point @ world[:3, :3].T + world[:3, 3]
        clip = np.c_[point, np.ones(len(point))] @ frame.camera.clip_from_world.astype(np.float64).T
        found.append(((clip[:, 0] / clip[:, 3] + 1) * SIZE - 1) / 2)
    return np.array(found)


def test_what_stands_before_the_background_is_left_out(tmp_path: Path) -> None:
    capture = half_covered(tmp_path / "half", 0)
    rng = np.random.default_rng(0)
    triangle = rng.integers(0, len(capture.rig.triangles), 500)
    barycentric = rng.dirichlet((1, 1, 1), 500).astype(np.float32)
    at = columns(capture, triangle, barycentric)
    inside = (at < HALF - 1).all(axis=0)
    outside = (at > HALF + 2).all(axis=0)  # pixels beside one of the person are his
    assert inside.sum() > 20 and outside.sum() > 20
    kept = seen(capture, UNITS, triangle, barycentric, np.full(500, RAISED, np.float32))
    assert kept[inside].all() and not kept[outside].any()
    side = sheet.SIDE
    row, column = np.divmod(capture.rig.triangles[triangle], side)
    surrounded = ((row > 0) & (row < side - 1) & (column > 0) & (column < side - 1)).all(axis=1)
    behind = seen(capture, UNITS, triangle, barycentric, np.full(500, -10 * RAISED, np.float32))
    assert (inside & surrounded).any() and not behind[surrounded].any()
