"""One avatar on the GPU up to stage project: static buffers uploaded once, a small pose a frame, kernels by chunk."""

from __future__ import annotations

from typing import Any

import numpy as np

from avatar_runtime.avatar import F32, F64, Avatar, Group, SparseRows
from avatar_runtime.backends.gl.gpu import Gpu
from avatar_runtime.backends.gl.layout import (
    FLOAT4,
    PROJECTED_PLANES,
    SPLAT_PLANES,
    WORD,
    Run,
    gaussian_runs,
    pack,
    pack_bind,
    pack_blend,
    pack_embedded,
    pose_sections,
)
from avatar_runtime.backends.gl.mesh import Mesh, Turns, run_all
from avatar_runtime.backends.gl.programs import Dispatch, Programs, Values
from avatar_runtime.backends.gl.steps import Steps
from avatar_runtime.camera import Camera
from avatar_runtime.posed import Posed
from avatar_runtime.rotation import quat_from_matrix
from avatar_runtime.rules import RIGGED_ROTATIONS, code
from avatar_runtime.stages.groups import GroupTransforms
from avatar_runtime.stages.surface import Surface, prepare
from avatar_schema import constants

NO_WORLD = {f"world_row{i}": np.eye(4, dtype=np.float32)[i] for i in range(3)} | {
    "world_quat_wxyz": (1, 0, 0, 0)
}
NO_CAMERA: dict[str, Any] = {
    **{name: np.zeros(4) for name in ("camera_row0", "camera_row1", "camera_row2", "eye")},
    **{f"clip_row{i}": np.zeros(4) for i in range(4)},
    "tan_half_fov": np.ones(2),
    "image_size": np.ones(2),
}


class Chunk:
    """A run of Gaussians: its buffers, and the kernels that go over it."""

    def __init__(self, deformer: Deformer, run: Run) -> None:
        gpu, avatar, programs = deformer.gpu, deformer.avatar, deformer.programs
        g = avatar.gaussians
        self.run = run
        self.splats = gpu.buffer("Splats", FLOAT4 * SPLAT_PLANES * run.count)
        self.sh = gpu.buffer("Sh", WORD * 3 * g.sh.shape[1] * run.count)
        self.projected = gpu.buffer("Projected", FLOAT4 * PROJECTED_PLANES * run.count)
        blended = pack_blend(avatar, run)
        buffers = {
            "Pose": deformer.pose,
            "Splats": self.splats,
            "Sh": self.sh,
            "Projected": self.projected,
            "BlendStatic": gpu.buffer("BlendStatic", blended.words),
        }
        values = {"count": run.count, "sh_terms": g.sh.shape[1], "sh_degree": avatar.sh_degree, **deformer.at}
        settings = {"near_z": avatar.raster.near, "low_pass": avatar.raster.low_pass, **NO_CAMERA}
        self.blend = programs.dispatch("blend", run.count, buffers, {**values, **blended.offsets})
        self.activate = programs.dispatch("activate", run.count, buffers, values)
        self.project = programs.dispatch("project", run.count, buffers, values | settings)
        self.bind: list[tuple[int | None, Dispatch]]  # with the group whose transform the kernel uses
        if deformer.surface is not None:
            self.bind = [(None, deformer.on_surface(run, buffers, values))]
        else:
            self.bind = deformer.on_joints(run, buffers, values)


class Deformer:
    """One avatar's chunks and mesh."""

    def __init__(self, gpu: Gpu, programs: Programs, avatar: Avatar) -> None:
        """Uploads what no pose changes. Raises AvatarError for a part that exceeds the buffer limit."""
        self.gpu, self.programs, self.avatar = gpu, programs, avatar
        e = avatar.embedding
        self.surface: Surface | None = None
        if e is not None:
            self.surface = prepare(e, avatar.rules, avatar.training_per_bundle)
        joints = 0 if avatar.rig is None else avatar.rig.joint_count
        self._features = avatar.blendshapes.correctives.columns
        still = pack(
            pose_sections(
                np.zeros(len(avatar.expressions), np.float32),
                np.zeros(self._features, np.float32),
                np.zeros(len(avatar.late_morph_names), np.float32),
                np.zeros((joints, 4, 4), np.float32),
            )
        )
        self.at: Values = still.offsets
        self.pose = gpu.buffer("Pose", still.words)
        self._pose_words = len(still.words)
        vertices = 0 if avatar.rig is None else len(avatar.rig.vertices)
        if e is not None:
            vertices = len(e.canonical_vertices)
        self.mesh = Mesh(gpu, programs, avatar, vertices, self.pose, self.at)
        self.turns: Turns | None = None
        if self.surface is not None:
            skin = SparseRows.empty(0, joints, {"weight": ()})
            if avatar.rig is not None and avatar.rules.rotation in RIGGED_ROTATIONS:
                skin = avatar.rig.skin
            self.turns = Turns(gpu, programs, self.surface, self.mesh, skin)
        self.chunks = [Chunk(self, run) for run in gaussian_runs(avatar, gpu.limit)]

    def deform(self, posed: Posed, steps: Steps) -> None:
        """Stages up to activate; their outputs stay on the GPU."""
        self.set_pose(posed)
        steps.run("blend", self.blend)
        if self.surface is not None:
            if posed.vertices is not None:
                self.mesh.upload(posed.vertices)
            elif self.avatar.rig is not None:
                self.pose_mesh(steps)
            else:
                self.mesh.upload(self.surface.embedding.canonical_vertices)
        steps.run("bind", self.bind)
        steps.run("activate", self.activate)

    def pose_mesh(self, steps: Steps) -> None:
        """Stages morph and skin."""
        steps.run("morph", self.mesh.morph)
        steps.run("skin", self.mesh.skin)

    def set_pose(self, posed: Posed) -> None:
        """Uploads the inputs of this frame: weights, joint matrices, group transforms, world."""
        self.set_weights(
            expression_weights=posed.expression_weights,
            pose_feature=posed.pose_feature,
            late_weights=posed.late_weights,
            skin_matrix=posed.skin_matrix,
        )
        self.set_transforms(posed.groups, posed.world_from_avatar)

    def set_weights(self, **given: F32) -> None:
        """The Pose buffer; values that are not given are 0."""
        joints = 0 if self.avatar.rig is None else self.avatar.rig.joint_count
        sections = pose_sections(
            given.get("expression_weights", np.zeros(len(self.avatar.expressions), np.float32)),
            given.get("pose_feature", np.zeros(self._features, np.float32)),
            given.get("late_weights", np.zeros(len(self.avatar.late_morph_names), np.float32)),
            given.get("skin_matrix", np.zeros((joints, 4, 4), np.float32)),
        )
        if self._pose_words:
            self.pose.write(pack(sections).words.tobytes())

    def set_transforms(self, groups: GroupTransforms, world_from_avatar: F64) -> None:
        """Uploads the transforms of the groups and of the whole avatar."""
        world = world_from_avatar.astype(np.float32)
        placed: dict[str, Any] = {f"world_row{i}": world[i] for i in range(3)}
        placed["world_quat_wxyz"] = quat_from_matrix(world[:3, :3])
        rotation = np.zeros((len(groups.rotation), 3, 4), np.float32)
        rotation[:, :, :3] = groups.rotation
        for chunk in self.chunks:
            for group, kernel in chunk.bind:
                rows = {}
                if group is not None:
                    for i in range(3):
                        rows[f"group_matrix_row{i}"] = groups.matrix[group, i]
                        rows[f"group_rotation_row{i}"] = rotation[group, i]
                kernel.constants.set(placed | rows)

    def blend(self) -> None:
        """Stage blend."""
        run_all(self.gpu, (chunk.blend for chunk in self.chunks))

    def bind(self) -> None:
        """Stage bind; embedded Gaussians read the mesh that the buffer holds."""
        if self.turns is not None:
            self.turns.run()
        run_all(self.gpu, (kernel for chunk in self.chunks for _, kernel in chunk.bind))

    def activate(self) -> None:
        """Stage activate."""
        run_all(self.gpu, (chunk.activate for chunk in self.chunks))

    def project(self, camera: Camera) -> None:
        """Stage project."""
        seen = {
            **{f"camera_row{i}": camera.camera_from_world[i] for i in range(3)},
            **{f"clip_row{i}": camera.clip_from_world[i] for i in range(4)},
            "eye": np.append(camera.centre, np.float32(1)),
            "tan_half_fov": (camera.tan_half_fov_x, camera.tan_half_fov_y),
            "image_size": (camera.width, camera.height),
        }
        for chunk in self.chunks:
            chunk.project.constants.set(seen)
        run_all(self.gpu, (chunk.project for chunk in self.chunks))

    def on_surface(self, run: Run, buffers: dict[str, Any], values: Values) -> Dispatch:
        """Kernel bind_surface of one chunk."""
        surface, turns = self.surface, self.turns
        assert surface is not None and turns is not None
        packed, unit = pack_embedded(surface, run), surface.training_per_bundle
        return self.programs.dispatch(
            "bind_surface",
            run.count,
            {
                **buffers,
                "EmbedStatic": self.gpu.buffer("EmbedStatic", packed.words),
                "Mesh": self.mesh.buffer,
                "Triangles": turns.triangles,
            },
            {
                **values,
                **packed.offsets,
                **NO_WORLD,
                "vertices": self.mesh.count,
                "triangles": len(surface.embedding.triangles),
                "position_rule": code("position", surface.rules.position),
                "rotation_rule": code("rotation", surface.rules.rotation),
                "scale_rule": code("scale", surface.rules.scale),
                "sh_direction": code("sh_direction", surface.rules.sh_direction),
                "area_damping": constants()["area_damping"] / unit**2,
                "log_training_per_bundle": np.log(unit),
            },
        )

    def on_joints(
        self, run: Run, buffers: dict[str, Any], values: Values
    ) -> list[tuple[int | None, Dispatch]]:
        """Kernel bind_skin of one chunk, once for each group that has rows in it."""
        packed, rules = pack_bind(self.avatar, run), self.avatar.rules
        static = self.gpu.buffer("BindStatic", packed.words)
        made: list[tuple[int | None, Dispatch]] = []
        for index, group in enumerate(self.avatar.groups):
            first, rows = overlap(group, run)
            if rows == 0:
                continue
            own = {
                "first": first,
                "rows": rows,
                "binding_rule": code("binding", group.binding),
                "rotation_rule": code("rotation", rules.rotation),
                "sh_direction": code("sh_direction", rules.sh_direction),
                "unused": 0,
                **{f"group_{what}_row{i}": np.zeros(4) for what in ("matrix", "rotation") for i in range(3)},
            }
            kernel = self.programs.dispatch(
                "bind_skin",
                rows,
                {**buffers, "BindStatic": static},
                {**values, **packed.offsets, **NO_WORLD, **own},
            )
            made.append((index, kernel))
        return made


def overlap(group: Group, run: Run) -> tuple[int, int]:
    """(first, count) of a group's rows inside a chunk, counted from the chunk's first."""
    first = max(group.first, run.first)
    end = min(group.first + group.count, run.first + run.count)
    return first - run.first, max(end - first, 0)
