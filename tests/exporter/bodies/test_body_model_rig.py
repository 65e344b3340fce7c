"""Baking a body model: template, rest joints and joint basis against plain sums and the golden vectors."""

from __future__ import annotations

import zipfile
from pathlib import Path

import numpy as np
import pytest

from avatar_export.bodies.body_model import BodyModel, read_body_model
from avatar_export.bodies.body_rig import bake_rig, shaped_template
from avatar_export.bodies.subject_files import read_eyelids, read_faces, read_shape
from avatar_runtime.avatar import Rig, SparseRows
from avatar_runtime.checks.arrays import check_sparse
from avatar_runtime.io.errors import AvatarError
from tests.golden import BlendshapesGolden
from tests.shared_data import shared

V, F, J, S, E = 6, 4, 3, 2, 2


@pytest.fixture
def body() -> BodyModel:
    rng = np.random.default_rng(11)

    def normal(*shape: int) -> np.ndarray:
        return rng.normal(size=shape).astype("f4")

    expression = normal(V, 3, E)
    expression[2] = 0
    expression[3, :, 1] = 0
    expression[4, :2, 0] = 0  # z alone is left: the entry stays
    weights = np.array([[1, 0, 0], [0.5, 0, 0.5], [0.25, 0.5, 0.25], [0, 1, 0], [0, 0, 1], [1, 0, 0]], "f4")
    return BodyModel(
        normal(V, 3), rng.integers(0, V, (F, 3)).astype("u4"), normal(V, 3, S), expression, ("a", "b"),
        normal(V, 3, 18), rng.random((J, V)).astype("f4"), weights,
        np.array([-1, 0, 1], "i4"), ("r", "n", "j"),
    )  # fmt: skip


def dense(rows: SparseRows, name: str) -> np.ndarray:
    value = rows.values[name]
    out = np.zeros((rows.rows, rows.columns, *value.shape[1:]), np.float32)
    for row in range(rows.rows):
        for entry in range(rows.row_ptr[row], rows.row_ptr[row + 1]):
            out[row, rows.column[entry]] = value[entry]
    return out


def test_rig_is_the_sum_that_the_model_says(body: BodyModel) -> None:
    shape = np.array([0.5, -2.0])
    lids = {"left": np.ones((V, 3), "f4"), "right": np.zeros((V, 3), "f4")}
    lids["left"][1:] = 0
    rig = bake_rig(body, shape, lids, np.array([2, 0, 2]))
    template = np.zeros((V, 3))
    for v in range(V):
        template[v] = body.v_template[v] + sum(body.identity_dirs[v, :, s] * shape[s] for s in range(S))
    joints = np.zeros((J, 3))
    basis = np.zeros((E, J, 3))
    for j in range(J):
        for v in range(V):
            joints[j] += np.float64(body.joint_regressor[j, v]) * template[v]
            for e in range(E):
                basis[e, j] += np.float64(body.joint_regressor[j, v]) * body.expression_dirs[v, :, e]
    np.testing.assert_allclose(rig.vertices, template, atol=1e-6)
    np.testing.assert_allclose(rig.joint_basis, basis, atol=2e-6)
    world = np.eye(4)
    for j in range(J):  # a chain: parents -1 0 1
        world = world @ rig.rest_local[j]
        np.testing.assert_allclose(world[:3, 3], joints[j], atol=2e-6)
        np.testing.assert_allclose(world @ rig.inverse_bind_matrix[j], np.eye(4), atol=2e-6)
    np.testing.assert_array_equal(dense(rig.morphs, "position"), body.expression_dirs.transpose(0, 2, 1))
    np.testing.assert_array_equal(dense(rig.correctives, "position"), body.posedirs.transpose(0, 2, 1))
    np.testing.assert_array_equal(dense(rig.skin, "weight"), body.skin_weights)
    assert rig.morphs.entries == 2 * (V - 2) + 1 and rig.skin.entries == 9  # zeros are dropped
    assert dense(rig.late_morphs, "position")[0].tolist() == [[1, 1, 1], [0, 0, 0]]
    assert rig.late_morphs.entries == 1
    faces = body.triangles
    assert rig.anchor_vertices.tolist() == [*faces[2], *faces[0], *faces[2]]  # repeats and order kept
    assert rig.corrective_joints.tolist() == [1, 2]
    check(rig, E, 2)


def check(rig: Rig, expressions: int, late: int) -> None:
    """What the runtime demands of a rig."""
    v, j = len(rig.vertices), rig.joint_count
    check_sparse(rig.morphs, "morphs", v, expressions, {"position": (3,)})
    check_sparse(rig.correctives, "correctives", v, 9 * (j - 1), {"position": (3,)})
    check_sparse(rig.late_morphs, "late_morphs", v, late, {"position": (3,)})
    check_sparse(rig.skin, "skin", v, j, {"weight": ()})
    for array, dtype in (
        (rig.vertices, "f4"), (rig.triangles, "u4"), (rig.rest_local, "f4"), (rig.inverse_bind_matrix, "f4"),
        (rig.joint_basis, "f4"), (rig.parents, "i4"), (rig.corrective_joints, "i4"),
        (rig.anchor_vertices, "u4"),
    ):  # fmt: skip
        assert array.dtype == dtype


def test_a_shorter_shape_is_filled_with_zeros(body: BodyModel) -> None:
    np.testing.assert_array_equal(shaped_template(body, None), body.v_template)
    np.testing.assert_array_equal(
        shaped_template(body, np.array([2.0])), shaped_template(body, np.array([2.0, 0, 0, 0]))
    )
    plain = bake_rig(body)
    assert plain.late_morphs.columns == 0 and plain.anchor_vertices.tolist() == []
    check(plain, E, 0)


def test_what_does_not_go_with_the_body_is_refused(body: BodyModel) -> None:
    with pytest.raises(AvatarError, match="shape: has 3 coefficients, but the body model has 2"):
        bake_rig(body, np.array([1, 2, 1e-9]))
    with pytest.raises(AvatarError, match=r"left: has shape \[5, 3\], the body model has 6 vertices"):
        bake_rig(body, None, {"left": np.zeros((5, 3), "f4")})
    for face in (F, -1):
        with pytest.raises(AvatarError, match=rf"anchor faces: \[1\] = {face}, but the body model has {F}"):
            bake_rig(body, None, None, np.array([0, face]))


def rest_joints(rig: Rig) -> np.ndarray:
    return -rig.inverse_bind_matrix[:, :3, 3]


def expect_golden(golden: BlendshapesGolden, body: BodyModel) -> None:
    static = golden.static()
    rig = bake_rig(
        body,
        read_shape(golden.frame_file(0)),
        read_eyelids(golden.body, body.vertex_count),
        read_faces(golden.body / "back_of_head.txt", len(body.triangles)),
    )
    check(rig, len(body.expression_names), 2)
    np.testing.assert_allclose(rig.vertices, static["vertices_neutral"], atol=1e-7)
    np.testing.assert_allclose(rest_joints(rig), static["joints_neutral"], atol=1e-7)
    assert rig.anchor_vertices.shape == (168,)
    plain = golden.body_model()
    for column, key in enumerate(("l_eyelid", "r_eyelid")):
        np.testing.assert_allclose(dense(rig.late_morphs, "position")[:, column], plain[key], atol=1e-8)
    for index in range(4):
        frame = golden.frame(index)
        weights = frame["exp"][: len(body.expression_names)]
        joints = rest_joints(rig) + np.tensordot(weights, rig.joint_basis, (0, 0))
        np.testing.assert_allclose(joints, frame["joints_rest"], atol=1e-7)


def test_golden_from_npz(blendshapes_golden: BlendshapesGolden) -> None:
    expect_golden(blendshapes_golden, read_body_model(blendshapes_golden.body / "body_model.npz"))


def test_golden_from_the_flame_layout_pickle(blendshapes_golden: BlendshapesGolden, tmp_path: Path) -> None:
    with zipfile.ZipFile(shared("golden/gaussian_blendshapes/body/flame_layout_model.pkl.zip")) as archive:
        archive.extract("flame_layout_model.pkl", tmp_path)
    body = read_body_model(tmp_path / "flame_layout_model.pkl")
    assert body.expression_names[-1] == "exp_099" and body.identity_dirs.shape[2] == 300
    expect_golden(blendshapes_golden, body)
