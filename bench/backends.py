"""The same animated frame on every backend, interleaved in one run: milliseconds a stage, a frame, and ratios."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np

from avatar_export.images import frame_camera, robust_box
from avatar_export.relight import relightable
from avatar_runtime.avatar import Avatar, Blendshapes, Gaussians, Group, SparseRows
from avatar_runtime.bundle import load
from avatar_runtime.camera import Camera
from avatar_runtime.light import DirectLight, Light, even
from avatar_runtime.player import Player
from avatar_runtime.pose import Pose, joint_rotation
from avatar_runtime.posed import Clock

Row = tuple[str, float, str]
BACKENDS = {  # name in the rows: (backend, options, raster profile)
    "reference": ("reference", {}, "trainer"),
    "cpu_1_thread": ("cpu", {"threads": 1}, "trainer"),
    "cpu_2_threads": ("cpu", {"threads": 2}, "trainer"),
    "gl": ("gl", {"timed": True}, "engine"),
}
ROUNDS = 9
SLOW = {"reference": 3}  # rounds of what takes a second a frame
SIZE = 512
SAMPLES = Path(__file__).parents[1] / "samples" / "trained"
HEADS = ("head_blendshapes", "head_splatting", "head_points")
TO_BIND = ("joints", "morph", "skin", "blend", "bind", "activate")
STATIC = 1_000_000


@dataclass
class Measured:
    """The rounds of one backend."""

    wall: list[float] = field(default_factory=list)
    cpu: list[float] = field(default_factory=list)
    stages: list[dict[str, float]] = field(default_factory=list)
    stages_cpu: list[dict[str, float]] = field(default_factory=list)

    def rows(self, name: str) -> list[Row]:
        """Medians of each stage, and of all up to bind: wall and CPU time."""
        found: list[Row] = []
        for suffix, rounds in (("", self.stages), ("_cpu", self.stages_cpu)):
            for row, names in (("joints_to_bind", TO_BIND), *((stage, (stage,)) for stage in rounds[0])):
                sums = [sum(stages.get(one, 0.0) for one in names) for stages in rounds]
                found.append((f"{name}_{row}{suffix}", statistics.median(sums), "ms"))
        return found


@contextmanager
def cpu_of_stages() -> Iterator[dict[str, float]]:
    """CPU milliseconds of each stage that is timed in the block, of all threads of this process."""
    spent: dict[str, float] = {}
    timed = Clock.timed

    def noted(clock: Clock, stage: str, run: Callable[[], Any]) -> Any:
        before = time.process_time()
        result = timed(clock, stage, run)
        spent[stage] = spent.get(stage, 0.0) + 1e3 * (time.process_time() - before)
        return result

    with patch.object(Clock, "timed", noted):
        yield spent


def busy_pose(avatar: Avatar, seed: int) -> Pose:
    """Every expression and every joint at work, so that no sparse row is skipped."""
    rng = np.random.default_rng(seed)
    joints = avatar.rig.joint_names if avatar.rig else ()
    return Pose(
        {
            name: float(w)
            for name, w in zip(avatar.expression_names, rng.uniform(0.05, 0.4, 999), strict=False)
        },
        {name: joint_rotation(rng.normal(0, 0.05, 3)) for name in joints},
        {name: 0.3 for name in avatar.eyelids},
    )


def backend_rows(avatar: Avatar, names: tuple[str, ...] = tuple(BACKENDS)) -> list[Row]:
    """Frames of `avatar` at 512x512 on each backend, one after the other in every round."""
    camera = frame_camera(robust_box(avatar.gaussians.mean), SIZE, SIZE)
    players = {name: Player(avatar, BACKENDS[name][0], **BACKENDS[name][1]) for name in names}
    measured = {name: Measured() for name in names}
    evaluations: dict[str, float] = {}
    for index in range(-1, ROUNDS):  # the first round compiles and fills caches
        pose = busy_pose(avatar, index + 1)
        for name, player in players.items():
            if index >= SLOW.get(name, ROUNDS):
                continue
            _frame(
                player,
                pose,
                camera,
                BACKENDS[name][2],
                measured[name] if index >= 0 else Measured(),
                evaluations,
            )
    rows: list[Row] = []
    for name, m in measured.items():
        rows += [(f"{name}_frame_wall", statistics.median(m.wall), "ms")]
        rows += [(f"{name}_frame_cpu", statistics.median(m.cpu), "ms")]
        rows += m.rows(name)
    for name in names:
        if name != "reference" and "reference" in names:
            ratio = statistics.median(measured["reference"].wall) / statistics.median(measured[name].wall)
            rows.append((f"{name}_times_as_fast_as_reference", ratio, "1"))
    return rows + [(f"{name}_evaluations_per_pixel", value, "1") for name, value in evaluations.items()]


def _frame(
    player: Player, pose: Pose, camera: Camera, profile: str, into: Measured, evaluations: dict[str, float]
) -> None:
    wall, cpu = time.perf_counter(), time.process_time()
    with cpu_of_stages() as stages:
        frame = player.frame(pose, camera, profile=profile)
    into.wall.append(1e3 * (time.perf_counter() - wall))
    into.cpu.append(1e3 * (time.process_time() - cpu))
    into.stages.append(dict(frame.milliseconds))
    into.stages_cpu.append(stages)
    if frame.image.evaluations is not None:
        backend = type(player.backend).__name__
        evaluations[f"{backend}_{profile}"] = frame.image.evaluations / SIZE**2


def lit_rows() -> list[Row]:
    """What stages light and shadow cost of a frame of the sample heads: CPU ms, and the share of one light alone."""
    rows: list[Row] = []
    for head in HEADS:
        avatar = relightable(load(SAMPLES / head))
        camera = frame_camera(robust_box(avatar.gaussians.mean), SIZE, SIZE)
        for of in ("cpu_1_thread", "gl"):
            backend, options, profile = BACKENDS[of]
            for name, shadow in (("lit", False), ("shadowed", True)):
                light = Light(even((0.3, 0.3, 0.3)), (DirectLight((1, 1, 1), (1, 1, 1)),), shadow)
                measured = Measured()
                with Player(avatar, backend, light=light, **options) as player:
                    for index in range(-1, ROUNDS):
                        into = measured if index >= 0 else Measured()
                        _frame(player, busy_pose(avatar, index + 1), camera, profile, into, {})
                prefix, stage = f"{head}_{of}_{name}", "shadow" if shadow else "light"
                rows += [row for row in measured.rows(prefix) if row[0] == f"{prefix}_{stage}_cpu"]
                if not shadow:
                    shares = (
                        s[stage] / all_ for s, all_ in zip(measured.stages_cpu, measured.cpu, strict=True)
                    )
                    rows.append((f"{prefix}_share_of_frame_cpu", statistics.median(shares), "1"))
    return rows


def dense_rows(avatar: Avatar) -> list[Row]:
    """Up to bind where expressions change SH and opacity too, which the sample's do not."""
    filled = with_sh_deltas(avatar)
    camera = frame_camera(robust_box(avatar.gaussians.mean), SIZE, SIZE)
    rows: list[Row] = []
    for name, of in (("cpu_1", "cpu_1_thread"), ("cpu_2", "cpu_2_threads"), ("gl", "gl")):
        backend, options, profile = BACKENDS[of]
        player, measured = Player(filled, backend, **options), Measured()
        for index in range(-1, ROUNDS):
            into = measured if index >= 0 else Measured()
            _frame(player, busy_pose(avatar, index + 1), camera, profile, into, {})
        rows += [row for row in measured.rows(f"{name}_sh_deltas") if "joints_to_bind" in row[0]]
    return rows


def with_sh_deltas(avatar: Avatar) -> Avatar:
    """The avatar with small random deltas of SH and opacity at every entry of its sparse appearance."""
    rng = np.random.default_rng(0)
    appearance = avatar.blendshapes.appearance
    values = {
        name: value if name == "log_scale" else rng.normal(0, 0.01, value.shape).astype(np.float32)
        for name, value in appearance.values.items()
    }
    shapes = replace(avatar.blendshapes, appearance=replace(appearance, values=values))
    return replace(avatar, blendshapes=shapes)


def static_rows(avatar: Avatar, count: int = STATIC) -> list[Row]:
    """CPU milliseconds of a still image of `count` Gaussians, made by scattering the avatar's own."""
    still = scattered(avatar, count)
    camera = frame_camera(robust_box(avatar.gaussians.mean), SIZE, SIZE)
    player = Player(still, "cpu", threads=1)
    times = [cpu_milliseconds(lambda: player.frame(Pose(), camera)) for _ in range(4)][1:]
    return [(f"cpu_static_{count}_frame_cpu", statistics.median(times), "ms")]


def cpu_milliseconds(run: Callable[[], object]) -> float:
    """CPU time of one call."""
    before = time.process_time()
    run()
    return 1e3 * (time.process_time() - before)


def scattered(avatar: Avatar, count: int) -> Avatar:
    """`count` Gaussians without rig or shapes: jittered copies, the smaller the more."""
    rng = np.random.default_rng(0)
    g = avatar.gaussians
    at = rng.integers(0, g.count, count)
    finer = np.float32(np.log(g.count / count) / 3)
    jitter = rng.normal(0, 1, (count, 3)).astype(np.float32) * np.exp(g.log_scale[at])
    gaussians = Gaussians(
        g.mean[at] + jitter, g.log_scale[at] + finer, g.quat_wxyz[at], g.opacity_logit[at], g.sh[at]
    )
    terms = g.sh.shape[1]
    shapes = Blendshapes(
        SparseRows.empty(count, 0, {"mean": (3,), "quat_wxyz": (4,)}),
        SparseRows.empty(count, 0, {"log_scale": (3,), "opacity_logit": (), "sh": (terms, 3)}),
        SparseRows.empty(count, 0, {"mean": (3,)}),
        SparseRows.empty(count, 0, {"mean": (3,)}),
    )
    return replace(
        avatar,
        gaussians=gaussians,
        groups=(Group("all", 0, count, "none"),),
        expressions=(),
        eyelids=(),
        blendshapes=shapes,
        skin=SparseRows.empty(count, 0, {"weight": ()}),
        rig=None,
        embedding=None,
        clips=(),
    )
