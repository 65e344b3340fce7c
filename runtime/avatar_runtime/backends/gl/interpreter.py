"""Plays a program on the GPU up to stage project. It knows buffers, passes and named values; no system, no rule."""

from __future__ import annotations

import re
import weakref
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from typing import Any

import moderngl
import numpy as np
import numpy.typing as npt

from avatar_runtime.avatar import F32, F64
from avatar_runtime.backends.gl.gpu import Gpu
from avatar_runtime.backends.gl.programs import Dispatch, Programs
from avatar_runtime.backends.gl.steps import Steps
from avatar_runtime.camera import Camera
from avatar_runtime.light import LightArrays
from avatar_runtime.posed import Posed
from avatar_runtime.program.model import FRAME_SOURCES, Level, Pass, Program, Run
from avatar_runtime.program.passes import PADDING
from avatar_runtime.rotation import quat_from_matrix
from avatar_runtime.stages.groups import GroupTransforms

FLOAT4 = 16  # bytes
_SOURCE = re.compile(r"(\w+)(?:\[(\d+)\])?")
Array = npt.NDArray[Any]
Frame = Mapping[str, Array]  # a name of FRAME_SOURCES -> its floats, or a table of them


@dataclass(frozen=True)
class Chunk:
    """The buffers of a run of Gaussians, for scenes and for single stages."""

    run: Run
    splats: moderngl.Buffer
    sh: moderngl.Buffer
    projected: moderngl.Buffer


class Step:
    """A pass in this context, and which of its constants change from frame to frame."""

    def __init__(self, interpreter: Interpreter, one: Pass) -> None:
        literal = {name: value for name, value in one.constants.items() if not isinstance(value, str)}
        self.sources = {
            name: _source(value) for name, value in one.constants.items() if isinstance(value, str)
        }
        still = {
            name: np.zeros(FRAME_SOURCES[source], np.float32) for name, (source, _) in self.sources.items()
        }
        buffers = {name: interpreter.buffer(buffer) for name, buffer in one.buffers.items()}
        self.dispatch: Dispatch = interpreter.programs.dispatch(
            one.entry, one.rows, buffers, {**literal, **still, PADDING: 0}
        )

    def set(self, frame: Frame) -> None:
        """The constants that `frame` holds."""
        given = {
            name: frame[source] if row is None else frame[source][row]
            for name, (source, row) in self.sources.items()
            if source in frame
        }
        if given:
            self.dispatch.constants.set(given)


def _source(value: str) -> tuple[str, int | None]:
    found = _SOURCE.fullmatch(value)
    assert found is not None, value
    return found[1], None if found[2] is None else int(found[2])


class Passes:
    """A list of passes, compiled when it first runs; a barrier lies before a pass that needs an earlier result."""

    def __init__(self, interpreter: Interpreter, passes: Sequence[Pass]) -> None:
        # No circle of references, so that what nobody uses any more is freed at once.
        self._interpreter: Interpreter = weakref.proxy(interpreter)
        self._passes = passes
        self._frame: dict[str, Array] = {}

    @cached_property
    def _steps(self) -> list[tuple[str, bool, Step]]:
        """(stage, whether a barrier comes before it, step)."""
        table, made = self._interpreter.programs.table, []
        written: set[str] = set()
        for one in self._passes:
            row = table[one.entry]
            writes = {one.buffers[item["name"]] for item in row["storage"] if not item["readonly"]}
            barrier = bool(written & set(one.buffers.values()))
            written = writes if barrier else written | writes
            step = Step(self._interpreter, one)
            step.set(self._frame)
            made.append((row["stage"], barrier, step))
        return made

    def set(self, frame: Frame) -> None:
        """New values for the passes that ask for them."""
        self._frame |= frame
        if "_steps" in self.__dict__:
            for _, _, step in self._steps:
                step.set(frame)

    def run(self, steps: Steps, stages: Iterable[str] | None = None) -> None:
        """Queues the passes, or those of some stages alone, and a barrier for whoever reads their results."""
        wanted = None if stages is None else set(stages)
        batch: list[tuple[bool, Step]] = []
        current = ""
        for stage, barrier, step in [*self._steps, ("", False, None)]:
            if stage != current:
                if batch:
                    steps.run(current, partial(self._queue, batch))
                batch, current = [], stage
            if step is not None and (wanted is None or stage in wanted):
                batch.append((barrier, step))

    def _queue(self, batch: list[tuple[bool, Step]]) -> None:
        barriers = self._interpreter.gpu.context.memory_barrier
        for barrier, step in batch:
            if barrier:
                barriers()
            step.dispatch.run()
        barriers()


class Interpreter:
    """One avatar at one level of detail in one context."""

    def __init__(self, gpu: Gpu, programs: Programs, program: Program, level: int = 0) -> None:
        """Uploads what no pose changes. Raises AvatarError for a buffer beyond the limit."""
        self.gpu, self.programs, self.program = gpu, programs, program
        self.level: Level = program.levels[level]
        self._buffers: dict[str, moderngl.Buffer] = {}
        self.mesh = Passes(self, program.mesh)
        self.deforming = Passes(self, self.level.deform)
        self.viewing = Passes(self, self.level.view)
        self.shadowing = Passes(self, self.level.shadow)
        self.lighting = Passes(self, self.level.light)
        self._light: LightArrays | None = None
        kinds = zip(
            self.level.chunks,
            *(self.level.names(kind) for kind in ("Splats", "Sh", "Projected")),
            strict=True,
        )
        self.chunks = [Chunk(run, *(self.buffer(name) for name in names)) for run, *names in kinds]
        for passes in (self.deforming, self.viewing):
            _ = passes._steps  # compiled and uploaded now, so that no frame waits

    def buffer(self, name: str) -> moderngl.Buffer:
        """A buffer of the program; made and filled when first asked for."""
        if name not in self._buffers:
            described = self.program.buffers[name]
            what = f"the mesh of {self.vertices} vertices" if name == "Mesh" else name
            content = described.content() if described.sections else described.size
            self._buffers[name] = self.gpu.buffer(what, content)
        return self._buffers[name]

    @property
    def vertices(self) -> int:
        """Vertices of the mesh; 0 if there is none."""
        return self.program.mesh[0].count("vertices") if self.program.mesh else 0

    @property
    def sh_terms(self) -> int:
        """SH coefficients a channel."""
        return self.level.deform[0].count("sh_terms")

    def deform(self, posed: Posed, steps: Steps) -> None:
        """Stages up to activate, and stage shadow; their outputs stay on the GPU."""
        self.set_pose(posed)
        if self.program.reads_mesh:
            if posed.vertices is not None:
                self.upload_mesh(posed.vertices)
            else:
                self.mesh.run(steps)
        self.deforming.run(steps)
        if self._light is not None and self._light.shadow_offset[2]:
            if not self.program.reads_mesh and any("Mesh" in one.buffers for one in self.level.shadow):
                self.mesh.run(steps)
            self.shadowing.run(steps)

    def project(self, camera: Camera, steps: Steps) -> None:
        """Stage project, and stage light where there is one."""
        seen = {
            **{f"camera_row{i}": camera.camera_from_world[i] for i in range(3)},
            **{f"clip_row{i}": camera.clip_from_world[i] for i in range(4)},
            "eye": np.append(camera.centre, np.float32(1)),
            "tan_half_fov": np.array((camera.tan_half_fov_x, camera.tan_half_fov_y)),
            "image_size": np.array((camera.width, camera.height)),
        }
        self.viewing.set(seen)
        self.viewing.run(steps)
        if self._light is not None:
            self.lighting.run(steps)

    def set_pose(self, posed: Posed) -> None:
        """Uploads the inputs of this frame: weights, joint matrices, group transforms, world."""
        self.set_weights(
            expression_weights=posed.expression_weights,
            pose_feature=posed.pose_feature,
            late_weights=posed.late_weights,
            skin_matrix=posed.skin_matrix,
        )
        self.set_transforms(posed.groups, posed.world_from_avatar)
        self.set_light(posed.light)

    def set_light(self, light: LightArrays | None) -> None:
        """The light of the scene; None: there is none."""
        self._light = light
        if light is None:
            return
        given: dict[str, Array] = {"shadow_offset": light.shadow_offset}
        for name, rows in (("ambient", light.ambient), ("place", light.place), ("colour", light.colour)):
            given |= {f"light_{name}{k}": row for k, row in enumerate(rows)}
        given |= {f"light_turn_row{k}": row for k, row in enumerate(light.turn)}
        given |= {f"shadow_row{k}": row for k, row in enumerate(light.shadow_row)}
        self.shadowing.set(given)
        self.lighting.set(given)

    def set_weights(
        self,
        expression_weights: F32 | None = None,
        pose_feature: F32 | None = None,
        late_weights: F32 | None = None,
        skin_matrix: F32 | None = None,
    ) -> None:
        """The Pose buffer; values that are not given are 0."""
        floats, at = np.zeros(self.program.pose_floats, np.float32), self.program.pose
        given = {"weights": expression_weights, "features": pose_feature, "late": late_weights}
        if skin_matrix is not None:
            given["joints"] = skin_matrix[:, :3].reshape(-1)
        for name, values in given.items():
            if values is not None:
                floats[at[name] : at[name] + len(values)] = values
        if len(floats):
            self.buffer("Pose").write(floats.tobytes())

    def set_transforms(self, groups: GroupTransforms, world_from_avatar: F64) -> None:
        """The transforms of the groups and of the whole avatar."""
        self.set_world(world_from_avatar)
        rotation = np.zeros((len(groups.rotation), 3, 4), np.float32)
        rotation[:, :, :3] = groups.rotation
        placed: dict[str, Array] = {}
        for i in range(3):
            placed[f"group_matrix_row{i}"] = groups.matrix[:, i]
            placed[f"group_rotation_row{i}"] = rotation[:, i]
        self.deforming.set(placed)

    def set_world(self, world_from_avatar: F64) -> None:
        """The transform of the whole avatar."""
        world = world_from_avatar.astype(np.float32)
        placed: dict[str, Array] = {f"world_row{i}": world[i] for i in range(3)}
        placed["world_quat_wxyz"] = quat_from_matrix(world[:3, :3])
        for passes in (self.deforming, self.shadowing, self.lighting):
            passes.set(placed)

    def upload_mesh(self, vertices: F32) -> None:
        """Positions [V, 3] in place of those that the rig makes."""
        plane = np.ones((self.vertices, 4), np.float32)
        plane[:, :3] = vertices
        self.buffer("Mesh").write(plane.tobytes())

    def download_mesh(self) -> F32:
        """Positions [V, 3]."""
        plane = np.frombuffer(self.buffer("Mesh").read(FLOAT4 * self.vertices), np.float32)
        return plane.reshape(self.vertices, 4)[:, :3].copy()
