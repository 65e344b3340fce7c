"""The mesh that the dumps may hang on: a rig whose joints are those of drivers.npz, posed in every frame."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from avatar_export.distill.drivers import FILE as DRIVERS
from avatar_export.distill.drivers import Drivers
from avatar_export.distill.dumps.folder import OWNER, Dumps
from avatar_export.distill.dumps.frames import read_frame
from avatar_export.distill.learn import Task
from avatar_export.distill.skeleton import Skeleton, placed
from avatar_export.fit.closest import Triangles
from avatar_export.rigs.rig_arrays import by_row
from avatar_export.sparse import no_shifts
from avatar_runtime.avatar import F32, F64, I64, Rig, SparseRows
from avatar_runtime.io.errors import AvatarError
from avatar_runtime.pose import PoseArrays
from avatar_runtime.posed import posed_mesh
from avatar_runtime.stages.joints import joints, rest_transforms
from avatar_runtime.stages.sparse import gather

# Of the skeleton's size: rest joints of rig and dumps that lie farther apart are not the same.
LARGEST_OFF = 0.01


@dataclass(frozen=True)
class Mesh:
    """A rig whose joints and expressions are those of the dumps."""

    rig: Rig

    def vertices(self, dumps: Dumps, skeleton: Skeleton, frames: I64) -> Iterator[F32]:
        """[V, 3] of each frame, where the dumps have the mesh: world space, bundle axes, metres."""
        for frame in frames.tolist():
            pose = PoseArrays(
                dumps.drivers.drivers[frame].astype(np.float32),
                np.zeros(0, np.float32),
                skeleton.delta[frame],
                np.eye(4),
            )
            yield posed_mesh(self.rig, pose, joints(self.rig, pose))


def ordered(drivers: Drivers, rig: Rig) -> Drivers:
    """`drivers` with the joints in the rig's order. Raises AvatarError for joints that the other lacks."""
    lacking = [name for name in rig.joint_names if name not in drivers.joint_names]
    if lacking or len(rig.joint_names) != len(drivers.joint_names):
        theirs = [name for name in drivers.joint_names if name not in rig.joint_names]
        what = (
            f"lacks joint {lacking[0]!r}, which the rig has"
            if lacking
            else f"has joint {theirs[0]!r}, which the rig lacks"
        )
        raise AvatarError(
            f"{what}; pass the rig that posed the dumps", file=DRIVERS, field="joint_names", owner=OWNER
        )
    at = [drivers.joint_names.index(name) for name in rig.joint_names]
    return replace(
        drivers,
        joint_names=rig.joint_names,
        parents=rig.parents.astype(np.int64),
        rest=drivers.rest[at],
        world_from_joint=drivers.world_from_joint[:, at],
    )


def check_rest(dumps: Dumps, rig: Rig) -> None:
    """Raise AvatarError where the rest joints of rig and dumps lie far apart."""
    own = rest_transforms(rig)[:, :3, 3]
    off = np.linalg.norm(placed(dumps, dumps.drivers.rest)[:, :3, 3] - own, axis=1)
    size = max(float(np.ptp(own, axis=0).max()), 1e-3)
    if off.max() > LARGEST_OFF * size:
        joint = rig.joint_names[int(np.argmax(off))]
        raise AvatarError(
            f"rests {1e3 * off.max():.3g} mm from that of the rig: check unit and up_axis in dumps.json, and the "
            "identity (--shape) of the body model",
            file=DRIVERS,
            field=f"joint {joint}",
            owner=OWNER,
        )


def joint_basis(rig: Rig, morph_names: Sequence[str], names: Sequence[str]) -> F64:
    """[D, J, 3] how far each of the drivers `names` moves each rest joint of `rig`; 0 for those that it lacks."""
    basis = np.zeros((len(names), rig.joint_count, 3))
    column = _driver_of(morph_names, names)
    used = np.flatnonzero(column >= 0)
    basis[column[used]] = rig.joint_basis[used] if len(rig.joint_basis) else 0
    return basis


def _driver_of(morph_names: Sequence[str], names: Sequence[str]) -> I64:
    """[K] the driver of the same name as each morph, -1 without one."""
    return np.array([names.index(name) if name in names else -1 for name in morph_names], np.int64)


def mesh_of(rig: Rig, morph_names: Sequence[str], names: Sequence[str], skeleton: Skeleton) -> Mesh:
    """`rig` with a morph for each of the drivers `names`: those of the same name, else none.

    Joints that turned in the dumps become corrective joints, so that Gaussians can follow them.
    """
    joint = np.union1d(rig.corrective_joints, skeleton.turning).astype(np.int32)
    late = no_shifts(len(rig.vertices))
    feature = (9 * np.searchsorted(joint, rig.corrective_joints)[:, None] + np.arange(9)).reshape(-1)
    return Mesh(
        replace(
            rig,
            morphs=_columns(rig.morphs, _driver_of(morph_names, names), len(names)),
            correctives=_columns(rig.correctives, feature, 9 * len(joint)),
            late_morphs=late,
            joint_basis=joint_basis(rig, morph_names, names).astype(np.float32),
            corrective_joints=joint,
            anchor_vertices=np.zeros(0, np.uint32),
        )
    )


def _columns(sparse: SparseRows, column: I64, columns: int) -> SparseRows:
    """`sparse` with column c moved to column[c], and dropped where that is -1."""
    pointer = sparse.row_ptr.astype(np.int64)
    row = np.repeat(np.arange(sparse.rows), pointer[1:] - pointer[:-1])
    moved = column[sparse.column] if sparse.entries else np.zeros(0, np.int64)
    kept = moved >= 0
    values = {name: value[kept] for name, value in sparse.values.items()}
    return by_row(row[kept], moved[kept], values, sparse.rows, columns)


def priors(task: Task, mesh: Mesh) -> Callable[[slice | I64], F64 | None]:
    """Skin weights [n, J] of the mesh under each Gaussian, in the frame whose joints turned least."""
    assert task.skeleton is not None
    if not len(mesh.rig.triangles):
        return lambda _: None
    moved = np.abs(task.skeleton.delta[task.fitted] - np.eye(4)).sum(axis=(1, 2, 3))
    frame = int(task.fitted[int(np.argmin(moved))])
    vertices = next(mesh.vertices(task.dumps, task.skeleton, np.array([frame])))
    shape = Triangles.of(vertices.astype(np.float64), mesh.rig.triangles)
    dense = gather(mesh.rig.skin, np.eye(mesh.rig.joint_count, dtype=np.float32)).astype(np.float64)
    positions = read_frame(task.dumps, task.layout, frame, task.order).mean[0]

    def of(rows: slice | I64) -> F64:
        found = shape.nearest(positions[rows].astype(np.float64))
        corners = dense[mesh.rig.triangles[found.triangle].astype(np.int64)]
        weight = np.einsum("nc,ncj->nj", found.barycentric, corners)
        result: F64 = weight / weight.sum(axis=1, keepdims=True)
        return result

    return of
