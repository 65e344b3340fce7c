"""A canonical mesh as the kernels take it: the definition's mesh, and its arrays in the runtime's layout."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from avatar_runtime import topology
from avatar_runtime.backends.cpu import Mesh, read_only
from avatar_trainer.stages.surface import SurfaceMesh


@dataclass(frozen=True)
class KernelMesh:
    """A `SurfaceMesh` and the same in arrays. Made by `kernel_mesh`."""

    definition: SurfaceMesh
    arrays: Mesh


def kernel_mesh(mesh: SurfaceMesh) -> KernelMesh:
    """The arrays of `mesh`, made once for all poses."""
    triangles = mesh.triangles.numpy().astype(np.uint32)
    lists = topology.vertex_triangles(triangles, mesh.vertices)
    parts = triangles, mesh.frame.reshape(-1, 9).numpy(), mesh.area.numpy(), *lists
    return KernelMesh(mesh, Mesh(*(read_only(part, part.dtype, part.shape) for part in parts)))
