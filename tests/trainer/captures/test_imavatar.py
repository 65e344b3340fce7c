"""IMavatar's flame_params.json: poses, cameras and images, and what is said of bad ones."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from avatar_runtime.io.errors import AvatarError
from avatar_trainer.captures.load import load, pixels
from tests.exporter.bodies import body_files
from tests.measured import Measure
from tests.oracles.lbs import posed_vertices
from tests.trainer.captures import folders
from tests.trainer.captures.folders import HEIGHT, WIDTH

METRES = 1e-6


def test_posed_mesh_is_flames(tmp_path: Path, measured: Measure) -> None:
    folder, model, p = folders.imavatar(tmp_path / "take")
    capture = load(folder)
    assert capture.head_pose_in == "mesh" and capture.eyelids == ()
    assert len(capture.frames) == body_files.FRAMES
    for t, frame in enumerate(capture.frames):
        want = posed_vertices(model, p["shape"], p["expression"][t], p["rotation"][t], np.zeros(3))
        off = np.abs(folders.posed(capture.rig, frame.pose) - want).max()
        measured("capture: IMavatar mesh against plain LBS m", off, METRES)
        assert off < METRES


def test_points_fall_where_the_files_own_camera_puts_them(tmp_path: Path) -> None:
    folder, _, p = folders.imavatar(tmp_path / "take")
    point = np.array([0.05, -0.07, 0.1])
    for t, frame in enumerate(load(folder).frames):
        x, y, z = p["world_mat"][t] @ np.append(4 * point, 1)
        across, down = 2.5 * x / -z + 0.52, 3.0 * -y / -z + 0.48
        clip = frame.camera.clip_from_world @ np.append(point, 1)
        assert clip[3] > 0, "in front of the camera"
        assert np.abs((clip[:2] / clip[3] + 1) / 2 - (across, down)).max() < 1e-6
        assert frame.camera.tan_half_fov_x == pytest.approx(1 / (2 * 2.5))
        assert frame.camera.camera_from_world[2, 3] == pytest.approx(1.0), "metres"


def test_splatting_avatars_own_packing(tmp_path: Path) -> None:
    folder, _, _ = folders.imavatar(tmp_path / "take")
    (folder / "image").rename(folder / "images")
    (folder / "mask").rename(folder / "unused")
    with pytest.raises(
        AvatarError, match=r"images/0\.png: has no alpha, and there is no folder mask or masks"
    ):
        load(folder)
    for t in range(body_files.FRAMES):
        Image.fromarray(np.dstack([folders.image(t), folders.mask(t)])).save(folder / "images" / f"{t}.png")
    capture = load(folder)
    assert capture.layout.endswith("images in images/, their alpha is the matte")
    assert np.array_equal(np.rint(pixels(capture.frames[1])[1] * 255), folders.mask(1))


def entry(t: int, key: str, value: Any) -> Callable[[dict[str, Any]], object]:
    return lambda document: document["frames"][t].update({key: value})


BAD = [
    (lambda d: d.pop("intrinsics"), r"flame_params\.json: intrinsics: does not hold usable numbers \[4\]"),
    (lambda d: d.update(intrinsics=[0, 1, 1, 1]), "camera.K: is singular or mirrored"),
    (entry(2, "world_mat", None), r"flame_params\.json: frames\[2\].world_mat: does not hold usable numbers \[3, 4\]"),
    (entry(2, "world_mat", np.ones((3, 4)).tolist()), r"frames\[2\].camera.R: is not a rotation"),
    (entry(2, "pose", [0.0] * 14), r"frames\[2\].pose: is not a list of 15 numbers"),
    (entry(2, "expression", [0.0, float("nan"), 0.0]), r"frames\[2\].expression"),
    (lambda d: [f.update(expression=[1.0] * 7) for f in d["frames"]], "has 7 expressions, but the rig has 3"),
    (entry(2, "file_path", "../../secret"), r"frames\[2\].file_path: '../../secret' leaves the capture's folder"),
    (entry(2, "file_path", "./image/1"), r"frames\[2\].image: is called '1' as frames\[1\] is"),
]  # fmt: skip


@pytest.mark.parametrize(("change", "message"), BAD)
def test_bad_input_is_named(tmp_path: Path, change: Callable[[dict[str, Any]], object], message: str) -> None:
    folder, _, _ = folders.imavatar(tmp_path / "take")
    file = folder / "flame_params.json"
    document = json.loads(file.read_text())
    change(document)
    file.write_text(json.dumps(document))
    with pytest.raises(AvatarError, match=message):
        load(folder)


def test_a_mask_that_is_missing_or_of_another_size(tmp_path: Path) -> None:
    folder, _, _ = folders.imavatar(tmp_path / "take")
    mask = folder / "mask" / "3.png"
    Image.new("L", (WIDTH + 1, HEIGHT)).save(mask)
    with pytest.raises(AvatarError, match=rf"mask/3\.png: is {WIDTH + 1}x{HEIGHT} pixels"):
        load(folder)
    mask.unlink()
    with pytest.raises(AvatarError, match=r"mask/3\.png: no such image"):
        load(folder)
