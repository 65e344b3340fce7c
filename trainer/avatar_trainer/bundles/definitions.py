"""The trainer's torch definitions of the stages, under the runtime's names: they make the vectors of `reference/`.

Training itself runs the kernels of `kernels/` and rasteriser `cpu`; tests compare each with these definitions. The
images in `reference/` come from elsewhere: `bundles.export.image` draws the live model with rasteriser `cpu`.
Nothing here imports a kernel or an array builder of the runtime's backend `cpu`, so `conform --backend cpu` never
compares code with itself; a test walks the imports.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt
import torch
from torch import Tensor

from avatar_runtime import Avatar, Camera, SparseRows
from avatar_runtime import rules as runtime_rules
from avatar_runtime.backends import Arrays, make_backend
from avatar_runtime.stages import project as runtime_project
from avatar_trainer.raster.definition import raster
from avatar_trainer.stages.activate import activate
from avatar_trainer.stages.bind import bind_skin, place
from avatar_trainer.stages.blend import Deltas, blend
from avatar_trainer.stages.morph import morph
from avatar_trainer.stages.project import Projected, project
from avatar_trainer.stages.rig import RigTensors
from avatar_trainer.stages.rotation import polar
from avatar_trainer.stages.skin import skin
from avatar_trainer.stages.sort import sort
from avatar_trainer.stages.sparse import Entries, combine, gather
from avatar_trainer.stages.surface import SurfaceMesh, embed, pose_mesh, surface_mesh
from avatar_trainer.tensors import Gaussians, Splats

Array = npt.NDArray[Any]


class TrainerStages:
    """`avatar_runtime.backends.Stages` of one avatar, by the torch definitions in `stages/` and `raster/`, in float32.

    Raster profile `engine` comes from the runtime's NumPy backend `reference`, since no trainer has that profile.
    """

    def __init__(self, avatar: Avatar) -> None:
        self.avatar = avatar

    @torch.no_grad()
    def stage(self, name: str, inputs: Arrays, camera: Camera | None, profile: str) -> dict[str, Any]:
        """One stage alone. Raises ValueError for a rule that is not trained."""
        if profile == "engine":
            return make_backend("reference", self.avatar).stage(name, inputs, camera, profile)
        given = {key: tensor(value) for key, value in inputs.items()}
        return {key: value.numpy() for key, value in RUN[name](self, given, camera).items()}

    @cached_property
    def rig(self) -> RigTensors:
        """The avatar's rig."""
        assert self.avatar.rig is not None
        return RigTensors.of(self.avatar.rig)

    @cached_property
    def mesh(self) -> SurfaceMesh:
        """The mesh that the avatar is embedded in."""
        embedding = self.avatar.embedding
        assert embedding is not None
        units = self.avatar.training_per_bundle
        return surface_mesh(embedding.canonical_vertices, embedding.triangles, units)

    @cached_property
    def base(self) -> Gaussians:
        """The Gaussians as stored."""
        g = self.avatar.gaussians
        return Gaussians(*map(tensor, (g.mean, g.log_scale, g.quat_wxyz, g.opacity_logit, g.sh)))

    @cached_property
    def deltas(self) -> Deltas:
        """Both patterns of the avatar's blendshapes as one: an entry of either has zeros for the other's values."""
        shapes = self.avatar.blendshapes
        patterns = (shapes.geometry, shapes.appearance)
        rows = np.concatenate([_row_of(pattern) for pattern in patterns])
        order = np.argsort(rows, kind="stable")
        columns = np.concatenate([pattern.column for pattern in patterns])

        def joined(name: str) -> Tensor:
            shape = next(p.values[name].shape[1:] for p in patterns if name in p.values)
            parts = [p.values.get(name, np.zeros((p.entries, *shape), np.float32)) for p in patterns]
            return tensor(np.concatenate(parts)[order])

        counts = np.bincount(rows, minlength=patterns[0].rows)
        ptr = np.concatenate([[0], np.cumsum(counts)])
        values = (joined(name) for name in ("mean", "quat_wxyz", "log_scale", "opacity_logit", "sh"))
        return Deltas(tensor(ptr), tensor(columns[order].astype(np.int64)), *values)


def tensor(array: Array) -> Tensor:
    """`array` as a tensor of its own."""
    return torch.from_numpy(np.array(array))


def _row_of(pattern: SparseRows) -> npt.NDArray[np.int64]:
    ptr = pattern.row_ptr.astype(np.int64)
    return np.repeat(np.arange(pattern.rows), ptr[1:] - ptr[:-1])


def _morph(own: TrainerStages, x: Mapping[str, Tensor], camera: Camera | None) -> dict[str, Tensor]:
    return {"vertices": morph(own.rig, x["expression_weights"], x["pose_feature"])}


def _skin(own: TrainerStages, x: Mapping[str, Tensor], camera: Camera | None) -> dict[str, Tensor]:
    return {"posed_vertices": skin(own.rig, x["vertices"], x["skin_matrix"], x["late_weights"])}


def _blend(own: TrainerStages, x: Mapping[str, Tensor], camera: Camera | None) -> dict[str, Tensor]:
    return vars(blend(own.base, own.deltas, x["expression_weights"]))


def _bind(own: TrainerStages, x: Mapping[str, Tensor], camera: Camera | None) -> dict[str, Tensor]:
    blended = Gaussians(x["mean"], x["log_scale"], x["quat_wxyz"], own.base.opacity_logit, own.base.sh)
    bound, rotation = (_bind_surface if own.avatar.embedding is not None else _bind_groups)(own, x, blended)
    seen = own.avatar.rules.sh_direction == "inverse_rotation"
    rotation = rotation if seen else torch.eye(3).expand_as(rotation)
    bound, rotation = place(bound, rotation, x["world_from_avatar"])
    return {
        "mean": bound.mean,
        "log_scale": bound.log_scale,
        "quat_wxyz": bound.quat_wxyz,
        "sh_rotation": rotation.contiguous(),
    }


def _bind_surface(
    own: TrainerStages, x: Mapping[str, Tensor], blended: Gaussians
) -> tuple[Gaussians, Tensor]:
    embedding, rules = own.avatar.embedding, own.avatar.rules
    assert embedding is not None
    matrix: Tensor | None = None
    if rules.rotation in runtime_rules.RIGGED_ROTATIONS:
        matrix = gather(own.rig.skin, x["skin_matrix"][:, :3])
    embedded = embed(
        pose_mesh(x["posed_vertices"], own.mesh, rules, matrix),
        own.mesh,
        tensor(embedding.triangle.astype(np.int64)),
        tensor(embedding.barycentric),
        tensor(embedding.displacement),
        tensor(embedding.local_quat_wxyz),
        blended.log_scale,
        rules,
    )
    moved = Gaussians(
        embedded.mean, embedded.log_scale, embedded.quat_wxyz, blended.opacity_logit, blended.sh
    )
    return moved, embedded.rotation


def _bind_groups(own: TrainerStages, x: Mapping[str, Tensor], blended: Gaussians) -> tuple[Gaussians, Tensor]:
    """Bindings skin, anchor, joint_mix and none, group by group."""
    avatar = own.avatar
    rows = [group.count for group in avatar.groups]
    matrix = x["group_matrix"].repeat_interleave(torch.tensor(rows), dim=0)
    rotation = x["group_rotation"].repeat_interleave(torch.tensor(rows), dim=0)
    skinned = gather(Entries.of(avatar.skin, "weight", torch.float32), x["skin_matrix"][:, :3])
    for group in avatar.groups:
        if group.binding == "skin":
            part = slice(group.first, group.first + group.count)
            matrix[part] = skinned[part]
            if avatar.rules.rotation == "polar3":
                rotation[part] = polar(skinned[part, :, :3])
    shapes = avatar.blendshapes
    corrective = combine(Entries.of(shapes.correctives, "mean", torch.float32), x["pose_feature"])
    late = combine(Entries.of(shapes.late_morphs, "mean", torch.float32), x["late_weights"])
    return bind_skin(blended, matrix, rotation, corrective, late)


def _activate(own: TrainerStages, x: Mapping[str, Tensor], camera: Camera | None) -> dict[str, Tensor]:
    raw = Gaussians(own.base.mean, x["log_scale"], x["quat_wxyz"], x["opacity_logit"], own.base.sh)
    splats = activate(raw, None)
    return {"scale": splats.scale, "quat_wxyz": splats.quat_wxyz, "opacity": splats.opacity}


def _project(own: TrainerStages, x: Mapping[str, Tensor], camera: Camera | None) -> dict[str, Tensor]:
    assert camera is not None
    splats = Splats(x["mean"], x["scale"], x["quat_wxyz"], x["opacity"], x["sh"], x["sh_rotation"])
    seen = project(splats, camera, own.avatar.raster, own.avatar.sh_degree)
    return {name: getattr(seen, name) for name in ("centre", "depth", "conic", "opacity", "rgb", "radius")}


def _sort(own: TrainerStages, x: Mapping[str, Tensor], camera: Camera | None) -> dict[str, Tensor]:
    none, radius = x["depth"].new_zeros(0), x["radius"]
    return {"order": sort(Projected(none, x["depth"], none, none, none, radius, radius))}


def _raster(own: TrainerStages, x: Mapping[str, Tensor], camera: Camera | None) -> dict[str, Tensor]:
    assert camera is not None
    extent = x["radius"][:, None].numpy().astype(np.float32)
    tiles = tensor(runtime_project.touched_tiles(x["centre"].numpy(), extent, camera, runtime_project.TILE))
    tiles[x["radius"] == 0] = 0
    depth = x["radius"].new_zeros(0)
    seen = Projected(x["centre"], depth, x["conic"], x["opacity"], x["rgb"], x["radius"], tiles)
    colour, transmittance = raster(seen, seen.centre, x["order"], camera, x["background"])
    return {"colour": colour, "transmittance": transmittance}


Run = Callable[[TrainerStages, Mapping[str, Tensor], "Camera | None"], dict[str, Tensor]]
RUN: dict[str, Run] = {
    "morph": _morph,
    "skin": _skin,
    "blend": _blend,
    "bind": _bind,
    "activate": _activate,
    "project": _project,
    "sort": _sort,
    "raster": _raster,
}
