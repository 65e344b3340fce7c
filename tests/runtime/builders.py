"""Small model parts for tests, from dense arrays."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from avatar_runtime.avatar import (
    Avatar,
    Blendshapes,
    Expression,
    Gaussians,
    Group,
    Rig,
    Rules,
    SparseRows,
)

Array = npt.NDArray[Any]


def sparse(dense: Mapping[str, Array]) -> SparseRows:
    """SparseRows of dense arrays [rows, columns, ...]; an entry stands where any attribute is not zero."""
    first = next(iter(dense.values()))
    rows, columns = first.shape[:2]
    used = np.zeros((rows, columns), bool)
    for value in dense.values():
        used |= (value != 0).reshape(rows, columns, -1).any(axis=2)
    row_ptr = np.concatenate([[0], np.cumsum(used.sum(axis=1))]).astype(np.uint32)
    column = np.nonzero(used)[1].astype(np.uint16)
    return SparseRows(row_ptr, column, {k: v[used].astype(np.float32) for k, v in dense.items()}, columns)


def small_rig(seed: int = 1) -> Rig:
    """Six vertices, three joints in a chain with rotated rest transforms, one late morph, two expressions."""
    rng = np.random.default_rng(seed)
    rest = np.tile(np.eye(4, dtype=np.float32), (3, 1, 1))
    rest[:, :3, 3] = rng.normal(size=(3, 3))
    world = [rest[0].astype(np.float64)]
    for j in (1, 2):
        world.append(world[-1] @ rest[j])
    weights = rng.uniform(0.1, 1, (6, 3))
    weights /= weights.sum(axis=1, keepdims=True)
    return Rig(
        vertices=rng.normal(size=(6, 3)).astype(np.float32),
        triangles=np.array([[0, 1, 2], [2, 3, 4], [3, 4, 5]], np.uint32),
        morphs=sparse({"position": rng.normal(size=(6, 2, 3))}),
        correctives=sparse({"position": rng.normal(size=(6, 9, 3))}),
        late_morphs=sparse({"position": rng.normal(size=(6, 1, 3))}),
        skin=sparse({"weight": weights}),
        joint_names=("root", "neck", "jaw"),
        parents=np.array([-1, 0, 1], np.int32),
        rest_local=rest,
        inverse_bind_matrix=np.linalg.inv(world).astype(np.float32),
        joint_basis=rng.normal(size=(2, 3, 3)).astype(np.float32),
        corrective_joints=np.array([2], np.int32),
        anchor_vertices=np.array([0, 1, 2, 2, 3], np.uint32),
    )


def small_avatar(seed: int = 2) -> Avatar:
    """Five Gaussians in four groups, one of each binding, every field seeded and non-zero."""
    rng = np.random.default_rng(seed)

    def normal(*shape: int) -> Array:
        return rng.normal(size=shape).astype(np.float32)

    weights = rng.uniform(0.1, 1, (5, 3))
    weights /= weights.sum(axis=1, keepdims=True)
    avatar = Avatar(
        name="small",
        gaussians=Gaussians(normal(5, 3), normal(5, 3), normal(5, 4), normal(5), normal(5, 4, 3)),
        groups=(
            Group("face", 0, 2, "skin"),
            Group("upper", 2, 1, "anchor"),
            Group("lower", 3, 1, "joint_mix", {"neck": 0.1, "jaw": 0.9}),
            Group("rest", 4, 1, "none"),
        ),
        rules=Rules(),
        expressions=(Expression("jawOpen", ("JawOpen",)), Expression("mouthSmileLeft")),
        late_morph_names=("blink",),
        blendshapes=Blendshapes(
            sparse({"mean": normal(5, 2, 3), "quat_wxyz": normal(5, 2, 4)}),
            sparse({"log_scale": normal(5, 2, 3), "opacity_logit": normal(5, 2), "sh": normal(5, 2, 4, 3)}),
            sparse({"mean": normal(5, 9, 3)}),
            sparse({"mean": normal(5, 1, 3)}),
        ),
        skin=sparse({"weight": weights}),
        rig=small_rig(),
        sh_degree=1,
    )
    return avatar.check()
