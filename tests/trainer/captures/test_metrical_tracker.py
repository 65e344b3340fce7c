"""metrical-tracker's frames: against the released code's numbers, and what is said of bad ones."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch
from PIL import Image

from avatar_runtime.io.errors import AvatarError
from avatar_trainer.captures.load import load, pixels
from avatar_trainer.captures.model import Capture
from tests import golden
from tests.golden import BlendshapesGolden
from tests.measured import Measure
from tests.trainer.captures import folders

TOLERANCE = 2e-6  # what the vectors' README calls safe
ALL_DIRECTIONS = 100  # what the tracker writes; the vectors' body has zero directions from 57 on


@pytest.fixture(scope="module")
def released(tmp_path_factory: pytest.TempPathFactory) -> BlendshapesGolden:
    """The golden vectors, their data set given images and their body FLAME's number of directions."""
    found = golden.unpack_gaussian_blendshapes(tmp_path_factory.mktemp("golden") / "x")
    body = found.body_model()
    names = [*body["expression_names"], *(f"zero_{i}" for i in range(57, ALL_DIRECTIONS))]
    pad = ((0, 0), (0, 0), (0, ALL_DIRECTIONS - 57))
    body |= {
        "expression_names": np.array(names),
        "shapedirs_expression": np.pad(body["shapedirs_expression"], pad),
    }
    np.savez(found.body / "body_model.npz", **body)
    images = found.folder / "dataset" / "images"
    images.mkdir()
    for index in golden.FRAMES:
        Image.new("RGBA", (512, 512), (90, 80, 70, 60)).save(images / f"{index:05d}.png")
    return found


@pytest.fixture(scope="module")
def capture(released: BlendshapesGolden) -> Capture:
    return load(released.folder / "dataset")


def test_what_was_found(capture: Capture, released: BlendshapesGolden) -> None:
    assert capture.layout.endswith("images in images/, their alpha is the matte (INSTA)")
    assert capture.head_pose_in == "camera" and capture.eyelids == ("left", "right")
    assert [frame.name for frame in capture.frames] == [f"{i:05d}" for i in golden.FRAMES]
    assert capture.export_inputs == {
        "body_model": released.body / "body_model.npz",
        "shape": released.frame_file(0),
        "eyelids": released.body,
        "anchor_faces": released.body / "back_of_head.txt",
    }
    image, mask = pixels(capture.frames[1])
    assert np.allclose(image, np.array([90, 80, 70]) / 255) and np.allclose(mask, 60 / 255)


@pytest.mark.parametrize("index", golden.FRAMES)
def test_posed_mesh_is_the_released_codes(
    capture: Capture, released: BlendshapesGolden, index: int, measured: Measure
) -> None:
    want, pose = released.frame(index), capture.frames[index].pose
    assert np.array_equal(pose.expression_weights, want["exp"])
    assert np.array_equal(pose.late_weights, want["eyelids"])
    turns = np.abs(pose.joint_delta[:, :3, :3] - want["joint_rotations"]).max()
    mesh = folders.posed(capture.rig, pose)[released.vertex_rows]
    off = np.abs(mesh - want["mesh_vertices"]).max()
    bare = folders.posed(capture.rig, replace(pose, late_weights=pose.late_weights * 0))[released.vertex_rows]
    measured("capture: tracked joints against released code 1", turns)
    measured("capture: tracked mesh against released code m", off)
    assert turns < TOLERANCE and off < TOLERANCE
    assert np.abs(bare - want["mesh_vertices_before_eyelids"]).max() < TOLERANCE


@pytest.mark.parametrize("index", golden.FRAMES)
def test_camera_is_the_released_codes(
    capture: Capture, released: BlendshapesGolden, index: int, measured: Measure
) -> None:
    want, camera = released.frame(index), capture.frames[index].camera
    off = max(
        np.abs(camera.camera_from_world.T - want["view_matrix_t"]).max(),
        np.abs(camera.clip_from_world.T - want["view_proj_matrix_t"]).max(),
        np.abs(camera.centre - want["camera_centre"]).max(),
        abs(2 * np.arctan(camera.tan_half_fov_x) - want["fov_x"]),
    )
    measured("capture: tracked camera against released code 1", off, TOLERANCE)
    assert off < TOLERANCE


def test_images_without_mattes_say_what_there_is(tmp_path: Path) -> None:
    data, _ = folders.tracked(tmp_path)
    Image.fromarray(folders.image(0)).save(data / "images" / "00000.png")
    with pytest.raises(AvatarError, match=r"00000\.png: has no alpha.*none else: INSTA's generate\.sh"):
        load(data)
    (data / "seg_mask").mkdir()
    with pytest.raises(AvatarError, match="seg_mask/ holds classes of a face parser"):
        load(data)


def test_body_files_are_named_where_they_are_missing(tmp_path: Path) -> None:
    data, _ = folders.tracked(tmp_path)
    body = tmp_path / "body"
    (body / "l_eyelid.npy").unlink()
    with pytest.raises(AvatarError, match=r"00000\.frame: flame.eyelids: moves the eyelids.*pass --eyelids"):
        load(data)
    body.rename(tmp_path / "elsewhere")
    with pytest.raises(
        AvatarError, match=r"take: has no body model in it or in a folder 'body' .*--body-model"
    ):
        load(data)
    folders.body_folder(tmp_path / "again")
    capture = load(
        data, tmp_path / "again" / "body_model.npz", tmp_path / "again", tmp_path / "again/back_of_head.txt"
    )
    assert len(capture.rig.anchor_vertices) == 12 and capture.eyelids == ("left", "right")


def rewrite(data: Path, t: int, change: Callable[[dict[str, Any]], object]) -> None:
    file = data / "checkpoint" / f"{t:05d}.frame"
    content = torch.load(file, weights_only=False)
    change(content)
    torch.save(content, file)


def put(part: str, name: str, value: Any) -> Callable[[dict[str, Any]], object]:
    return lambda frame: frame[part].update({name: value})


BAD = [
    (lambda f: f.pop("flame"), "flame: is missing"),
    (put("flame", "jaw", np.zeros((1, 3), "f4")), r"flame.jaw: is float32\[1, 3\], expected numbers \[6\]"),
    (put("flame", "jaw", np.zeros((1, 6), "f4")), "flame.jaw: is not a rotation: its two rows are parallel or zero"),
    (put("flame", "eyes", np.tile(np.eye(3, dtype="f4")[0], (1, 4))), r"flame.eyes\[0:6\]: is not a rotation"),
    (put("flame", "eyelids", np.zeros((1, 3), "f4")), r"flame.eyelids: is float32\[1, 3\], expected numbers \[2\]"),
    (put("flame", "exp", np.zeros((1, 9), "f4") + 1), "flame.exp: has 9 values, the body model 3"),
    (put("flame", "shape", np.ones((1, 4), "f4")), r"flame.shape: has another identity than 00000\.frame"),
    (lambda f: f["flame"]["exp"].__setitem__((0, 2), np.nan), r"flame.exp: \[2\] is nan"),
    (put("opencv", "K", np.zeros((1, 3, 3), "f4")), "camera.K: is singular or mirrored: focal length fx is 0"),
    (put("opencv", "R", 2 * np.eye(3, dtype="f4")[None]), "camera.R: is not a rotation: an entry of R R.T - I is 3"),
    (lambda f: f.update(img_size=np.array([1e9, 5])), "img_size: is"),
    (lambda f: f.update(img_size=np.array([10, 13])), r"img_size: is 13x10, 00000\.frame has 12x10"),
]  # fmt: skip


@pytest.mark.parametrize(("change", "message"), BAD)
def test_bad_frames_are_named(
    tmp_path: Path, change: Callable[[dict[str, Any]], object], message: str
) -> None:
    data, _ = folders.tracked(tmp_path)
    rewrite(data, 2, change)
    with pytest.raises(AvatarError, match=rf"00002\.frame: {message}"):
        load(data)


def test_a_frame_that_would_run_code_is_refused(tmp_path: Path) -> None:
    class Command:
        def __reduce__(self) -> tuple[Any, ...]:
            return (Path.touch, (tmp_path / "ran",))

    data, _ = folders.tracked(tmp_path)
    torch.save({"flame": Command()}, data / "checkpoint" / "00002.frame")
    with pytest.raises(AvatarError, match=r"00002\.frame"):
        load(data)
    assert not (tmp_path / "ran").exists()
