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
from avatar_export.distill.dumps.folder import Encoding, open_dumps
from avatar_export.distill.learn import Task, still
from avatar_export.distill.make import Distilled, distill
from avatar_export.distill.measure import Errors
from avatar_export.distill.prepare import prepared
from avatar_export.distill.report import report_html
from avatar_export.distill.residual import LARGER
from avatar_export.distill.worth import WORTH, lean
from avatar_export.notes.note import Note
from avatar_export.notes.text import text
from avatar_export.writers.bundle import write_bundle
from avatar_runtime.avatar import Avatar, SparseRows
from avatar_runtime.bundle import load
from avatar_runtime.player import Player
from avatar_runtime.pose import Pose
from tests.avatars import full_avatar
from tests.commands import Run
from tests.exporter.distill.conftest import bent, edited
from tests.exporter.refusals import refused
from tests.rigs import dense


@pytest.fixture(scope="module")
def of_head(head_dumps: Path) -> Distilled:
    """The head, distilled without a mesh."""
    return distill(head_dumps)


@pytest.fixture(scope="module")
def of_body(body_dumps: Path, small_body: Avatar) -> Distilled:
    """The body, distilled with its mesh."""
    return distill(body_dumps, rig=small_body.rig, morph_names=small_body.expression_names)


def test_a_head_is_repeated_on_poses_that_were_held_out(of_head: Distilled, head_dumps: Path) -> None:
    """Asked for the whole head: 0.1 mm and 50 dB."""
    assert of_head.form == "skinning" and "no mesh was given" in text(of_head.reason)
    errors, provenance = of_head.errors, of_head.avatar.provenance
    assert errors.rms < 0.1 and errors.decibels > 50
    assert max(left.sum() / errors.moved[part].sum() for part, left in errors.left.items()) < 0.01
    assert (provenance["licence"], provenance["consent"]) == ("CC BY 4.0", "signed")
    assert "held-out" in str(provenance["notes"])
    drivers = open_dumps(head_dumps).drivers
    learnt = drivers.drivers[drivers.take == 0]
    for index, expression in enumerate(of_head.avatar.expressions):  # ranges are what was seen
        assert expression.range == pytest.approx((min(0, learnt[:, index].min()), learnt[:, index].max()))


def test_a_surface_is_found_again(of_body: Distilled, small_body: Avatar) -> None:
    assert of_body.form == "embedding on the mesh"
    assert {one.form for one in of_body.tried} == {"skinning", "embedding on the mesh"}
    found, true = of_body.avatar.embedding, small_body.embedding
    assert found is not None and true is not None
    assert (found.triangle == true.triangle).mean() > 0.9
    assert of_body.avatar.rules.scale == small_body.rules.scale
    assert of_body.errors.rms < 0.6 and of_body.errors.decibels > 40


def test_another_rig_is_refused(body_dumps: Path, small_head: Avatar, small_body: Avatar) -> None:
    refused("lacks joint 'root', which the rig has", distill, body_dumps, rig=small_head.rig)
    rest = small_body.rig.rest_local.copy()
    rest[1, :3, 3] += 0.3
    rig = replace(small_body.rig, rest_local=rest)
    refused(r"rests .* mm from that of the rig", distill, body_dumps, rig=rig)


def test_without_a_skeleton_clips_are_baked(small_head: Avatar, tmp_path: Path) -> None:
    poses = random_poses(small_head, 24, 4.0)
    folder = write_dumps(small_head, [poses[:16], poses[16:]], tmp_path / "dumps", skeleton=False)
    result = distill(folder, accept_error=True)
    assert result.form == "baked clips" and result.avatar.rig is None
    assert "no_skeleton" in [note.kind for note in result.doubts]
    assert {e.name[:9] for e in result.avatar.expressions} == {"residual_"}
    assert "baked, an upper bound" in report_html(result) and "not held out" in str(result.avatar.provenance)


def settled_task(folder: Path) -> tuple[Task, list[Note]]:
    """The task of learning from dumps, with the conventions that their motion shows."""
    given = prepared(folder)
    return given.task, list(given.checked.mended)


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


def errors_of(decibels: float, millimetres: float) -> Errors:
    """Errors of one frame of a figure of 0.3 m."""
    one = np.ones(1)
    return Errors(np.zeros(1, np.int64), one, millimetres * one, decibels * one, 0.3, {}, {}, ())


def test_large_errors_are_refused_unless_they_are_accepted() -> None:
    for decibels, millimetres, wanted in (
        (24.9, 0.1, "24.9 dB, less than 25"),
        (40.0, 3.1, "3.1 mm off.* 1 %"),
    ):
        errors = errors_of(decibels, millimetres)
        refused(f"{wanted}.*--accept-error", judges.refuse, errors, accept=False)
        assert len(judges.refuse(errors, accept=True)) == 1
    (doubt,) = judges.refuse(errors_of(35.9, 0.1), accept=False)
    assert "35.9 dB" in text(doubt) and judges.refuse(errors_of(36.1, 2.9), accept=False) == []


def test_a_sweep_that_is_not_finite_is_refused(of_head: Distilled) -> None:
    avatar, wild = of_head.avatar, of_head.avatar.blendshapes.appearance
    values = {**wild.values, "log_scale": np.full_like(wild.values["log_scale"], 300.0)}
    broken = replace(avatar, blendshapes=replace(avatar.blendshapes, appearance=replace(wild, values=values)))
    still = np.zeros(len(avatar.rig.joint_names))
    refused(r"scale: is not finite at .* times the range", judges.sweep, broken, still, 0.3)


def test_the_command(of_head: Distilled, tmp_path: Path, run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
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
    for heading in ("Error by frame", "not explained", "was exercised", "Beyond the data", "Worst frames"):
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


def flat(rows: SparseRows, name: str) -> np.ndarray:
    """[N, K, c] of an attribute."""
    found = dense(rows, name)
    return found.reshape(*found.shape[:2], -1).astype(np.float64)


PATTERNS = (("geometry", ("mean", "quat_wxyz")), ("appearance", ("log_scale", "opacity_logit", "sh")))


@pytest.mark.parametrize("most", [0.0, 0.3, 1e9])
def test_what_stays_fits_best_what_all_did(most: float) -> None:
    """The oracle: least squares on the columns that stay, Gaussian by Gaussian."""
    avatar = full_avatar(3)
    rng = np.random.default_rng(1)
    weights = rng.uniform(0, 1, (40, len(avatar.expressions)))
    weights[:, 1] += 0.7 * weights[:, 0]  # so that one can take over a part of what the other did
    share = rng.uniform(0.5, 2, avatar.gaussians.count)
    found = lean(avatar, weights, share, most * everything(avatar, weights, share))
    gone = 0
    for part, names in PATTERNS:
        before, after = (getattr(one.blendshapes, part) for one in (avatar, found))
        gone += before.entries - after.entries
        for name in names:
            was, now = flat(before, name), flat(after, name)
            base = getattr(avatar.gaussians, name).reshape(len(was), -1)
            moved = getattr(found.gaussians, name).reshape(len(was), -1)
            for row in range(len(was)):
                stays = after.column[after.row_ptr[row] : after.row_ptr[row + 1]]
                columns = np.concatenate([np.ones((40, 1)), weights[:, stays]], axis=1)
                wanted = base[row] + weights @ was[row]
                best = columns @ np.linalg.lstsq(columns, wanted, rcond=None)[0]
                size = np.abs(was[row]).max() + 1e-9
                assert np.abs(moved[row] + weights @ now[row] - best).max() < 0.01 * size, (name, row)
    total = avatar.blendshapes.geometry.entries + avatar.blendshapes.appearance.entries
    assert gone == {0.0: 0, 1e9: total}.get(most, gone) and (most != 0.3 or 0.1 * total < gone < 0.9 * total)


def everything(avatar: Avatar, weights: np.ndarray, share: np.ndarray) -> float:
    """About what all entries show together."""
    total, power = 0.0, np.var(weights, axis=0)[:, None]
    for part, names in PATTERNS:
        for name in names:
            change = WORTH[name] * flat(getattr(avatar.blendshapes, part), name)
            total += float((share[:, None, None] * np.square(change) * power).sum())
    return total


def test_what_is_not_linear_is_baked(small_head: Avatar, tmp_path: Path) -> None:
    takes = [random_poses(small_head, 30, 4.0, active=3), random_poses(small_head, 6, 4.0, seed=8, active=3)]
    result = distill(write_dumps(small_head, takes, tmp_path / "dumps", change=bent), accept_error=True)
    assert result.form == "skinning with residual bases in the clips"
    avatar, shapes, n = result.avatar, result.avatar.blendshapes, small_head.gaussians.count
    first = avatar.expression_names.index("residual_00")
    assert result.baked is not None and result.baked.decibels > result.errors.decibels + 1
    assert np.abs(avatar.clips[0].expression_weights[:, first]).max() > 0.5
    assert "entries that show least were dropped (skinning with" in text(result.reason)
    sizes = {"geometry": 2 + 4 * (3 + 4), "appearance": 2 + 4 * (3 + 1 + 3 * avatar.gaussians.sh.shape[1])}
    added = sum(size * int((getattr(shapes, part).column >= first).sum()) for part, size in sizes.items())
    others = sum(size * int((getattr(shapes, part).column < first).sum()) for part, size in sizes.items())
    others += 4 * n * (11 + 3 * avatar.gaussians.sh.shape[1])
    others += shapes.correctives.entries * (2 + 12) + avatar.skin.entries * (2 + 4)
    assert 0.5 * (LARGER - 1) * others < added <= (LARGER - 1) * others
    player = Player(avatar, "reference")
    truth = Player(small_head, "reference")
    off = []
    for pose in takes[1]:
        eyelids = {f"eyelid_{name}": weight for name, weight in pose.eyelids.items()}
        driven = player.animate(Pose({**pose.expressions, **eyelids}, pose.joints))
        off.append(np.square(driven.mean - bent(truth.animate(pose), pose).mean).sum(axis=1).mean())
    assert 1e3 * np.sqrt(np.mean(off)) == pytest.approx(result.errors.rms, rel=1e-3)
