"""Clips from every kind of file, their names, and the way to poses and back."""

from __future__ import annotations

import zipfile
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from avatar_export.clips import gltf_clip, gltf_files
from avatar_export.clips.poses import clip_from_poses, clip_poses, first_frame, rig_avatar
from avatar_export.clips.sources import clips_from, unique_name
from avatar_export.driving import drive, takes
from avatar_export.options import ReadOptions
from avatar_export.playing import sequences
from avatar_export.readers import lam
from avatar_export.rigs.rig_driving import expressions_named, rig_driving
from avatar_export.rigs.rig_file import read_rig_file
from avatar_runtime.avatar import Avatar, Rig
from avatar_runtime.checks.avatar import check_avatar
from avatar_runtime.io.errors import AvatarError
from avatar_runtime.pose import Pose, joint_rotation, resolve
from tests.avatars import avatar_of, rig_of
from tests.exporter.readers import lam_files
from tests.exporter.readers.lam_files import edited
from tests.exporter.rigs import rig_files
from tests.runtime.driving.recordings import CSV, UDP, recording
from tests.shared_data import shared


def _avatar(folder: Path) -> Avatar:
    """The character of rig_files, driven by ARKit names."""
    path = folder / "made.glb"
    path.write_bytes(rig_files.rig_glb())
    found = read_rig_file(path)
    expressions = expressions_named(found.morph_names)
    return replace(rig_avatar(found.rig, expressions), driving=rig_driving(found.rig, expressions))


def _one_triangle(avatar: Avatar) -> Rig:
    """The joints of `avatar`, on the mesh of `avatar_of`."""
    assert avatar.rig is not None
    rig = avatar.rig
    return rig_of(rig.joint_names, rig.parents.tolist(), rig.rest_local)


def test_poses_and_back(tmp_path: Path) -> None:
    avatar = avatar_of(("jawOpen", "smile"), _one_triangle(_avatar(tmp_path)), eyelids=("left",))
    world = np.eye(4)
    world[:3, 3] = (1, 2, 3)
    poses = [
        Pose({"smile": 0.25}, {"head": joint_rotation((0.1, 0.2, 0.3))}, {"left": 0.5}, world),
        Pose({"jawOpen": -0.5}),
    ]
    clip = clip_from_poses(avatar, "take", 24, poses)
    assert (clip.name, clip.fps, clip.frames) == ("take", 24.0, 2)
    assert clip.expression_weights.tolist() == [[0, 0.25], [-0.5, 0]] and clip.late_weights[0, 0] == 0.5
    check_avatar(replace(avatar, clips=(clip,)))
    for pose, back in zip(poses, clip_poses(avatar, clip), strict=True):
        want, got = resolve(pose, avatar), resolve(back, avatar)
        np.testing.assert_array_equal(got.expression_weights, want.expression_weights)
        np.testing.assert_array_equal(got.late_weights, want.late_weights)
        np.testing.assert_allclose(got.joint_delta, want.joint_delta, atol=1e-7)
        np.testing.assert_array_equal(got.world_from_avatar, want.world_from_avatar)
    again = clip_from_poses(avatar, "take", 24, clip_poses(avatar, clip))
    np.testing.assert_array_equal(again.joint_delta, clip.joint_delta)
    assert first_frame(clip).frames == 1
    np.testing.assert_array_equal(first_frame(clip).joint_delta, clip.joint_delta[:1])


def test_an_avatar_without_a_rig() -> None:
    avatar = avatar_of(("a",))
    clip = clip_from_poses(avatar, "x", 30, [Pose({"a": 1.0})])
    assert clip.joint_delta.shape == (1, 0, 4, 4)
    assert clip_poses(avatar, clip)[0].expressions == {"a": 1.0}


@pytest.mark.parametrize(("poses", "fps"), [([], 30), ([Pose()], 0), ([Pose()], float("nan"))])
def test_no_clip(poses: list[Pose], fps: float) -> None:
    with pytest.raises(ValueError, match="a clip needs poses"):
        clip_from_poses(avatar_of(), "x", fps, poses)


@pytest.mark.parametrize("name", [CSV, UDP])
def test_recordings_of_a_face(tmp_path: Path, name: str) -> None:
    avatar, path = _avatar(tmp_path), recording(name)
    (clip,) = clips_from(avatar, path)
    take = takes.read_take(path)
    assert (clip.name, clip.fps, clip.frames) == (path.stem, take.fps, len(take))
    want = drive.poses(avatar, take)[7]
    np.testing.assert_allclose(clip.expression_weights[7, 0], want.expressions["AK_25_JawOpen"], atol=1e-6)
    np.testing.assert_allclose(clip.joint_delta[7, 2], want.joints["head"], atol=1e-6)


def test_names_differ(tmp_path: Path) -> None:
    avatar, path = _avatar(tmp_path), tmp_path / "made.glb"
    (first,) = clips_from(avatar, path)
    avatar = replace(avatar, clips=(first,))
    (second,) = clips_from(avatar, path)
    (third,) = clips_from(replace(avatar, clips=(first, second)), path)
    assert [first.name, second.name, third.name] == ["nod", "nod_2", "nod_3"]
    (named,) = clips_from(replace(avatar, clips=(replace(first, name=recording(CSV).stem),)), recording(CSV))
    assert named.name == f"{recording(CSV).stem}_2"
    assert unique_name("a\n\x1b[2Jb", ()) == "a__[2Jb" and unique_name(" ", {"clip"}) == "clip_2"


def test_names_of_one_file_differ(tmp_path: Path) -> None:
    avatar, path = _avatar(tmp_path), tmp_path / "made.glb"

    def twice(document: dict[str, Any]) -> None:
        clip = document["animations"][0]
        document["animations"] = [{**clip, "name": "nod_"}, {**clip, "name": "nod\x1b"}]

    path.write_bytes(edited(path.read_bytes(), twice))
    assert [clip.name for clip in clips_from(avatar, path)] == ["nod_", "nod__2"]


def test_clips_of_a_glb_keep_the_rate_of_their_keys(tmp_path: Path) -> None:
    avatar, path = _avatar(tmp_path), tmp_path / "made.glb"
    assert clips_from(avatar, path)[0].fps == rig_files.FPS
    times = (np.arange(rig_files.FRAMES) / rig_files.FPS).astype("<f4")
    uneven = path.read_bytes().replace(times.tobytes(), (times**1.5).astype("<f4").tobytes())
    path.write_bytes(uneven)
    (clip,) = clips_from(avatar, path)
    assert clip.fps == 30
    want = gltf_clip.clip_poses(avatar, gltf_files.gltf_of(path), "nod", 30)
    np.testing.assert_allclose(clip.joint_delta[5, 2], want[5].joints["head"], atol=1e-6)


def test_clips_that_move_nothing_here_are_left_out(tmp_path: Path) -> None:
    avatar, path = _avatar(tmp_path), tmp_path / "made.glb"

    def another(document: dict[str, Any]) -> None:
        clip = document["animations"][0]
        document["nodes"].append({"name": "camera"})
        channel = {"sampler": 0, "target": {"node": len(document["nodes"]) - 1, "path": "rotation"}}
        document["animations"] = [{**clip, "name": "flight", "channels": [channel]}, clip]

    path.write_bytes(edited(path.read_bytes(), another))
    assert [clip.name for clip in clips_from(avatar, path)] == ["nod"]
    with pytest.raises(AvatarError, match="camera"):
        gltf_files.clip_named(avatar, gltf_files.gltf_of(path), "flight")
    with pytest.raises(AvatarError, match=r"'not' is not a clip of this file; did you mean nod\?"):
        sequences.clip(avatar, str(path), "not")
    stranger = avatar_of(("a",))
    assert clips_from(stranger, path, optional=True) == ()
    with pytest.raises(AvatarError, match=r"made\.glb: has no animation that moves a joint or an expression"):
        clips_from(stranger, path)


def test_a_lam_zip(tmp_path: Path) -> None:
    zipped = lam_files.write_zip(tmp_path / "a.zip", lam_files.files(animation=rig_files.rig_glb()))
    avatar = lam.read_lam(zipped)
    (clip,) = clips_from(avatar, zipped)
    assert clip.name == "nod" and clip.joint_delta.shape == (rig_files.FRAMES, 4, 4, 4)
    (with_it,) = lam.read(zipped, ReadOptions()).clips
    np.testing.assert_array_equal(with_it.joint_delta, clip.joint_delta)
    check_avatar(replace(avatar, clips=(clip,)))
    bare = lam_files.write_zip(tmp_path / "b.zip", lam_files.files())
    assert clips_from(lam.read_lam(bare), bare, optional=True) == ()
    with pytest.raises(AvatarError, match=r"b\.zip: has no animation"):
        clips_from(avatar, bare)


def test_the_clips_of_a_real_lam_zip() -> None:
    path = shared("lam/p2-1.zip")
    avatar = lam.read_lam(path)
    clips = clips_from(avatar, path)
    assert len(clips) == 12 and {clip.fps for clip in clips} == {24.0}
    check_avatar(replace(avatar, clips=clips))


def test_poses_without_a_rig_are_refused(tmp_path: Path) -> None:
    np.savez(tmp_path / "poses.npz", thetas=np.zeros((1, 72)))
    with pytest.raises(AvatarError, match=r"poses\.npz: poses a body model, but this avatar has no rig"):
        clips_from(avatar_of(), tmp_path / "poses.npz")


def test_files_that_hold_no_poses(tmp_path: Path) -> None:
    (tmp_path / "a.txt").write_text("nothing")
    with zipfile.ZipFile(tmp_path / "a.zip", "w") as archive:
        archive.writestr("x", "y")
    for name in ("a.txt", "a.zip", "none.csv", "none.glb", "none.fbx", "none.json"):
        with pytest.raises(AvatarError):
            clips_from(_avatar(tmp_path), tmp_path / name)
