"""What refinement of poses and expressions gains, and what it costs: the sample head, tracked with and without errors.

    python -m bench.refine [--system gaussian_blendshapes] [--iterations 1500] [--frames 120] [--size 128]

Every fifth frame is held out. Errors are those of the whole mesh in the camera's space: the turn that fits best, and
the mean distance across the line of sight; of all weights the root mean square. `tracked`: held-out frames in the poses
of the capture; `refined`: by the trained avatar. CPU seconds are of training alone.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
from samples.capture.head import write_head
from samples.capture.shots import Noise

from avatar_runtime import F64, posed_mesh
from avatar_runtime.stages import joints
from avatar_trainer.captures.load import load
from avatar_trainer.captures.model import Capture, Frame
from avatar_trainer.captures.targets import Targets
from avatar_trainer.loop.measure import AS_TRACKED, measure
from avatar_trainer.loop.train import train
from avatar_trainer.settings import TrainSettings
from avatar_trainer.systems.table import SYSTEMS, system_module

NOISE = Noise(tracking=0.03, calibration=0.005)
HELD_OUT = 5
RUNS = (("exact", "off"), ("exact", "on"), ("noisy", "off"), ("noisy", "on"))


def capture(folder: Path, size: int, frames: int, noise: Noise) -> Capture:
    """The head, every fifth frame held out."""
    write_head(folder, size, frames, noise)
    read = load(folder)
    split = ("test", *["train"] * (HELD_OUT - 1))
    return replace(
        read, frames=tuple(replace(f, split=split[(i + 2) % HELD_OUT]) for i, f in enumerate(read.frames))
    )


def errors(found: list[Frame], exact: Capture) -> tuple[float, float, float]:
    """(degrees, millimetres across the line of sight, weights) of frames against the exact ones of their names."""
    rig, true = exact.rig, {frame.name: frame for frame in exact.frames}

    def seen(frame: Frame) -> F64:
        pose = frame.pose
        view = frame.camera.camera_from_world.astype(np.float64) @ pose.world_from_avatar
        moved: F64 = posed_mesh(rig, pose, joints.joints(rig, pose)) @ view[:3, :3].T + view[:3, 3]
        return moved

    rows = []
    for frame in found:
        mine, other = seen(frame), seen(true[frame.name])
        u, _, v = np.linalg.svd((mine - mine.mean(axis=0)).T @ (other - other.mean(axis=0)))
        cosine = (np.trace(u @ np.diag([1, 1, np.linalg.det(u @ v)]) @ v) - 1) / 2
        weights = frame.pose.expression_weights - true[frame.name].pose.expression_weights
        rows.append(
            (
                np.degrees(np.arccos(np.clip(cosine, -1, 1))),
                1000 * np.linalg.norm((mine - other)[:, :2], axis=1).mean(),
                np.square(weights).mean(),
            )
        )
    degrees, millimetres, square = np.mean(rows, axis=0)
    return float(degrees), float(millimetres), float(np.sqrt(square))


def row(
    name: str,
    system: str,
    scene: Capture,
    exact: Capture,
    refine: str,
    gaussians: int,
    iterations: int,
    out: Path,
) -> str:
    """A run's line of the table."""
    module = system_module(system)
    own = replace(module.Settings(), iterations=iterations, gaussians=gaussians)
    avatar = module.create(scene, own, 0)
    began = time.process_time()
    settings = TrainSettings(iterations=iterations, refine=refine, evaluate_every=0)
    trained = train(avatar, scene, settings, out, system_settings=own, upstream=False)
    spent = time.process_time() - began
    splits = measure(out, iterations, avatar, trained.refinement)["splits"]
    tracked, refined = (splits.get(split, {}).get("psnr_inside_db") for split in (AS_TRACKED, "test"))
    cells = [f"{tracked or refined:6.2f}", f"{refined:6.2f}" if tracked else "     -"]
    frames = list(scene.test)
    if trained.refinement is not None:
        with Targets(0) as targets:
            frames = trained.refinement.held_out(avatar, frames, targets)
    for part in (list(avatar.capture.train), frames):
        cells.append("{:5.2f} {:5.2f} {:.3f}".format(*errors(part, exact)))
    return f"{name:5s} {refine:3s}  {'  '.join(cells)}  {spent:6.0f}"


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(prog="python -m bench.refine", description=__doc__)
    parser.add_argument("--system", choices=SYSTEMS, default="gaussian_blendshapes")
    parser.add_argument("--gaussians", type=int, default=8000)
    parser.add_argument("--iterations", type=int, default=1500)
    parser.add_argument("--frames", type=int, default=120)
    parser.add_argument("--size", type=int, default=128)
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        scenes = {
            name: capture(Path(folder, name), given.size, given.frames, noise)
            for name, noise in (("exact", Noise()), ("noisy", NOISE))
        }
        print("poses refine  dB inside, held out  training frames     held-out frames    CPU s")
        print("              tracked refined     deg    mm weight    deg    mm weight")
        for name, refine in RUNS:
            out = Path(folder, f"{name}_{refine}")
            line = row(
                name,
                given.system,
                scenes[name],
                scenes["exact"],
                refine,
                given.gaussians,
                given.iterations,
                out,
            )
            print(line, flush=True)


if __name__ == "__main__":
    main()
