"""What keeps PSAvatar together in motion that no image shows. The paper has none of it; its settings can be 0.

- Points stand off the mesh where the captured motion holds them steady. Along the normal of a closing lid or a turning
  lip, a point 50 mm off swings by as much; learned bases hide that in the trained frames alone. Of the triangles whose
  normals lead to a place, the steadiest holds it (`anchors`).
- The learned bases P' and E' follow what the captures support. Adam moves a vertex that no image explains as far as one
  that many do, each in a direction of its own, and the vertex normals then scatter whatever stands off the mesh. Bases
  are therefore smoothed over the mesh and decay.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
import torch
from torch import Tensor

from avatar_runtime import F32, F64, I64, PoseArrays, Rig, posed_mesh
from avatar_runtime.stages import joints
from avatar_trainer.kernels.smooth import Edges, smoothed
from avatar_trainer.normals import vertex_normals

NEAR = 1.5e-3  # metres off the mesh, that every point may stand: eyeballs are farther behind their lids
LOOKED_AT = 256  # poses at most
USUAL = 95.0  # percent of them
SPARE = 1.5  # times the swing of a point at the start
LEAST_TURN = 1e-6
MOST_STRETCH, LEAST_AREA = 4.0, 1e-12


class Motion(NamedTuple):
    """How far the captured poses move and turn each triangle [F] against the joint that carries it.

    That joint holds a vertex most; if it is a leaf, its parent counts: what stands before an eye or the jaw belongs to
    the head. USUAL percent of the poses stay below both numbers, at the corner that moves most.
    """

    moved: F64  # metres
    turned: F64  # length of the change of the unit normal

    def swing(self, triangle: I64, distance: npt.NDArray[np.floating]) -> F64:
        """[N] metres that points so far off these triangles are moved."""
        result: F64 = self.moved[triangle] + np.abs(distance) * self.turned[triangle]
        return result

    def limit(self, triangle: I64, distance: npt.NDArray[np.floating], swing: float) -> F32:
        """[N] metres off its triangle, up to which a point that starts at `distance` moves no further than `swing`, or
        SPARE times as far as it does at the start. At least NEAR."""
        allowed = np.maximum(swing, SPARE * self.swing(triangle, distance))
        result = (allowed - self.moved[triangle]) / np.maximum(self.turned[triangle], LEAST_TURN)
        return np.maximum(result, NEAR).astype(np.float32)


def motion(rig: Rig, poses: Sequence[PoseArrays]) -> Motion:
    """The `Motion` of a mesh in these poses, or in LOOKED_AT of them."""
    holder, rest = _holders(rig), rig.vertices.astype(np.float64)
    still = vertex_normals(rest, rig.triangles)
    moved, turned = [], []
    for pose in _looked_at(poses):
        state = joints.joints(rig, pose)
        back = np.linalg.inv(state.skin_matrix.astype(np.float64))[holder]
        vertices = posed_mesh(rig, pose, state).astype(np.float64)
        vertices = np.einsum("vij,vj->vi", back[:, :3, :3], vertices) + back[:, :3, 3]
        moved.append(np.linalg.norm(vertices - rest, axis=1))
        turned.append(np.linalg.norm(vertex_normals(vertices, rig.triangles) - still, axis=1))
    return Motion(
        *(np.percentile(part, USUAL, axis=0)[rig.triangles].max(axis=1) for part in (moved, turned))
    )


def stretch(rig: Rig, poses: Sequence[PoseArrays]) -> F64:
    """[F] by how much these poses, or LOOKED_AT of them, stretch each triangle: its largest area over that at rest.

    1 to MOST_STRETCH. Closing lids unfold; Gaussians that keep their size leave holes there if they are spread by the
    area at rest.
    """
    rest = _areas(rig.vertices, rig.triangles)
    largest = rest.copy()
    for pose in _looked_at(poses):
        largest = np.maximum(largest, _areas(posed_mesh(rig, pose, joints.joints(rig, pose)), rig.triangles))
    ratio: F64 = np.clip(largest / np.maximum(rest, LEAST_AREA), 1, MOST_STRETCH)
    return ratio


def _areas(vertices: npt.NDArray[np.floating], triangles: npt.NDArray[np.integer]) -> F64:
    """[F] twice the areas."""
    a, b, c = np.moveaxis(vertices.astype(np.float64)[triangles], 1, 0)
    area: F64 = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    return area


def _looked_at(poses: Sequence[PoseArrays]) -> list[PoseArrays]:
    """LOOKED_AT of the poses, evenly spread."""
    return [poses[k] for k in np.unique(np.linspace(0, len(poses) - 1, LOOKED_AT).round().astype(int))]


def _holders(rig: Rig) -> I64:
    """[V] the joint that holds each vertex most, or its parent if it is a leaf."""
    ptr = rig.skin.row_ptr.astype(np.int64)
    row = np.repeat(np.arange(rig.skin.rows), np.diff(ptr))
    weight = np.zeros((rig.skin.rows, rig.joint_count))
    weight[row, rig.skin.column] = rig.skin.values["weight"]
    parents = np.asarray(rig.parents, np.int64)
    leaf = ~np.isin(np.arange(len(parents)), parents) & (parents >= 0)
    own = np.where(leaf, parents, np.arange(len(parents)))
    result: I64 = own[weight.argmax(axis=1)]
    return result


@torch.no_grad()
def settle(bases: Tensor, edges: Edges, smoothing: float, decay: float) -> None:
    """Move each vector of `bases` [U, V, 3], in place, by the share `smoothing` to the mean of its neighbours, and
    then by `decay` metres to 0: what no image asks for becomes 0, and takes no bytes."""
    smooth = torch.empty_like(bases)
    smoothed(bases.detach().numpy(), edges, smoothing, smooth.numpy())
    length = torch.linalg.vector_norm(smooth, dim=2, keepdim=True)
    bases.copy_(smooth.mul_((1 - decay / length.clamp_min(1e-12)).clamp_min(0)))
