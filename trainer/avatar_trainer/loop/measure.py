"""The measures of a run; where poses were refined, those of the frames that are held out twice: tracked and refined."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from avatar_trainer.captures.model import Capture, Frame
from avatar_trainer.captures.targets import Targets
from avatar_trainer.evaluation.evaluate import evaluate
from avatar_trainer.evaluation.lpips import Lpips
from avatar_trainer.loop import run
from avatar_trainer.loop.refine import Refinement
from avatar_trainer.systems.drawing import DRAWING, Drawing
from avatar_trainer.systems.protocol import System

AS_TRACKED = "test as tracked"
HOW = (
    "; poses and expressions were refined: of train while it was trained, of test by the trained avatar, whose "
    "Gaussians never saw these images; test as tracked: without"
)


def measure(
    out: Path,
    iteration: int,
    system: System,
    refinement: Refinement | None,
    by: Drawing = DRAWING,
    lpips: Lpips | None = None,
) -> dict[str, Any]:
    """As `evaluation.evaluate`, written to evaluation.json of the run `out`; refined poses to poses.json."""
    capture = system.capture
    if refinement is None:
        result = evaluate(system, capture, by, lpips)
    else:
        with Targets(0) as targets:
            test = refinement.held_out(system, capture.test, targets, by)
        result = evaluate(system, replace(capture, frames=(*capture.train, *test)), by, lpips)
        if test:
            tracked = evaluate(system, replace(capture, frames=capture.test), by, lpips)
            means = {"test": result["splits"].pop("test"), AS_TRACKED: tracked["splits"]["test"]}
            result["splits"] = {**means, **result["splits"]}
            result["frames"] += [{**score, "split": AS_TRACKED} for score in tracked["frames"]]
        result["how"] += HOW
        run.write(out, poses(capture, [*capture.train, *test]), run.POSES)
    run.write(out, {"iteration": iteration, **result}, run.EVALUATION)
    return result


def poses(capture: Capture, frames: Sequence[Frame]) -> dict[str, Any]:
    """Frames by name, in the words of capture.json; its `camera` is without K, which stays."""
    return {
        "expressions": capture.expression_names,
        "eyelids": capture.eyelids,
        "frames": [_pose(frame, capture.rig.joint_names) for frame in frames],
    }


def _pose(frame: Frame, joints: Sequence[str]) -> dict[str, Any]:
    view, pose = frame.camera.camera_from_world, frame.pose
    turned = zip(joints, pose.joint_delta, strict=True)
    return {
        "name": frame.name,
        "split": frame.split,
        "camera": {"R": view[:3, :3].tolist(), "t": view[:3, 3].tolist()},
        "expression": pose.expression_weights.tolist(),
        "eyelids": pose.late_weights.tolist(),
        "joints": {joint: delta.ravel().tolist() for joint, delta in turned},
        "world_from_avatar": pose.world_from_avatar.ravel().tolist(),
    }
