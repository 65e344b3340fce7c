"""Clips from every kind of file, their names, and the way to poses and back."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from avatar_export.clips import gltf_files
from avatar_export.clips.poses import clip_from_poses, clip_poses, first_frame, rig_avatar
from avatar_export.clips.sources import clips_from, read_clips, unique_name
from avatar_export.notes.text import text
from avatar_export.options import ReadOptions
from avatar_export.playing import sequences
from avatar_export.readers import lam
from avatar_export.rigs.rig_driving import expressions_named, rig_driving
from avatar_export.rigs.rig_file import read_rig_file
from avatar_runtime.avatar import Avatar, Rig
from avatar_runtime.checks.avatar import check_avatar
from avatar_runtime.pose import Pose, joint_rotation, resolve
from tests import bundles
from tests.avatars import avatar_of, full_avatar, rig_of
from tests.exporter.glb_files import edited
from tests.exporter.readers import lam_files
from tests.exporter.refusals import refused
from tests.exporter.rigs import rig_files


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
    assert first_frame(clip).frames == 1
    np.testing.assert_array_equal(first_frame(clip).joint_delta, clip.joint_delta[:1])


def test_names_differ(tmp_path: Path) -> None:
    avatar, path = _avatar(tmp_path), tmp_path / "made.glb"
    clips = clips_from(avatar, path)
    for _ in range(2):
        clips += clips_from(replace(avatar, clips=clips), path)
    assert [clip.name for clip in clips] == ["nod", "nod_2", "nod_3"]
    assert unique_name("a\n\x1b[2Jb", ()) == "a__[2Jb" and unique_name(" ", {"clip"}) == "clip_2"


def test_a_clip_in_percent_is_doubted(tmp_path: Path) -> None:
    """In a .glb, and of another avatar; what goes a little beyond a range is none."""
    given, path = full_avatar(), tmp_path / "rise.glb"
    for most, percent in ((2.5, False), (80, True)):
        path.write_bytes(rig_files.rig_glb(animated=most))
        weights = np.zeros_like(given.clips[0].expression_weights)
        weights[2, 0] = most
        nod = replace(given.clips[0], expression_weights=weights)
        other = bundles.write(tmp_path / f"other{most}", replace(given, clips=(nod,)))
        for found, said in (
            (read_clips(_avatar(tmp_path), path), "rise.glb: AK_25_JawOpen is 80 in frame 12"),
            (read_clips(given, Path(f"{other}:nod")), "other80:nod: jawOpen is 80 in frame 2"),
        ):
            texts = [text(note) for note in found.notes if note.doubtful]
            assert [one.partition(": are the weights percent?")[0] for one in texts] == [
                f"clip 'nod' of {said}"
            ] * percent


def test_clips_that_move_nothing_here_are_left_out(tmp_path: Path) -> None:
    avatar, path = _avatar(tmp_path), tmp_path / "made.glb"

    def another(document: dict[str, Any]) -> None:
        clip = document["animations"][0]
        document["nodes"].append({"name": "camera"})
        channel = {"sampler": 0, "target": {"node": len(document["nodes"]) - 1, "path": "rotation"}}
        document["animations"] = [{**clip, "name": "flight", "channels": [channel]}, clip]

    path.write_bytes(edited(path.read_bytes(), another))
    assert [clip.name for clip in clips_from(avatar, path)] == ["nod"]
    refused("camera", lambda: gltf_files.clip_named(avatar, gltf_files.gltf_of(path), "flight"))
    refused(r"'not' is not a clip of this file; did you mean nod\?", sequences.clip, avatar, str(path), "not")
    stranger = avatar_of(("a",))
    assert clips_from(stranger, path, optional=True) == ()
    refused(r"made\.glb: has no animation that moves a joint or an expression", clips_from, stranger, path)


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
    refused(r"b\.zip: has no animation", clips_from, avatar, bare)


def test_files_without_poses_for_this_avatar(tmp_path: Path) -> None:
    np.savez(tmp_path / "poses.npz", thetas=np.zeros((1, 72)))
    refused(r"poses\.npz: .*this avatar has no rig", clips_from, avatar_of(), tmp_path / "poses.npz")
    (tmp_path / "a.txt").write_text("nothing")
    lam_files.write_zip(tmp_path / "a.zip", {"x": b"y"})
    assert gltf_files.gltf_of(tmp_path / "a.txt") is None
    for name in ("a.txt", "a.zip", "none.csv", "none.glb", "none.fbx", "none.json"):
        refused(".", clips_from, _avatar(tmp_path), tmp_path / name)
