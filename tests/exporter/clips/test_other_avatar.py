"""Clips of other avatars: what is matched, what is listed, what is refused."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from avatar_export.clips import other_avatar
from avatar_export.clips.sources import clips_from, read_clips
from avatar_runtime.avatar import Avatar, Clip, Driving, Expression, SparseRows
from avatar_runtime.bundle import load
from avatar_runtime.driving.driver import Driver
from avatar_runtime.driving.frame import DrivingFrame
from avatar_runtime.pose import resolve
from avatar_runtime.stages.joints import rest_transforms
from tests import bundles
from tests.avatars import full_avatar
from tests.commands import PLAIN, Run
from tests.exporter.refusals import refused

ROUNDING = 1e-6


@pytest.fixture
def other(tmp_path: Path) -> Path:
    return bundles.write(tmp_path / "other")


def _taken(avatar: Avatar, other: Path, name: str = "nod") -> Clip:
    return clips_from(replace(avatar, clips=()), Path(f"{other}:{name}"))[0]


def _renamed(avatar: Avatar, names: list[Expression]) -> Avatar:
    return replace(avatar, expressions=tuple(names), driving=Driving())


def test_expressions_are_matched_by_name_alias_and_arkit_name(other: Path) -> None:
    given = full_avatar()
    alias = Expression("x", ("mouthSmileRight",))
    renamed = _renamed(given, [alias, *map(Expression, ("JawOpen", "none", "exp_003"))])
    taken, own = _taken(renamed, other).expression_weights, given.clips[0].expression_weights
    assert np.array_equal(taken[:, [0, 1, 3]], own[:, [2, 0, 3]]) and not taken[:, 2].any()


def test_a_rotation_keeps_its_axes_in_another_rest_frame(other: Path) -> None:
    """R' in the new frame F' is F'^-1 (F R F^-1) F': the same rotation of the mesh."""
    given = full_avatar()
    assert given.rig is not None
    local = given.rig.rest_local.copy()
    local[2, :3, :3] = np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1]])
    avatar = replace(given, rig=replace(given.rig, rest_local=local))
    assert avatar.rig is not None
    taken = _taken(avatar, other)
    ours, theirs = (rest_transforms(rig)[2, :3, :3] for rig in (avatar.rig, given.rig))
    for frame in range(taken.frames):
        wanted = theirs @ given.clips[0].joint_delta[frame, 2, :3, :3] @ np.linalg.inv(theirs)
        found = ours @ taken.joint_delta[frame, 2, :3, :3] @ np.linalg.inv(ours)
        assert np.abs(found - wanted).max() < 1e-5
    notes = read_clips(replace(avatar, clips=()), Path(f"{other}:nod")).notes
    moved = np.abs(given.clips[0].joint_delta[:, 2, :3, 3]).max() > 1e-4
    assert any(note.kind == "rotations_alone" for note in notes) == moved


def test_another_basis_is_refused(other: Path) -> None:
    """exp_003 moves the mesh otherwise; ARKit's names mean the same in every avatar."""
    given = full_avatar()
    assert given.rig is not None
    morphs = given.rig.morphs
    position = morphs.values["position"] * np.where(morphs.column == 3, 2.0, 1.0)[:, None].astype(np.float32)
    avatar = replace(given, rig=replace(given.rig, morphs=_with(morphs, position)))
    refused("another basis or unit: exp_003 moves this avatar by", _taken, avatar, other)
    arkit = morphs.values["position"] * np.where(morphs.column == 0, 2.0, 1.0)[:, None].astype(np.float32)
    _taken(replace(given, rig=replace(given.rig, morphs=_with(morphs, arkit))), other)


def _with(morphs: SparseRows, position: np.ndarray[tuple[int, ...], np.dtype[np.float32]]) -> SparseRows:
    return replace(morphs, values={"position": position.astype(np.float32)})


def test_arkit_weights_pass_the_driving_of_an_avatar_that_needs_it(tmp_path: Path) -> None:
    given = full_avatar()
    source = replace(given, driving=Driving("names"))
    joints = np.tile(np.eye(4, dtype=np.float32), (5, 5, 1, 1))
    clip = replace(given.clips[0], joint_delta=joints)
    other = bundles.write(tmp_path / "still", replace(source, clips=(clip,)))
    taken = _taken(given, other)
    names = ("jawOpen", "mouthSmileLeft", "mouthSmileRight")
    for frame in range(clip.frames):
        weights = dict(zip(names, clip.expression_weights[frame, :3].tolist(), strict=True))
        arrays = resolve(Driver(given).pose(DrivingFrame(0.0, weights)), given)
        expected = arrays.expression_weights.copy()
        expected[3] += clip.expression_weights[frame, 3]
        assert np.abs(taken.expression_weights[frame] - expected).max() < ROUNDING
        assert np.abs(taken.joint_delta[frame] - arrays.joint_delta).max() < ROUNDING


def test_a_clip_that_moves_nothing_here_is_refused(other: Path) -> None:
    given = full_avatar()
    assert given.rig is not None
    rig = replace(given.rig, joint_names=tuple("abcde"))
    names = [Expression(name) for name in ("e", "f", "g", "h")]
    avatar = replace(_renamed(given, names), rig=rig, eyelids=("i", "j"))
    refused("clip 'nod' moves nothing of this avatar; it moves jawOpen", _taken, avatar, other)


def test_a_name_is_needed_and_must_exist(other: Path) -> None:
    avatar = full_avatar()
    refused(r"is an avatar; name one of its clips, .*:NAME \(it has nod, blink\)", clips_from, avatar, other)
    refused("'nods' is not a clip of that avatar; did you mean nod", _taken, avatar, other, "nods")


def test_colons_of_paths_and_names(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    given = full_avatar()
    named = replace(given, clips=(replace(given.clips[0], name="take:2"),))
    (tmp_path / "C:").mkdir()
    bundles.write(tmp_path / "C:" / "head", named)
    monkeypatch.chdir(tmp_path)
    assert other_avatar.parts_of(Path("C:/head:take:2")) == (Path("C:/head"), "take:2")
    assert other_avatar.parts_of(Path("C:/head")) == (Path("C:/head"), "")
    assert other_avatar.parts_of(Path("C:/none:take")) is None
    assert other_avatar.parts_of(Path("C:/head.csv")) is None
    taken = clips_from(replace(given, clips=()), Path("C:/head:take:2"))
    assert [clip.name for clip in taken] == ["take:2"]


def test_the_commands_take_it(other: Path, tmp_path: Path, run: Run) -> None:
    bare = replace(full_avatar(), clips=(), enhancer=None, eyelids=("left", "lid"))
    own, packed = bundles.write(tmp_path / "own", bare), tmp_path / "own.avatar"
    still, lost = tmp_path / "frame.png", "counterpart in this avatar: right"
    blink = ("--clip", f"{other}:blink")
    code, _, error = run("render", own, "-o", still, *blink, "--frames", "1:2", "--size", 32)
    assert code == 0 and still.exists(), error
    code, _, error = run("pack", own, "-o", packed, *blink, "--no-preview", "--exact")
    assert code == 0 and [clip.name for clip in load(packed).clips] == ["blink"], error
    assert lost in " ".join(error.split())
    (site := tmp_path / "mine").mkdir()
    (site / "index.html").touch()
    (game := tmp_path / "game").mkdir()
    (game / "package.json").write_text("{}")
    drops = (("drop", own, "--into", project) for project in (site, game))
    for words in (("convert", own, "-o", tmp_path / "whole", *PLAIN), *drops):
        code, _, error = run(*words, *blink)
        assert code == 0 and lost in error, error
    code, _, error = run("publish", packed, "-o", tmp_path / "site", "--clip", f"{other}:nod")
    assert code == 0 and lost in " ".join(error.split()), error
    (published,) = (tmp_path / "site").glob("packs/*.avatar")
    assert [clip.name for clip in load(published).clips] == ["blink", "nod"]
    for clip, says in (
        (f"{other}:none", "clip of that avatar"),
        (f"{tmp_path}/missing:blink", "clip of this avatar"),
    ):
        code, _, error = run("render", own, "-o", tmp_path / "x.png", "--clip", clip)
        assert code == 2 and says in error and len(error.strip().splitlines()) == 1
