"""The posed meshes that SplattingAvatar's Gaussians are embedded in, each posed once as long as there is room."""

from __future__ import annotations

from collections import OrderedDict

import numpy as np
import torch

from avatar_runtime import F32, PoseArrays, Rig, Rules, posed_mesh
from avatar_runtime.stages import joints
from avatar_trainer.kernels import pose_mesh_cpu
from avatar_trainer.kernels.mesh import kernel_mesh
from avatar_trainer.stages.surface import PosedMesh, SurfaceMesh

ROOM = 512 << 20  # bytes of posed meshes that are kept


def posed_vertices(rig: Rig, pose: PoseArrays) -> F32:
    """[V, 3] metres, by the runtime's stages joints, morph and skin."""
    return posed_mesh(rig, pose, joints.joints(rig, pose))


class PosedMeshes:
    """What Gaussians read of the rig's mesh in each pose; no gradient flows into a pose."""

    def __init__(self, rig: Rig, mesh: SurfaceMesh, rules: Rules) -> None:
        self._rig, self._mesh, self._rules = rig, kernel_mesh(mesh), rules
        # By the identity of the pose object, which is kept too, so that its identity is not reused.
        self._kept: OrderedDict[int, tuple[PoseArrays, PosedMesh]] = OrderedDict()
        self._bytes = 0

    def __getitem__(self, pose: PoseArrays) -> PosedMesh:
        found = self._kept.get(id(pose))
        if found is None:
            found = (pose, self.of_vertices(posed_vertices(self._rig, pose)))
            self._keep(found)
        self._kept.move_to_end(id(pose))
        return found[1]

    def of_vertices(self, vertices: F32) -> PosedMesh:
        """The mesh of posed vertices [V, 3], metres."""
        return pose_mesh_cpu(torch.from_numpy(np.ascontiguousarray(vertices)), self._mesh, self._rules)

    def _keep(self, entry: tuple[PoseArrays, PosedMesh]) -> None:
        self._kept[id(entry[0])] = entry
        self._bytes += _size(entry[1])
        while self._bytes > ROOM and len(self._kept) > 1:
            _, (_, dropped) = self._kept.popitem(last=False)
            self._bytes -= _size(dropped)


def _size(of: PosedMesh) -> int:
    return sum(t.nbytes for t in (of.vertices, of.vertex_normal, of.vertex_turn, of.area))
