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


@dataclass(frozen=True)
class Skeleton:
    """What moves the Gaussians, frame by frame."""

    names: tuple[str, ...]  # [J]
    parents: I32  # [J]
    rest: F64  # [J, 4, 4] mesh from joint
    skin_matrix: F64  # [F, J, 4, 4] mesh from binding mesh
    delta: F64  # [F, J, 4, 4] parent_from_joint = rest_local @ delta
    basis: F64  # [D, J, 3] how far each driver moves each rest joint
    turning: I64  # [C] joints, not roots, whose turns were seen

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

    `basis` [D, J, 3] says how far each driver moves each rest joint, metres; without it, it is learnt.
    """
    drivers = dumps.drivers
    if not drivers.joint_names:
        return None
    turn = homogeneous(dumps.turn)

    def placed(matrices: F64) -> F64:
        moved = matrices.copy()
        moved[..., :3, 3] *= dumps.unit
        result: F64 = turn @ moved
        return result

    rest, world = placed(drivers.rest), placed(drivers.world_from_joint)
    basis = _basis(drivers, rest, world, fitted) if basis is None else basis
    moved = np.tensordot(drivers.drivers, basis, axes=1)  # [F, J, 3]
    rest_moved = translation_matrix(moved) @ rest
    delta: F64 = np.linalg.solve(local(rest_moved, drivers.parents), local(world, drivers.parents)).astype(
        np.float64
    )
    turns = np.abs(delta[fitted][..., :3, :3] - np.eye(3)).max(axis=(0, 2, 3))
    turning = np.flatnonzero((turns > STILL) & (drivers.parents >= 0))
    skin: F64 = (world @ np.linalg.inv(rest_moved)).astype(np.float64)
    return Skeleton(drivers.joint_names, drivers.parents.astype(np.int32), rest, skin, delta, basis, turning)


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
