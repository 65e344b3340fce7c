"""The skeleton that posed the dumps, in the bundle's axes and metres: skin matrices, turns, moving rest joints."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from avatar_export.distill.drivers import Drivers
from avatar_export.distill.dumps.folder import Dumps
from avatar_runtime.avatar import F64, I32, I64
from avatar_runtime.rotation import homogeneous, translation_matrix

STILL = 1e-4  # of R - I: a joint that turns less in all frames was not exercised
LEAST_SHIFT = 2e-6  # metres: rest joints that move less with the drivers are taken to rest
EXPLAINED = 0.99  # of the motion of a rest joint, by which the drivers must explain it
UNEXERCISED = 0.01  # standard deviation of a driver below which nothing is learnt of it
# A joint whose motion against its parent varies less in all frames was not taught:
LEAST_TURN = 0.01  # of R
LEAST_WAY = 0.003  # of the skeleton's size


@dataclass(frozen=True)
class Skeleton:
    """What moves the Gaussians, frame by frame."""

    names: tuple[str, ...]  # [J]
    parents: I32  # [J]; without a mesh, the nearest ancestor that is taught
    rest: (
        F64  # [J, 4, 4] mesh from joint; without a mesh, as the joints that are not taught stood in the dumps
    )
    skin_matrix: F64  # [F, J, 4, 4] mesh from binding mesh
    delta: F64  # [F, J, 4, 4] parent_from_joint = rest_local @ delta
    basis: F64  # [D, J, 3] how far each driver moves each rest joint
    turning: I64  # [C] joints, not roots, whose turns were seen
    leader: I64  # [J] the joint itself if it is taught, else the nearest ancestor that is: both moved as one

    @property
    def untaught(self) -> tuple[str, ...]:
        """Joints that never moved against their parents, so that nothing says what hangs on them."""
        return tuple(name for joint, name in enumerate(self.names) if self.leader[joint] != joint)

    @property
    def count(self) -> int:
        """How many joints there are, J."""
        return len(self.names)

    def features(self) -> F64:
        """[F, C, 9] row-major R - I of the joints `turning`."""
        turns = self.delta[:, self.turning, :3, :3] - np.eye(3)
        return turns.reshape(len(turns), -1, 9)

    def at(self, frames: I64) -> Skeleton:
        """The given frames."""
        return replace(self, skin_matrix=self.skin_matrix[frames], delta=self.delta[frames])


def skeleton_of(dumps: Dumps, fitted: I64, basis: F64 | None = None) -> Skeleton | None:
    """The skeleton of the dumps; None where drivers.npz has none. `fitted`: frames that may be learnt from.

    `basis` [D, J, 3] is that of a rig with a mesh: how far each driver moves each rest joint, metres. Without it, it is
    learnt, and joints that never moved against their parents are let go: they end up without children, so that they
    move nothing, as nothing was seen to hang on them.
    """
    drivers = dumps.drivers
    if not drivers.joint_names:
        return None
    rest, world = placed(dumps, drivers.rest), placed(dumps, drivers.world_from_joint)
    found = _skeleton(drivers, rest, world, fitted, basis)
    if basis is not None or not found.untaught:
        return found
    free = replace(drivers, parents=_free(found))
    again = _skeleton(free, _as_they_stood(found, fitted), world, fitted, None)
    return replace(again, leader=found.leader, turning=np.intersect1d(again.turning, found.turning))


def placed(dumps: Dumps, matrices: F64) -> F64:
    """Transforms [..., 4, 4] of the dumps in the bundle's axes and metres."""
    moved = matrices.copy()
    moved[..., :3, 3] *= dumps.unit
    result: F64 = homogeneous(dumps.turn) @ moved
    return result


def _skeleton(drivers: Drivers, rest: F64, world: F64, fitted: I64, basis: F64 | None) -> Skeleton:
    basis = _basis(drivers, rest, world, fitted) if basis is None else basis
    moved = np.tensordot(drivers.drivers, basis, axes=1)  # [F, J, 3]
    rest_moved = translation_matrix(moved) @ rest
    delta: F64 = np.linalg.solve(local(rest_moved, drivers.parents), local(world, drivers.parents)).astype(
        np.float64
    )
    skin: F64 = (world @ np.linalg.inv(rest_moved)).astype(np.float64)
    leader = _leaders(skin[fitted], rest, drivers.parents)
    turns = np.abs(delta[fitted][..., :3, :3] - np.eye(3)).max(axis=(0, 2, 3))
    turning = np.flatnonzero((turns > STILL) & (drivers.parents >= 0) & (leader == np.arange(len(rest))))
    parents = drivers.parents.astype(np.int32)
    return Skeleton(drivers.joint_names, parents, rest, skin, delta, basis, turning, leader)


def _against(skin: F64, parents: I32 | I64) -> F64:
    """[F, J, 4, 4] skin matrices relative to those of the parents, of further roots to those of the first."""
    result: F64 = np.linalg.solve(skin[:, np.maximum(parents, 0)], skin).astype(np.float64)
    return result


def _leaders(skin: F64, rest: F64, parents: I64) -> I64:
    """[J] the joint itself if it moved against its parent, else the leader of the parent."""
    own = _against(skin, parents)
    place = np.einsum("fjab,jb->fja", own, rest[:, :, 3])[..., :3]
    turn = np.ptp(own[..., :3, :3], axis=0).max(axis=(1, 2))
    way = np.ptp(place, axis=0).max(axis=1)
    taught = (turn > LEAST_TURN) | (
        way > LEAST_WAY * float(np.ptp(rest[:, :3, 3], axis=0).max()) + LEAST_SHIFT
    )
    leader: I64 = np.arange(len(rest))
    for joint in range(1, len(rest)):  # the first is a root
        if not taught[joint]:
            leader[joint] = leader[max(int(parents[joint]), 0)]
    return leader


def _free(found: Skeleton) -> I64:
    """[J] parents that are taught."""
    untaught = found.leader != np.arange(found.count)
    parents = np.where(untaught, found.leader, found.parents)
    return np.where(parents >= 0, found.leader[parents], -1).astype(np.int64)


def _as_they_stood(found: Skeleton, fitted: I64) -> F64:
    """[J, 4, 4] rest transforms in which joints that are not taught stand against their parents as in the dumps."""
    own = _against(found.skin_matrix[fitted], found.parents)
    own = own[np.abs(own - own.mean(axis=0)).sum(axis=(2, 3)).argmin(axis=0), np.arange(found.count)]
    rest = found.rest.copy()
    for joint in range(1, found.count):
        parent = max(int(found.parents[joint]), 0)
        turned = found.leader[joint] != joint and np.abs(own[joint] - np.eye(4)).max() > STILL
        stood = own[joint] if turned else np.eye(4)
        if found.parents[joint] >= 0 or turned:
            rest[joint] = rest[parent] @ np.linalg.solve(found.rest[parent], stood @ found.rest[joint])
    return rest


def local(matrices: F64, parents: I32 | I64) -> F64:
    """Matrices [..., J, 4, 4] relative to those of the parents; roots stay as they are."""
    result = matrices.copy()
    child = np.flatnonzero(parents >= 0)
    result[..., child, :, :] = np.linalg.solve(
        matrices[..., parents[child], :, :], matrices[..., child, :, :]
    )
    return result


def exercised(drivers: Drivers, fitted: I64) -> I64:
    """Columns of the drivers that vary enough in the frames `fitted` to be learnt."""
    return np.flatnonzero(drivers.drivers[fitted].std(axis=0) >= UNEXERCISED)


def _basis(drivers: Drivers, rest: F64, world: F64, fitted: I64) -> F64:
    """[D, J, 3]: rest joints as a linear function of the drivers, as FLAME has it; zero where it does not fit."""
    basis = np.zeros((len(drivers.driver_names), len(rest), 3))
    columns = exercised(drivers, fitted)
    if not len(columns):
        return basis
    stretch = local(world, drivers.parents)[fitted, :, :3, 3] - local(rest, drivers.parents)[:, :3, 3]
    values = drivers.drivers[np.ix_(fitted, columns)]
    for joint, parent in enumerate(drivers.parents):
        if parent < 0:
            continue
        off = stretch[:, joint] @ rest[parent, :3, :3].T  # [F, 3] in mesh space
        found = np.linalg.lstsq(values, off, rcond=1e-6)[0]
        left = off - values @ found
        fits = np.square(left).sum() <= (1 - EXPLAINED) * np.square(off).sum()
        basis[:, joint] = basis[:, parent]
        if np.abs(off).max() > LEAST_SHIFT and fits:
            basis[columns, joint] += found
    return basis
