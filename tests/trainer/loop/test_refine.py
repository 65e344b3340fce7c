"""Planted errors of tracking are mended; a run with refinement resumes bit by bit and reports both figures."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import torch
from samples.capture.head import write_head
from samples.capture.shots import Noise

from avatar_runtime import F64, Camera, posed_mesh
from avatar_runtime.io.errors import AvatarError
from avatar_runtime.stages import joints
from avatar_trainer.captures.load import load
from avatar_trainer.captures.mesh_raster import Surface, draw
from avatar_trainer.captures.model import Capture, Frame
from avatar_trainer.loop import align, checkpoint, run
from avatar_trainer.loop.measure import AS_TRACKED, measure
from avatar_trainer.loop.refine import Refinement, rounds
from avatar_trainer.loop.resume import load_run
from avatar_trainer.loop.train import train
from avatar_trainer.loop.values import Values
from avatar_trainer.settings import TrainSettings
from avatar_trainer.systems.table import SYSTEMS
from tests.measured import Measure
from tests.trainer import toy
from tests.trainer.tensors import same

OWN = toy.Settings(iterations=30)
SETTINGS = TrainSettings(iterations=30, threads=1, evaluate_every=15, checkpoint_every=10, refine="on")


@pytest.fixture(scope="module")
def head(tmp_path_factory: pytest.TempPathFactory) -> Capture:
    """The head's rig with poses and cameras; nothing looks at its tiny images."""
    folder = tmp_path_factory.mktemp("head")
    write_head(folder, 16, 12, Noise(tracking=0.005))
    return load(folder)


def painted(capture: Capture, frame: Frame) -> tuple[torch.Tensor, torch.Tensor]:
    """(image, mask) of the capture's rig with a pattern on its skin."""
    rig, pose = capture.rig, frame.pose
    posed = posed_mesh(rig, pose, joints.joints(rig, pose)).astype(np.float64)
    ones = np.ones(len(posed), np.float32)
    pattern = 0.5 + 0.4 * np.sin(rig.vertices * 160).prod(axis=1)
    surface = Surface(
        posed @ pose.world_from_avatar[:3, :3].T + pose.world_from_avatar[:3, 3],
        rig.triangles.astype(np.int64),
        np.zeros((len(rig.triangles), 3, 2), np.float32),
        np.ones((1, 1, 3), np.float32),
        pattern.astype(np.float32),
        0 * ones,
        ones,
    )
    drawn = draw(surface, frame.camera)
    return torch.from_numpy(drawn.colour * drawn.alpha[..., None]), torch.from_numpy(drawn.alpha)


def off(found: F64) -> tuple[float, float]:
    """(degrees, metres) of a change."""
    return float(np.degrees(np.linalg.norm(found[:3]))), float(np.linalg.norm(found[3:6]))


@pytest.mark.parametrize("pose_in", ["camera", "mesh"])
def test_planted_errors_are_mended(head: Capture, pose_in: str, measured: Measure) -> None:
    capture = dataclasses.replace(head, head_pose_in=pose_in)
    values = Values.of(capture)
    true = capture.train[8]
    true = dataclasses.replace(true, camera=dataclasses.replace(true.camera, width=128, height=128))
    wanted, mask = painted(capture, true)
    jaw = values.count - len(values.lids) - len(values.columns)
    jaw += values.columns.tolist().index(capture.expression_names.index("jawOpen"))
    planted = np.zeros(values.count)
    planted[:6] = *np.radians([1.2, -1.4, 0.8]), 0.004, -0.003, 0.0  # 2 degrees
    planted[jaw] = 0.2
    tracked = values.moved(true, planted)
    change = np.zeros(values.count)
    for count in range(10):
        drawn, _ = painted(capture, values.moved(tracked, change))
        change = align.better(values, tracked, change, drawn, wanted, mask, count < 3)
    degrees, metres = off(change + planted)
    measured(f"refinement, head in the {pose_in}: degrees left of 2", degrees)
    measured(f"refinement, head in the {pose_in}: jawOpen left of 0.2", abs(change[jaw] + 0.2))
    assert degrees < 0.1 and metres < 0.001 and abs(change[jaw] + 0.2) < 0.01
    assert values.moved(tracked, 0 * change) == tracked
    assert np.array_equal(values.posed(tracked.pose, change).world_from_avatar, np.eye(4)) == (
        pose_in == "camera"
    )


def test_bounds_hold_where_the_capture_keeps_them(head: Capture) -> None:
    poses = [
        dataclasses.replace(f.pose, expression_weights=np.clip(f.pose.expression_weights, 0, 1))
        for f in head.frames
    ]
    frames = [dataclasses.replace(f, pose=p) for f, p in zip(head.frames, poses, strict=True)]
    values = Values.of(dataclasses.replace(head, frames=tuple(frames)))
    first = 6 + 3 * len(values.joints)
    assert (values.low[first:] == 0).all() and (values.high[first:] == 1).all()
    assert np.isinf(values.low[:first]).all() and np.isinf(Values.of(head).low[first:]).any()
    assert tuple(values.columns) == head.columns != tuple(range(len(head.expression_names)))
    assert [head.rig.joint_names[j] for j in values.joints] == ["neck", "jaw", "leftEye", "rightEye"]


def test_it_resumes_bit_by_bit_and_reports_both_figures(
    toy_capture: Capture, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(SYSTEMS, "toy", toy.__name__)
    monkeypatch.setattr(align, "FEWEST", 1)
    monkeypatch.setattr(align, "GAIN", (0, np.inf))  # the toy does not look like its mesh
    ends = []
    for threads, name, stops in ((1, "whole", ()), (2, "cut", (14,))):
        settings = dataclasses.replace(SETTINGS, threads=threads)
        for stop in (*stops, 0):
            system = toy.create(toy_capture, OWN, 1)
            with monkeypatch.context() as patched:
                if stop:
                    patched.setattr(toy.Toy, "after_step", _stopped(stop))
                    with pytest.raises(InterruptedError):
                        train(system, toy_capture, settings, tmp_path / name, system_settings=OWN)
                    continue
                trained = train(system, toy_capture, settings, tmp_path / name, system_settings=OWN)
        found = checkpoint.newest(tmp_path / name / run.CHECKPOINTS, pytest.fail)
        assert found is not None
        ends.append({key: found.state[key] for key in ("system", "refinement", "generator")})
    assert same(*ends) and ends[0]["refinement"]["change"].abs().sum() > 0
    loaded = load_run(tmp_path / "cut")
    assert run.fingerprint(loaded.system.capture) == run.fingerprint(system.capture)
    assert run.fingerprint(system.capture) != run.fingerprint(toy_capture)
    result = measure(tmp_path / "cut", 30, system, trained.refinement)
    assert list(result["splits"]) == ["test", AS_TRACKED, "train"] and "refined" in result["how"]
    written = json.loads((tmp_path / "cut" / run.POSES).read_text())
    frame = next(f for f in system.capture.frames if f.split == "train")
    entry = next(f for f in written["frames"] if f["name"] == frame.name)
    assert np.float32(entry["expression"]).tolist() == frame.pose.expression_weights.tolist()
    assert entry["camera"]["R"] == frame.camera.camera_from_world[:3, :3].tolist()
    with pytest.raises(AvatarError, match=r"refined poses do not fit.*--no-resume"):
        Refinement(dataclasses.replace(toy_capture, frames=toy_capture.frames[:-6]), 30).load_state(
            ends[0]["refinement"]
        )


def _stopped(at: int) -> Callable[..., None]:
    plain = toy.Toy.after_step

    def after_step(self: toy.Toy, iteration: int, generator: torch.Generator) -> None:
        if iteration == at:
            raise InterruptedError
        plain(self, iteration, generator)

    return after_step


@pytest.mark.parametrize(
    ("refine", "poses", "stated"),
    [
        ("auto", "exact", None),
        ("off", "exact", None),
        ("on", "exact", "on"),
        ("auto", "estimated", "on"),
        ("off", "estimated", "off"),
    ],
)
def test_the_capture_decides_unless_the_user_does(
    toy_capture: Capture, refine: str, poses: str, stated: str | None
) -> None:
    capture = dataclasses.replace(toy_capture, poses=poses)
    settings = dataclasses.replace(SETTINGS, refine=refine)
    facts = run.facts("toy", capture, settings, OWN)
    assert facts["settings"].get("refine") == stated
    assert facts["capture"]["fingerprint"] == run.fingerprint(toy_capture)
    with pytest.raises(ValueError, match="one of auto, on, off"):
        TrainSettings(refine="yes")


def test_rounds_lie_inside_the_run() -> None:
    assert rounds(96, 1500) == frozenset({3, 4, 5, 6, 8, 9, 10, 11})
    assert len(rounds(240, 6000)) == 12
    assert rounds(300, 200) == frozenset({0})


def test_cameras_of_one_pose_share_its_values(toy_capture: Capture) -> None:
    first, second, *others = toy_capture.frames
    held_out = dataclasses.replace(others[0], pose=first.pose, split="test")
    second = dataclasses.replace(second, pose=first.pose)
    refinement = Refinement(
        dataclasses.replace(toy_capture, frames=(first, second, held_out, *others[1:])), 30
    )
    change = torch.full_like(refinement.state()["change"], 0.01)
    refinement.load_state({"change": change, "steps": refinement.state()["steps"]})
    poses = [refinement.frame(frame).pose for frame in (first, second, held_out)]
    assert poses[0] is poses[1] is poses[2] is not first.pose


def test_a_camera_with_skew_is_refused(toy_capture: Capture) -> None:
    first, *others = toy_capture.frames
    view = first.camera.camera_from_world.astype(np.float64)
    k = np.array([[50.0, 1.0, 20.0], [0.0, 50.0, 20.0], [0.0, 0.0, 1.0]])
    skewed = Camera.from_opencv(view[:3, :3], view[:3, 3], k, toy.SIZE, toy.SIZE)
    frames = (dataclasses.replace(first, camera=skewed), *others)
    with pytest.raises(AvatarError, match="camera with skew cannot be refined; --refine off"):
        Refinement(dataclasses.replace(toy_capture, frames=frames), 30)
