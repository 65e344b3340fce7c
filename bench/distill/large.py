"""70,000 Gaussians, 300 frames, 100 drivers: how long a distillation takes, and how much memory."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from avatar_export.distill.drivers import FILE as DRIVERS
from avatar_export.distill.drivers import Drivers, write
from avatar_export.distill.dumps.folder import FRAMES, Encoding, frame_name, write_document
from avatar_runtime.avatar import Gaussians
from avatar_runtime.codec import ply
from avatar_runtime.rotation import (
    homogeneous,
    matrix_from_rotvec,
    quat_from_matrix,
    quat_multiply,
    translation_matrix,
)

GAUSSIANS, FRAME_COUNT, DRIVER_COUNT = 70_000, 300, 100
JOINTS = ("root", "neck", "jaw", "left_eye", "right_eye")
PROGRAM = """
import resource, sys, time
from pathlib import Path
from avatar_export.distill import make
result = make.distill(Path(sys.argv[1]), accept_error=True)
print(f"distill_{result.form}_rms {result.errors.rms} mm")
print(f"distill_{result.form}_held_out {result.errors.decibels} dB")
print(f"distill_large_cpu {time.process_time()} s")
print(f"distill_large_peak_rss {resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e3} MB")
"""


def write_large(
    folder: Path, gaussians: int = GAUSSIANS, frames: int = FRAME_COUNT, drivers: int = DRIVER_COUNT
) -> None:
    """Dumps of a head-sized ball with five joints and sparse drivers."""
    rng = np.random.default_rng(1)
    (folder / FRAMES).mkdir(parents=True)
    point = rng.normal(size=(gaussians, 3))
    point *= 0.12 / np.linalg.norm(point, axis=1, keepdims=True)
    centre = rng.normal(size=(drivers, 3))
    centre *= 0.12 / np.linalg.norm(centre, axis=1, keepdims=True)
    push = rng.normal(0, 0.01, (drivers, 3))
    rest = translation_matrix(
        np.array([[0, -0.2, 0], [0, -0.1, 0], [0, -0.03, 0.02], [0.03, 0.03, 0.1], [-0.03, 0.03, 0.1]])
    )
    parents = np.array([-1, 0, 1, 1, 1])
    weight = _weights(point)
    base = Gaussians(
        point.astype(np.float32),
        rng.normal(-6, 0.3, (gaussians, 3)).astype(np.float32),
        rng.normal(size=(gaussians, 4)).astype(np.float32),
        rng.normal(1, 1, gaussians).astype(np.float32),
        rng.normal(0, 1, (gaussians, 1, 3)).astype(np.float32),
    )
    values = rng.uniform(0, 1, (frames, drivers)) * (rng.uniform(0, 1, (frames, drivers)) < 0.2)
    near = np.exp(-np.square(point[:, None] - centre).sum(axis=2) / 2e-3)  # [N, D]
    world = np.empty((frames, len(JOINTS), 4, 4))
    for frame in range(frames):
        turn = homogeneous(
            matrix_from_rotvec(rng.normal(0, 0.1, (len(JOINTS), 3)) * [[0], [1], [1], [1], [1]])
        )
        for joint, parent in enumerate(parents):
            local = rest[joint] if parent < 0 else np.linalg.inv(rest[parent]) @ rest[joint]
            world[frame, joint] = (np.eye(4) if parent < 0 else world[frame, parent]) @ local @ turn[joint]
        skin = np.einsum("nj,jab->nab", weight, world[frame] @ np.linalg.inv(rest))
        moved = point + (near * values[frame]) @ push
        mean = np.einsum("nab,nb->na", skin[:, :3, :3], moved) + skin[:, :3, 3]
        u, _, vt = np.linalg.svd(skin[:, :3, :3])
        quat = quat_multiply(quat_from_matrix(u @ vt), base.quat_wxyz)
        posed = Gaussians(
            mean.astype(np.float32), base.log_scale, quat.astype(np.float32), base.opacity_logit, base.sh
        )
        (folder / FRAMES / frame_name(frame)).write_bytes(ply.encode(posed))
    take = (np.arange(frames) >= frames * 5 // 6).astype(np.int64)
    names = tuple(f"driver_{k:02d}" for k in range(drivers))
    write(Drivers(JOINTS, parents, rest, world, names, values, take), folder / DRIVERS, force=False)
    write_document(folder, "large", Encoding())


def _weights(point: np.ndarray) -> np.ndarray:
    """[N, 5] smooth weights by place."""
    y, z = point[:, 1], point[:, 2]
    root = np.clip((-0.06 - y) / 0.06, 0, 1)
    jaw = np.clip((z - 0.04) / 0.05, 0, 1) * np.clip((0.0 - y) / 0.05, 0, 1) * (1 - root)
    left = ((z > 0.1) & (y > 0.02) & (point[:, 0] > 0.01)) * (1 - root - jaw)
    right = ((z > 0.1) & (y > 0.02) & (point[:, 0] < -0.01)) * (1 - root - jaw)
    return np.stack([root, 1 - root - jaw - left - right, jaw, left, right], axis=1)


def large() -> None:
    """Make the dumps, distil them in a process of their own, and print its time and memory."""
    print(f"large: {GAUSSIANS:,} Gaussians, {FRAME_COUNT} frames, {DRIVER_COUNT} drivers", flush=True)
    for name, value, unit in large_rows():
        print(f"  {name:40s} {value:10.4g} {unit}")


def large_rows() -> list[tuple[str, float, str]]:
    """The rows of `make bench`: what is left on held-out frames, CPU time and peak memory."""
    with TemporaryDirectory() as folder:
        dumps = Path(folder) / "dumps"
        write_large(dumps)
        command = [sys.executable, "-c", PROGRAM, str(dumps)]
        printed = subprocess.run(command, check=True, stdout=subprocess.PIPE, text=True).stdout
    lines = [line.split() for line in printed.splitlines() if line.startswith("distill_")]
    return [(name, float(value), unit) for name, value, unit in lines]
