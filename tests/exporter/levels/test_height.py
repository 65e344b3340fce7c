"""How large a level may be shown: judged by its worst image and its worst block, over what is hardest to show."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from avatar_export.levels import heights_px, served
from avatar_export.levels.height import box_of, differ
from avatar_export.levels.judging import centre_rows, judged_poses
from avatar_runtime.avatar import Avatar
from avatar_runtime.bundle import load
from avatar_runtime.camera import Camera
from avatar_runtime.player import Player
from avatar_runtime.pose import Pose
from avatar_runtime.stages.project import project
from avatar_runtime.stages.raster import Image
from avatar_runtime.subset import subset

TRAINED = Path(__file__).parents[3] / "samples" / "trained"
SIDE = 256


@cache
def trained(name: str) -> Avatar:
    return load(TRAINED / name)


def joint_at(avatar: Avatar, name: str) -> np.ndarray:
    """[3] where a joint rests, mesh space."""
    assert avatar.rig is not None
    return np.linalg.inv(avatar.rig.inverse_bind_matrix[avatar.rig.joint_names.index(name)])[:3, 3]


def image(colour: np.ndarray) -> Image:
    """An opaque image of [SIDE, SIDE] grey values."""
    flat = np.repeat(colour[:, :, None], 3, axis=2).astype(np.float32)
    return Image(flat, np.zeros((SIDE, SIDE), np.float32), np.zeros((SIDE, SIDE), np.int32), 0)


def decibels(error: np.ndarray) -> float:
    return float(-10 * np.log10(np.mean(error**2)))


@pytest.mark.parametrize("row", [64, 69, 72, 79])  # on the borders of blocks, and between them
def test_a_smeared_eye_is_told_apart_though_the_mean_is_high(row: int) -> None:
    wanted, drawn = np.full((2, SIDE, SIDE), 0.5)
    drawn[row : row + 8, 101:109] += 0.2
    assert decibels(drawn - wanted) > 43
    assert differ(image(wanted), image(drawn), None)
    assert not differ(image(wanted), image(wanted), None)


def test_the_centre_of_the_face_and_the_whole_image_have_thresholds_of_their_own() -> None:
    wanted = np.full((SIDE, SIDE), 0.5)
    face = (slice(100, 140), slice(90, 150))
    in_face, everywhere = wanted.copy(), wanted + 10 ** (-39.9 / 20)
    in_face[face] += 10 ** (-35.9 / 20)
    assert decibels(in_face - wanted) > 40 and differ(image(wanted), image(in_face), face)
    assert not differ(image(wanted), image(in_face), None)
    assert differ(image(wanted), image(everywhere), None)
    assert not differ(image(wanted), image(wanted + 10 ** (-40.1 / 20)), face)


def test_what_is_not_finite_is_told_apart() -> None:
    wanted = np.full((SIDE, SIDE), 0.5)
    drawn = wanted.copy()
    drawn[3, 3] = np.nan
    assert differ(image(wanted), image(drawn), None)


def test_a_level_with_one_smeared_eye_serves_fewer_heights_than_one_without(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("avatar_export.levels.height.OCTAVES", 2)
    monkeypatch.setattr("avatar_export.levels.height.judged_poses", lambda avatar: judged_poses(avatar)[:3])
    source = trained("head_blendshapes")
    at = np.linalg.norm(source.gaussians.mean - joint_at(source, "leftEye"), axis=1)
    sh = source.gaussians.sh.copy()
    sh[at < 0.02, 0] = sh[at < 0.02, 0].mean(axis=0)
    smeared = replace(source, gaussians=replace(source.gaussians, sh=sh))
    whole, less = heights_px(source, [source, smeared])
    assert whole == 256 and less < 200


def test_levels_that_nobody_would_see_are_left_out_and_said(monkeypatch: pytest.MonkeyPatch) -> None:
    source = trained("body_splatting")
    levels = [subset(source, np.arange(n), np.arange(0)).avatar for n in (600, 500, 400, 300, 200)]
    found: list[int] = []
    monkeypatch.setattr("avatar_export.levels.height.heights_px", lambda _, coarse: found[: len(coarse)])
    found[:] = [300, 128, 128, 64]
    kept = served(levels)
    assert kept.kept == (0, 1, 3) and kept.heights == (None, 300, 128)
    values = {"level_served": {"count": 400, "height": 128}, "level_unlike": {"count": 200, "least": 64}}
    assert {note.kind: note.values for note in kept.notes} == values
    found[:] = [90, 100, 0, 0]
    assert served(levels).kept == (0, 2)
    found[:] = [0, 0, 0, 0]
    assert served(levels).kept == (0,) and len(served(levels).notes) == 4
    assert served(levels[:1]).notes == ()


def test_every_expression_is_judged_at_its_ends_with_lids_shut_and_a_wide_mouth() -> None:
    avatar = trained("head_blendshapes")
    poses = judged_poses(avatar)
    assert len(poses) >= 48
    assert all(np.array_equal(pose.world_from_avatar, np.eye(4)) for pose in poses)
    alone = {tuple(pose.expressions.items()) for pose in poses if len(pose.expressions) == 1}
    assert {((e.name, end),) for e in avatar.expressions for end in e.range if end} <= alone
    assert any(min(pose.eyelids.get(name, 0) for name in avatar.eyelids) == 1 for pose in poses)
    lids = ("eyeBlinkLeft", "eyeBlinkRight")
    assert any(min(pose.expressions.get(name, 0) for name in lids) == 1 for pose in poses)
    assert any(pose.expressions.get("jawOpen", 0) == 1 for pose in poses)


def test_the_box_of_a_face_is_where_its_gaussians_are_drawn() -> None:
    head = trained("head_blendshapes")
    splats = Player(head).animate(Pose({"jawOpen": 1.0}))
    camera = Camera.orbit(np.array([0.02, -0.05, 0.03]), 2.0, 0.7, 0.1, 0.3, 300, 300)
    rows = np.flatnonzero(splats.mean[:, 0] > 0.03)
    down, across = box_of(splats.mean[rows], camera)
    x, y = project(splats, camera, head.raster, head.sh_degree).centre[rows].T
    for found, at in ((across, x), (down, y)):
        low, high = np.percentile(at, [2, 98])
        assert abs(found.start - low) < 2 and abs(found.stop - high) < 2


def test_bodies_are_judged_in_as_many_poses_and_have_no_face() -> None:
    body = trained("body_splatting")
    assert len(judged_poses(body)) >= 48
    assert centre_rows(body) is None


def test_the_centre_of_a_face_reaches_from_brows_to_chin_and_leaves_skull_and_neck_out() -> None:
    head = trained("head_blendshapes")
    rows = centre_rows(head)
    assert rows is not None
    mean, all_of_it = head.gaussians.mean[rows], head.gaussians.mean
    low, high = np.percentile(mean, [2, 98], axis=0)
    eyes = [joint_at(head, name) for name in ("leftEye", "rightEye")]
    assert all((low[:2] < eye[:2]).all() and (eye[:2] < high[:2]).all() for eye in eyes)
    assert (high - low)[1] < 0.6 * np.ptp(all_of_it[:, 1])
