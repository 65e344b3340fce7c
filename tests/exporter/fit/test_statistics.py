"""What statistics doubt beyond the cases of `wrong`: parts of rows, the real LAM avatar, kinds of gaps."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from avatar_export.bodies.pose_files import read_poses
from avatar_export.fit import gaps, neighbours, offsets, orientation
from avatar_export.fit.stored import stored_doubts
from avatar_export.readers.table import read
from avatar_runtime.avatar import Avatar, Clip
from avatar_runtime.bundle import load
from tests.exporter.fit.wrong.inputs import TRAINED
from tests.shared_data import shared

CONJUGATE = np.array([1, -1, -1, -1], np.float32)


@pytest.fixture(scope="session")
def trained() -> Avatar:
    return load(TRAINED / "head_blendshapes")


@pytest.fixture(scope="session")
def real() -> Avatar:
    return read(shared("lam/p2-1.zip"))


def part(values: Any, rows: slice, change: Callable[[Any], Any]) -> Any:
    changed = values.copy()
    changed[rows] = change(values[rows])
    return changed


def shuffled(values: Any) -> Any:
    return np.random.default_rng(0).permutation(values)


def with_gaussians(avatar: Avatar, **parts: Any) -> Avatar:
    return replace(avatar, gaussians=replace(avatar.gaussians, **parts))


def kinds(notes: list[Any], value: str) -> list[Any]:
    return [note.values.get(value, note.kind) for note in notes]


def test_a_quarter_of_the_rows(trained: Avatar) -> None:
    g, quarter = trained.gaussians, slice(0, trained.groups[0].count // 4)
    wrong = with_gaussians(trained, opacity_logit=part(g.opacity_logit, quarter, shuffled))
    assert kinds(neighbours.doubts(wrong), "what") == ["opacities"]


@pytest.mark.parametrize("key", ["opacity_logit", "log_scale", "mean"])
def test_sorted_rows_are_no_reason_for_a_doubt(key: str, trained: Avatar) -> None:
    g, count = trained.gaussians, trained.groups[0].count
    order = np.argsort(getattr(g, key)[:count].reshape(count, -1).mean(axis=1))
    names = ("mean", "log_scale", "quat_wxyz", "opacity_logit", "sh")
    rows = {name: getattr(g, name)[:count][order] for name in names}
    whole = replace(trained, groups=(replace(trained.groups[0], count=count),))
    assert neighbours.doubts(with_gaussians(whole, **rows)) == []


@pytest.mark.parametrize(
    ("change", "form"), [(lambda q: np.roll(q, -1, axis=1), "xyzw"), (lambda q: q * CONJUGATE, "conjugated")]
)
def test_quaternions_of_a_third_of_the_rows(change: Callable[[Any], Any], form: str, trained: Avatar) -> None:
    wrong = part(trained.gaussians.quat_wxyz, slice(0, None, 3), change)
    assert kinds(orientation.doubts(with_gaussians(trained, quat_wxyz=wrong)), "form") == [form]


@pytest.mark.parametrize("axis", range(2))
@pytest.mark.parametrize("rows", [slice(None), slice(0, None, 2)], ids=["all", "every second"])
def test_offsets_of_the_real_avatar(axis: int, rows: slice, real: Avatar) -> None:
    assert real.rig is not None
    assert offsets.doubts(real) == []
    signs = np.where(np.arange(3) == axis, -1, 1)
    offset = part(real.gaussians.mean - real.rig.vertices, rows, lambda values: values * signs)
    (note,) = offsets.doubts(with_gaussians(real, mean=(real.rig.vertices + offset).astype(np.float32)))
    assert "xyz"[axis] in (note.values.get("axis"), note.values.get("axes"))


@pytest.mark.parametrize("form", ["xyzw", "conjugated", None])
def test_rotations_of_a_point_cloud(form: str | None, splatting_head_avatar: Avatar) -> None:
    avatar, g = splatting_head_avatar, splatting_head_avatar.gaussians
    assert stored_doubts(g.mean, -g.quat_wxyz, avatar, "a.ply") == []
    change = {"xyzw": lambda q: np.roll(q, -1, axis=1), "conjugated": lambda q: q * CONJUGATE, None: shuffled}
    (note,) = stored_doubts(g.mean, part(g.quat_wxyz, slice(0, 500), change[form]), avatar, "a.ply")
    assert (note.kind, note.values["form"]) == ("stored_quaternions", form)
    if form is None:  # of another frame
        assert stored_doubts(g.mean + np.float32(0.1), shuffled(g.quat_wxyz), avatar, "a.ply") == []


def test_places_of_a_point_cloud(splatting_head_avatar: Avatar) -> None:
    avatar, g = splatting_head_avatar, splatting_head_avatar.gaussians
    moved = part(g.mean, slice(0, 500), lambda mean: mean + np.float32(1e-3))
    assert kinds(stored_doubts(moved, g.quat_wxyz, avatar, "a.ply"), "") == ["stored_elsewhere"]
    assert stored_doubts(g.mean + np.float32(0.1), g.quat_wxyz, avatar, "a.ply") == []  # said of positions


def cut(clip: Clip, rows: Any) -> Clip:
    names = ("expression_weights", "late_weights", "joint_delta", "world_from_avatar")
    return replace(clip, **{name: getattr(clip, name)[rows] for name in names})


def test_gaps(body_avatar: Avatar) -> None:
    clip = body_avatar.clips[0]
    assert (gaps.jumps(clip), gaps.even_run(clip)) == (None, None)
    assert gaps.jumps(cut(clip, np.delete(np.arange(clip.frames), slice(15, 28)))) == 14
    weight = np.sin(np.arange(90) / 5)[:, None].astype(np.float32)
    moved = replace(cut(clip, np.zeros(90, np.int64)), expression_weights=weight)
    assert gaps.even_run(moved) is None
    weight[32:44] = np.linspace(weight[31], weight[44], 14)[1:-1]
    assert gaps.even_run(moved) == 31


def test_images_that_are_missing(sample_splatting_head: Path, tmp_path: Path) -> None:
    """Numbers of files tell, even where the motion does not; every second image is a choice."""
    document = json.loads((sample_splatting_head / "flame_params.json").read_text())
    file, frames = tmp_path / "flame_params.json", document["frames"]
    for kept, missing in ((frames, None), (frames[::2], None), (frames[:20] + frames[40:], (20, 41))):
        file.write_text(json.dumps(document | {"frames": kept}))
        assert read_poses(file).missing == missing
