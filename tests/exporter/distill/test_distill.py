"""Dumps in, an avatar out: what is reached, which form is chosen, what is refused and what is warned of."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from samples.dumps import random_poses, write_dumps

from avatar_export.commands import distill as command
from avatar_export.distill import make
from avatar_export.distill import refuse as judges
from avatar_export.distill.conventions import settled
from avatar_export.distill.dumps.folder import Encoding, open_dumps
from avatar_export.distill.dumps.frames import layout
from avatar_export.distill.dumps.held import split
from avatar_export.distill.learn import Task, still
from avatar_export.distill.make import Distilled, distill
from avatar_export.distill.measure import Errors
from avatar_export.distill.report import report_html
from avatar_export.distill.skeleton import exercised, skeleton_of
from avatar_export.notes.note import Note, doubt, fact
from avatar_export.writers.bundle import write_bundle
from avatar_runtime.avatar import Avatar
from avatar_runtime.bundle import load
from avatar_runtime.io.errors import AvatarError
from avatar_runtime.player import Player
from avatar_runtime.pose import Pose
from tests.commands import Run
from tests.exporter.distill.conftest import copied, edited, with_arrays


@pytest.fixture(scope="module")
def of_head(head_dumps: Path) -> Distilled:
    """The head, distilled without a mesh."""
    return distill(head_dumps)


@pytest.fixture(scope="module")
def of_body(body_dumps: Path, small_body: Avatar) -> Distilled:
    """The body, distilled with its mesh."""
    return distill(body_dumps, rig=small_body.rig, morph_names=small_body.expression_names)


def test_a_head_is_repeated_on_poses_that_were_held_out(of_head: Distilled) -> None:
    """Asked for the whole head: 0.1 mm and 50 dB."""
    assert of_head.form == "skinning" and of_head.reason.values["why"] == "no mesh was given"
    assert of_head.errors.rms < 0.1 and of_head.errors.decibels > 50
    assert (
        max(left.sum() / of_head.errors.moved[part].sum() for part, left in of_head.errors.left.items())
        < 0.01
    )


def test_errors_are_those_of_the_player(of_head: Distilled, small_head: Avatar) -> None:
    """The oracle poses source and result itself, by names, and compares positions."""
    poses = random_poses(small_head, 8, 8.0, seed=8)
    source, result = (Player(avatar, "reference") for avatar in (small_head, of_head.avatar))
    off = []
    for pose in poses:
        eyelids = {f"eyelid_{name}": weight for name, weight in pose.eyelids.items()}
        other = Pose({**pose.expressions, **eyelids}, pose.joints)
        off.append(np.square(source.animate(pose).mean - result.animate(other).mean).sum(axis=1).mean())
    assert 1e3 * np.sqrt(np.mean(off)) == pytest.approx(of_head.errors.rms, rel=1e-3)


def test_ranges_are_what_was_seen(of_head: Distilled, head_dumps: Path) -> None:
    drivers = open_dumps(head_dumps).drivers
    learnt = drivers.drivers[drivers.take == 0]
    for index, expression in enumerate(of_head.avatar.expressions):
        assert expression.range == pytest.approx((min(0, learnt[:, index].min()), learnt[:, index].max()))


def test_rights_and_notes_go_into_the_provenance(of_head: Distilled) -> None:
    provenance = of_head.avatar.provenance
    assert (provenance["licence"], provenance["consent"]) == ("CC BY 4.0", "signed")
    assert "held-out frames" in provenance["notes"][0]


def test_a_surface_is_found_again(of_body: Distilled, small_body: Avatar) -> None:
    assert of_body.form == "embedding on the mesh"
    assert {one.form for one in of_body.tried} == {"skinning", "embedding on the mesh"}
    found, true = of_body.avatar.embedding, small_body.embedding
    assert found is not None and true is not None
    assert (found.triangle == true.triangle).mean() > 0.9
    assert of_body.avatar.rules.scale == small_body.rules.scale
    assert of_body.errors.rms < 0.6 and of_body.errors.decibels > 40


def test_a_rig_that_did_not_pose_the_dumps_is_refused(
    body_dumps: Path, small_head: Avatar, small_body: Avatar
) -> None:
    with pytest.raises(AvatarError, match="lacks joint 'root', which the rig has"):
        distill(body_dumps, rig=small_head.rig)
    rest = small_body.rig.rest_local.copy()
    rest[1, :3, 3] += 0.3
    with pytest.raises(AvatarError, match=r"rests .* mm from that of the rig"):
        distill(body_dumps, rig=replace(small_body.rig, rest_local=rest))


def test_without_a_skeleton_clips_are_baked(small_head: Avatar, tmp_path: Path) -> None:
    poses = random_poses(small_head, 24, 4.0)
    folder = write_dumps(small_head, [poses[:16], poses[16:]], tmp_path / "dumps", skeleton=False)
    result = distill(folder, accept_error=True)
    assert result.form == "baked clips" and result.avatar.rig is None
    assert "no_skeleton" in [note.kind for note in result.doubts]
    assert {e.name[:9] for e in result.avatar.expressions} == {"residual_"}
    assert "baked, an upper bound" in report_html(result) and "baked clips, not held out" in str(
        result.avatar.provenance
    )


def settled_task(folder: Path) -> tuple[Task, list[str]]:
    """The task of learning from dumps, with the conventions that their motion shows."""
    dumps = open_dumps(folder)
    fitted, mended = split(dumps).fitted, list[Note]()
    known = layout(dumps.frame(0), dumps.encoding)
    return settled(Task.of(dumps, known, fitted, skeleton_of(dumps, fitted)), mended), mended


def test_the_order_of_quaternions_is_found_by_the_motion(small_head: Avatar, tmp_path: Path) -> None:
    folder = write_dumps(small_head, [random_poses(small_head, 16, 15.0)], tmp_path / "dumps")
    task, mended = settled_task(edited(folder, encoding__quaternion="xyzw"))
    assert mended == [fact("quaternion_order", right="wxyz", stated="xyzw")]
    assert task.dumps.encoding.quaternion == "wxyz" and task.turns


@pytest.mark.parametrize("stored", ["rotated", "unrotated"])
def test_sh_stored_unrotated_are_found(small_head: Avatar, tmp_path: Path, stored: str) -> None:
    g, shapes = small_head.gaussians, small_head.blendshapes
    rest = np.random.default_rng(0).normal(0, 0.1, (g.count, 3, 3)).astype(np.float32)
    wide = np.zeros((shapes.appearance.entries, 4, 3), np.float32)
    values = {**shapes.appearance.values, "sh": wide}
    shown = replace(
        small_head,
        gaussians=replace(g, sh=np.concatenate([g.sh, rest], axis=1)),
        sh_degree=1,
        blendshapes=replace(shapes, appearance=replace(shapes.appearance, values=values)),
    )
    poses = random_poses(shown, 16, 15.0)
    folder = write_dumps(shown, [poses], tmp_path / "dumps", Encoding(sh=stored))
    task, mended = settled_task(edited(folder, encoding__sh="rotated"))
    assert any(note.kind == "unrotated_sh" for note in mended) == (stored == "unrotated")
    assert task.sh_direction == "inverse_rotation"
    found = still(task, task.rows(slice(0, g.count))).values["sh"].mean(axis=0).reshape(-1, 4, 3)[:, 1:]
    assert np.square(found - rest).mean() < 0.01 * np.square(rest).mean()


def test_joints_that_do_not_turn_gaussians_are_found(small_head: Avatar, tmp_path: Path) -> None:
    stiff = replace(small_head, rules=replace(small_head.rules, rotation="none", sh_direction="world"))
    task, _ = settled_task(write_dumps(stiff, [random_poses(stiff, 16, 15.0)], tmp_path / "dumps"))
    assert not task.turns and task.sh_direction == "world"


def errors_of(decibels: float, millimetres: float) -> Errors:
    """Errors of one frame of a figure of 0.3 m."""
    one = np.ones(1)
    return Errors(np.zeros(1, np.int64), one, millimetres * one, decibels * one, 0.3, {}, {}, ())


def test_large_errors_are_refused_unless_they_are_accepted() -> None:
    for errors, wanted in (
        (errors_of(24.9, 0.1), "24.9 dB, less than 25"),
        (errors_of(40.0, 3.1), "3.1 mm off.* 1 %"),
    ):
        with pytest.raises(AvatarError, match=f"{wanted}.*--accept-error"):
            judges.refuse(errors, accept=False)
        assert len(judges.refuse(errors, accept=True)) == 1
    assert judges.refuse(errors_of(35.9, 0.1), accept=False) == [doubt("foreground_off", db=35.9, least=36.0)]
    assert judges.refuse(errors_of(36.1, 2.9), accept=False) == []


def test_a_sweep_that_is_not_finite_is_refused(of_head: Distilled) -> None:
    avatar = of_head.avatar
    wild = replace(avatar.blendshapes.appearance)
    values = {**wild.values, "log_scale": np.full_like(wild.values["log_scale"], 300.0)}
    broken = replace(avatar, blendshapes=replace(avatar.blendshapes, appearance=replace(wild, values=values)))
    with pytest.raises(AvatarError, match=r"scale: is not finite at .* times the range"):
        judges.sweep(broken, np.zeros(len(avatar.rig.joint_names)), 0.3)


def test_few_frames_and_one_block_of_neighbours_are_doubted(few: Path, head_dumps: Path) -> None:
    (found,) = split(open_dumps(few)).doubts
    assert found.kind == "few_frames" and found.values["drivers"] == 53
    assert split(open_dumps(head_dumps)).doubts == ()
    frames = split(open_dumps(with_arrays(few, take=np.zeros(6, np.int64))))
    assert frames.doubts[1].kind == "one_take" and frames.held_out.tolist() == [5]


def test_takes_are_held_out_whole(few: Path) -> None:
    assert split(open_dumps(few)).held_out.tolist() == [4, 5]
    assert split(open_dumps(edited(few, held_out=[0]))).held_out.tolist() == [0, 1, 2, 3]


def test_a_driver_that_was_not_exercised_is_named(head_dumps: Path, tmp_path: Path) -> None:
    folder = copied(head_dumps, tmp_path / "dumps")
    values = open_dumps(folder).drivers.drivers.copy()
    values[:, 3] = 0
    drivers = open_dumps(with_arrays(folder, drivers=values)).drivers
    assert 3 not in exercised(drivers, np.arange(120)) and 3 in exercised(
        open_dumps(head_dumps).drivers, np.arange(120)
    )


def test_the_command_writes_a_sound_bundle_and_a_report(
    of_head: Distilled, tmp_path: Path, run: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    def learnt(*_: object, written: Callable[[Distilled], None], **__: object) -> Distilled:
        written(of_head)
        return of_head

    bare = partial(write_bundle, preview=False, engine_files=False, reference=False)
    monkeypatch.setattr(make, "distill", learnt)
    monkeypatch.setattr(command, "write_bundle", bare)
    out = tmp_path / "head"
    code, text, _ = run("distill", tmp_path, "-o", out, "--dry-run")
    assert code == 0 and not out.exists() and "dB in the foreground (held out)" in text
    page = (tmp_path / "head.report.html").read_text("utf-8")
    for heading in (
        "Error by frame",
        "not explained",
        "driver was exercised",
        "Beyond the data",
        "Worst frames",
    ):
        assert heading in page
    code, _, error = run("distill", tmp_path, "-o", out)
    assert code == 2 and "head.report.html: exists" in error
    code, _, error = run("distill", tmp_path, "-o", out, "--force", "--author", "A. N. Author")
    assert code == 0 and "note: no mesh was given" in error
    assert run("validate", out)[:2] == (0, f"{out}: sound\n")
    assert load(out).provenance["author"] == "A. N. Author"


def test_check_counts_and_says(head_dumps: Path, few: Path, run: Run) -> None:
    done = run("check", head_dumps)
    assert done[0] == 0 and "128 frames" in done[1] and "5 joints, 53 drivers" in done[1]
    done = run("check", few)
    assert done[0] == 0 and "warning: there are 4 frames to learn from" in done[1]
