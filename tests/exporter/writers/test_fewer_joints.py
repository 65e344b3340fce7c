"""A few joints in place of many: what can be shown exactly is, what cannot comes nearer than by the strongest alone."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from avatar_export.writers.engine_mesh import engine_mesh
from avatar_export.writers.fewer_joints import few
from avatar_export.writers.rig_poses import residual_poses
from avatar_runtime.avatar import Avatar
from avatar_runtime.engine_pose import engine_pose
from tests.asm_faces import asm_avatar
from tests.avatars import VERTICES, full_avatar
from tests.oracles.gltf_pose import File
from tests.rigs import runtime_mesh, sparse, state_of, strongest, with_rig, without_late, written

Array = npt.NDArray[np.float64]


def poses(count: int, joints: int, rng: np.random.Generator) -> Array:
    """Skin matrices that move each joint its own way."""
    found = np.tile(np.eye(4), (count, joints, 1, 1))
    found[:, :, :3] += rng.normal(0, 0.1, (count, joints, 3, 4))
    return found


def shown(vertices: Array, joints: Array, weights: Array, matrices: Array) -> Array:
    """[P, v, 3] by loops over what linear blend skinning is."""
    result = np.zeros((len(matrices), len(vertices), 3))
    for p, matrix in enumerate(matrices):
        for v, vertex in enumerate(vertices):
            for joint, weight in zip(joints[v], weights[v], strict=True):
                result[p, v] += weight * (matrix[int(joint)] @ [*vertex, 1])[:3]
    return result


def test_joints_that_move_as_one_are_joined_without_loss() -> None:
    rng = np.random.default_rng(1)
    matrices = poses(6, 8, rng)
    matrices[:, 4:] = matrices[:, :4]  # joints 4..7 move as 0..3
    vertices = rng.normal(0, 0.1, (5, 3))
    weights = -np.sort(-rng.dirichlet(np.ones(8), 5), axis=1)
    joints = np.array([rng.permutation(8) for _ in range(5)])
    found, share = few(vertices.astype(np.float32), joints, weights, matrices, 4)
    np.testing.assert_allclose(share.sum(axis=1), 1, atol=1e-12)
    assert (share >= 0).all() and (np.diff(share, axis=1) <= 0).all()
    before, after = shown(vertices, joints, weights, matrices), shown(vertices, found, share, matrices)
    assert np.abs(after - before).max() < 5e-4  # metres; the strongest alone come to centimetres
    strongest = weights[:, :4] / weights[:, :4].sum(axis=1, keepdims=True)
    assert np.abs(shown(vertices, joints[:, :4], strongest, matrices) - before).max() > 1e-2


def test_what_no_pose_tells_stays_nearest_to_the_weights() -> None:
    still = np.tile(np.eye(4), (1, 6, 1, 1))
    weights = np.array([[0.4, 0.25, 0.15, 0.1, 0.06, 0.04]])
    found, share = few(np.ones((1, 3), np.float32), np.arange(6)[None], weights, still, 4)
    assert found.tolist() == [[0, 1, 2, 3]]
    np.testing.assert_allclose(share, weights[:, :4] + 0.1 / 4, atol=1e-6)


def test_only_rigs_with_more_joints_are_fitted() -> None:
    assert engine_mesh(asm_avatar()).fitted_poses is not None
    assert engine_mesh(crowded()).fitted_poses is not None
    assert engine_mesh(strongest(crowded(), 4)).fitted_poses is None


def test_the_four_of_a_rig_are_nearer_than_the_strongest_in_poses_they_were_not_fitted_to() -> None:
    avatar = crowded()
    fitted, cut = File(written(avatar)), File(written(strongest(avatar, 4)))
    assert max(fitted.attribute("WEIGHTS_0").sum(axis=1)) <= 1 + 1e-6
    apart = {"fitted": 0.0, "cut": 0.0}
    for pose in map(without_late, residual_poses(avatar)):
        state = state_of(avatar, engine_pose(avatar, pose))
        for name, file in (("fitted", fitted), ("cut", cut)):
            apart[name] += float(np.square(file.posed(state) - runtime_mesh(avatar, file, pose)).sum())
    assert 0 < apart["fitted"] < 0.7 * apart["cut"]


def crowded() -> Avatar:
    """A rig that rests bound, five joints a vertex, none of them weak."""
    weights = np.random.default_rng(3).dirichlet(np.full(5, 8.0), VERTICES)
    return with_rig(full_avatar(), skin=sparse(weights, "weight"))
