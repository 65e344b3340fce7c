"""The mesh as engines hold it: nothing that importers drop, unit normals, the strongest influences."""

from __future__ import annotations

import numpy as np
import pytest

from avatar_export.writers.glb_builder import GlbBuilder
from avatar_export.writers.rig_poses import residual_poses
from avatar_runtime.avatar import SparseRows
from avatar_runtime.engine_pose import engine_pose
from tests.avatars import VERTICES, full_avatar
from tests.oracles.gltf_pose import File
from tests.rigs import (
    EXACT,
    dense_weights,
    distance,
    first_rows,
    rig_of,
    runtime_mesh,
    sparse,
    state_of,
    strongest,
    with_rig,
    without_late,
    written,
)


def test_what_importers_would_drop_is_not_there() -> None:
    """An unused vertex in the middle, a repeated corner, no area, the same triangle twice (turned over too)."""
    avatar = full_avatar()
    rig = rig_of(avatar)
    vertices = rig.vertices.copy()
    vertices[9], vertices[10], vertices[11] = [0, 0, 0], [0.5, 0, 0], [1, 0, 0]
    triangles = rig.triangles[~(rig.triangles == 3).any(axis=1)]
    kept = triangles.copy()
    bad = np.array([[3, 4, 4], [9, 10, 11], kept[0][[1, 2, 0]], kept[1][[0, 2, 1]]], np.uint32)
    triangles = np.concatenate([triangles[:2], bad[:1], triangles[2:7], bad[1:], triangles[7:]])
    avatar = strongest(with_rig(avatar, vertices=vertices, triangles=triangles), 4)
    file = File(written(avatar))
    ids = file.attribute("_VERTEX_ID")[:, 0].astype(int)
    np.testing.assert_array_equal(ids, [v for v in range(VERTICES) if v != 3])
    np.testing.assert_array_equal(ids[file.triangles], kept)
    np.testing.assert_array_equal(file.attribute("POSITION"), vertices[ids].astype(np.float64))
    for pose in map(without_late, residual_poses(avatar)):
        posed = file.posed(state_of(avatar, engine_pose(avatar, pose)))
        assert distance(posed, runtime_mesh(avatar, file, pose)) <= 5 * EXACT  # it is 1 m wide now


def test_normals_are_unit_and_lie_between_those_of_the_triangles() -> None:
    avatar = full_avatar()
    file = File(written(avatar))
    normals, position = file.attribute("NORMAL"), file.attribute("POSITION")
    np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1, atol=1e-6)
    expected = np.zeros_like(normals)
    for a, b, c in file.triangles:
        expected[[a, b, c]] += np.cross(position[b] - position[a], position[c] - position[a])
    expected /= np.linalg.norm(expected, axis=1, keepdims=True)
    np.testing.assert_allclose(normals, expected, atol=1e-5)


def test_where_normals_cancel_there_is_still_one() -> None:
    """Two triangles that face each other's way over the same line."""
    vertices = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 1, 0]], np.float32) * np.float32(1e-20)
    triangles = np.array([[0, 1, 2], [0, 3, 1]], np.uint32)
    rig = rig_of(full_avatar())
    four = {
        name: first_rows(getattr(rig, name), 4) for name in ("morphs", "correctives", "late_morphs", "skin")
    }
    avatar = with_rig(
        full_avatar(),
        vertices=vertices,
        triangles=triangles,
        anchor_vertices=np.arange(4, dtype="u4"),
        **four,
    )
    normals = File(written(avatar)).attribute("NORMAL")
    np.testing.assert_allclose(np.abs(normals), np.tile([0, 0, 1], (4, 1)), atol=1e-7)


@pytest.mark.parametrize("influences", [4, 8])
def test_weights_are_the_strongest_and_add_up_to_1(influences: int) -> None:
    """As the Khronos validator wants them: within 2e-7 per weight, joint 0 for unused places, no duplicate joint."""
    avatar = full_avatar(1)
    file = File(written(avatar, influences))
    sets = range(influences // 4)
    joints = np.concatenate([file.attribute(f"JOINTS_{k}") for k in sets], axis=1)
    weights = np.concatenate([file.attribute(f"WEIGHTS_{k}") for k in sets], axis=1)
    assert (np.abs(weights.sum(axis=1) - 1) <= 2e-7 * (weights > 0).sum(axis=1)).all()
    assert (joints[weights == 0] == 0).all() and (weights >= 0).all() and (np.diff(weights) <= 0).all()
    for row, dense in enumerate(dense_weights(rig_of(avatar))):
        order = np.argsort(-dense, kind="stable")[:influences]
        order = order[dense[order] > 0]
        np.testing.assert_array_equal(joints[row, : len(order)], order)
        expected = dense[order] / dense[order].sum()
        np.testing.assert_allclose(weights[row, : len(order)], expected, atol=1e-7)
    names = {n for n in file.json["meshes"][0]["primitives"][0]["attributes"] if n.startswith("JOINTS")}
    assert names == {f"JOINTS_{k}" for k in sets}


def test_a_vertex_without_weight_and_one_with_a_negative_weight() -> None:
    dense = np.zeros((VERTICES, 5))
    dense[:, 2] = 1
    dense[4] = 0
    dense[5] = [0, -0.5, 0, 1.5, 0]
    file = File(written(with_rig(full_avatar(), skin=sparse(dense, "weight"))))
    joints, weights = file.attribute("JOINTS_0"), file.attribute("WEIGHTS_0")
    assert joints[4].tolist() == [0, 0, 0, 0] and weights[4].tolist() == [1, 0, 0, 0]
    assert joints[5].tolist() == [3, 0, 0, 0] and weights[5].tolist() == [1, 0, 0, 0]


def test_a_vertex_with_nothing_but_negative_weights_goes_to_joint_0() -> None:
    """As in rig.usdc: its first stored joint has no claim to it."""
    rig = rig_of(full_avatar())
    weights = np.zeros((VERTICES, len(rig.joint_names)), np.float32)
    weights[:, 2] = 1
    weights[5, 2], weights[5, 3] = -1, -0.5
    skin = SparseRows(
        np.arange(VERTICES + 1, dtype=np.uint32) + (np.arange(VERTICES + 1) > 5).astype(np.uint32),
        np.nonzero(weights)[1].astype(np.uint16),
        {"weight": weights[weights != 0]},
        len(rig.joint_names),
    )
    file = File(written(with_rig(full_avatar(), skin=skin)))
    assert file.attribute("JOINTS_0")[5].tolist() == [0, 0, 0, 0]
    assert file.attribute("WEIGHTS_0")[5].tolist() == [1, 0, 0, 0]


def test_a_target_that_moves_nothing_is_still_there() -> None:
    """As one row of zeros: some importers know no accessor without data."""
    rig = rig_of(full_avatar())
    morphs = SparseRows.empty(VERTICES, 4, {"position": (3,)})
    file = File(written(with_rig(full_avatar(), morphs=morphs)))
    first = file.json["meshes"][0]["primitives"][0]["targets"][0]["POSITION"]
    assert not file.accessor(first).any() and file.json["accessors"][first]["sparse"]["count"] == 1
    assert file.json["accessors"][first]["min"] == [0, 0, 0] and rig.morphs.entries


def test_bounds_of_a_target_take_in_the_vertices_that_it_leaves_alone() -> None:
    builder = GlbBuilder("made.glb")
    values = np.array([[1, 2, 3], [2, 3, 4]], np.float32)
    some, every = builder.sparse(3, np.array([0, 2]), values), builder.sparse(2, np.array([0, 1]), values)
    some, every = builder.document.accessors[some], builder.document.accessors[every]
    assert (some.min, some.max) == ([0, 0, 0], [2, 3, 4])
    assert (every.min, every.max) == ([1, 2, 3], [2, 3, 4])
