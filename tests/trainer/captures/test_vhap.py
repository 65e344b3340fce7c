"""VHAP's layout: the same frames as in the own layout give the same pictures."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from avatar_runtime.io.errors import AvatarError
from avatar_trainer.captures.checks.verdict import judge
from avatar_trainer.captures.load import load, pixels
from avatar_trainer.captures.mesh_raster import intrinsics
from avatar_trainer.captures.model import Capture, Frame
from tests.measured import Measure
from tests.trainer.captures import folders, vhap_files

Array = npt.NDArray[Any]
PIXEL = 2e-3  # 64 pixels, 1 m away, focal length 150: float32 of camera and mesh are 2e-7 m, some 3e-5 pixels each
OFFSET = 0.004  # metres


@pytest.fixture(scope="module")
def take(head_take: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return vhap_files.write(head_take, tmp_path_factory.mktemp("vhap") / "take")


def places(capture: Capture, frame: Frame) -> Array:
    """[V, 2] pixels of the posed mesh."""
    posed = folders.posed(capture.rig, frame.pose).astype(float)
    matrix = frame.camera.camera_from_world.astype(float) @ frame.pose.world_from_avatar
    seen = (posed @ matrix[:3, :3].T + matrix[:3, 3]) @ intrinsics(frame.camera).T
    result: Array = seen[:, :2] / seen[:, 2:]
    return result


def test_same_frames_give_the_same_pictures(head_take: Path, take: Path, measured: Measure) -> None:
    ours, theirs = load(head_take), load(take)
    assert theirs.head_pose_in == "mesh" and "white" in theirs.layout
    assert [f.split for f in theirs.frames] == [f.split for f in ours.frames]
    worst, colour = 0.0, 0.0
    for a, b in zip(ours.frames, theirs.frames, strict=True):
        assert np.abs(a.pose.joint_delta[0] - b.pose.joint_delta[0]).max() > 0.1, "the pose is elsewhere"
        worst = max(worst, float(np.abs(places(ours, a) - places(theirs, b)).max()))
        (image, mask), (again, matte) = pixels(a), pixels(b)
        assert np.array_equal(mask, matte)
        share = mask[:, :, None]
        colour = max(colour, float((np.abs(image - again) * share).max()))
    measured("VHAP's layout against the own one, the same frames: places of the mesh, pixels", worst, PIXEL)
    assert worst < PIXEL
    assert colour < 1.01 * 0.5 / 255, "half a step of 8 bits, over what the mask leaves"


def test_nothing_is_found_wrong(take: Path) -> None:
    verdict = judge(load(take))
    assert (verdict.wrong, verdict.odd) == ((), ())


def test_the_static_offset_is_in_the_mesh(head_take: Path, tmp_path: Path) -> None:
    vertices = load(head_take).rig.vertices
    offset = np.random.default_rng(1).normal(0, OFFSET, vertices.shape).astype(np.float32)
    found = load(vhap_files.write(head_take, tmp_path / "take", offset))
    assert np.abs(found.rig.vertices - vertices - offset).max() < 1e-6
    assert found.export_inputs["shape"].name == "canonical_flame_param.npz"
    assert "static offset" in found.notes[1]


def entry(key: str, value: Any) -> Callable[[dict[str, Any]], object]:
    return lambda document: document["frames"][1].update({key: value})


BAD = [
    (entry("file_path", "../../etc/x.png"), r"frames\[1\].file_path: .* leaves"),
    (entry("flame_param_path", "flame_param/x.npz"), r"x\.npz"),
    (entry("flame_param_path", None), r"frames\[1\].flame_param_path: is not a path"),
    (entry("transform_matrix", np.zeros((4, 4)).tolist()), r"transform_matrix: is not a rigid motion"),
    (entry("fl_x", "wide"), r"frames\[1\].fl_x: does not hold usable numbers"),
    (entry("w", 12), r"w, h: are \(12, 64\), those of the first are"),
    (lambda d: d.update(frames={}), "frames: is not a list"),
]


@pytest.mark.parametrize(("change", "message"), BAD)
def test_bad_input_is_named(
    take: Path, tmp_path: Path, change: Callable[[dict[str, Any]], object], message: str
) -> None:
    bad = tmp_path / "take"
    bad.mkdir()
    for part in take.iterdir():
        (bad / part.name).symlink_to(part)
    file = bad / "transforms_train.json"
    document = json.loads(file.read_text())
    change(document)
    file.unlink()
    file.write_text(json.dumps(document))
    with pytest.raises(AvatarError, match=message) as caught:
        load(bad)
    assert "\n" not in str(caught.value)
