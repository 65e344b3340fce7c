"""rig.glb, posed by an oracle that reads nothing but its bytes: it moves as the runtime does."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from avatar_export.writers import glb_builder
from avatar_export.writers.engine_mesh import vertex_id_uv
from avatar_export.writers.residual import engine_residual
from avatar_export.writers.rig_glb import rig_glb
from avatar_export.writers.rig_poses import residual_poses
from avatar_runtime.avatar import Clip, SparseRows
from avatar_runtime.engine_pose import EnginePose, engine_clip, engine_pose, target_names
from avatar_runtime.io.errors import AvatarError
from avatar_runtime.pose import joint_rotation
from avatar_runtime.rotation import homogeneous, matrix_from_rotvec
from tests.avatars import JOINTS, VERTICES, full_avatar, surface_avatar
from tests.measured import Measure
from tests.oracles.gltf_pose import File, State
from tests.rigs import (
    EXACT,
    dense_weights,
    distance,
    grid_avatar,
    rig_of,
    runtime_mesh,
    state_of,
    strongest,
    with_rig,
    without_late,
    written,
)

Array = npt.NDArray[Any]


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("joints", [1, 4])
def test_posed_by_engine_pose_it_is_the_runtimes_mesh(seed: int, joints: int, measured: Measure) -> None:
    """Turned rests, joints that expressions move, correctives: no late morph, and at most four influences."""
    avatar = strongest(full_avatar(seed), joints)
    file = File(written(avatar))
    assert len(file.attribute("POSITION")) == VERTICES
    world = homogeneous(matrix_from_rotvec([0.2, 2.0, -0.3]), np.array([0.1, 0.5, -0.2]))
    still = file.posed(State())
    for pose in residual_poses(avatar):
        pose = replace(pose, eyelids={}, world_from_avatar=world)
        posed = file.posed(state_of(avatar, engine_pose(avatar, pose)))
        off = distance(posed, runtime_mesh(avatar, file, pose))
        measured("rig.glb: oracle against the runtime, four influences, metres", off)
        assert off <= EXACT and distance(posed, still) > 0.1


def test_clips_at_their_keys_are_engine_pose(measured: Measure) -> None:
    avatar = strongest(full_avatar(), 4)
    file = File(written(avatar))
    assert [a["name"] for a in file.json["animations"]] == ["nod", "blink"]
    for clip in avatar.clips:
        frames = engine_clip(avatar, clip)
        for k in range(clip.frames):
            one = EnginePose(*(getattr(frames, name)[k] for name in EnginePose.__dataclass_fields__))
            off = distance(file.posed(file.state(clip.name, k / clip.fps)), file.posed(state_of(avatar, one)))
            measured("rig.glb: clip keys against engine_pose, metres", off, EXACT)
            assert off <= EXACT


def still_clip(frames: int = 6, **fields: Array) -> Clip:
    """A clip in which nothing moves but what `fields` gives."""
    eye = np.eye(4, dtype=np.float32)
    given = {
        "expression_weights": np.zeros((frames, 4), np.float32),
        "late_weights": np.zeros((frames, 2), np.float32),
        "joint_delta": np.tile(eye, (frames, 5, 1, 1)),
        "world_from_avatar": np.tile(eye, (frames, 1, 1)),
    }
    return Clip("clip", 25.0, **{**given, **fields})


def channels(file: File) -> set[tuple[str, str]]:
    nodes = file.json["nodes"]
    found = file.json["animations"][0]["channels"]
    return {(nodes[c["target"]["node"]]["name"], c["target"]["path"]) for c in found}


def test_a_clip_has_channels_for_what_moves_alone() -> None:
    """An expression moves joints in mesh space, which joints at rest show no sign of; a turned jaw does."""
    eye = np.tile(np.eye(4, dtype=np.float32), (6, 5, 1, 1))
    turned, grown, world = eye.copy(), eye.copy(), eye[:, 0].copy()
    turned[3, 2] = joint_rotation([0.3, 0, 0])
    grown[2, 4, 0, 0] = 1.5
    world[:, 0, 3] = np.arange(6)
    weights = np.linspace(0, 1, 24, dtype=np.float32).reshape(6, 4)
    jaw = {("jaw", "rotation"), ("avatar_mesh", "weights")}  # correctives follow the jaw
    still = {("avatar_root", "translation")}  # an animation has a channel
    for fields, found in (
        ({"joint_delta": turned}, jaw),
        ({"joint_delta": turned, "expression_weights": weights}, jaw | {("jaw", "translation")}),
        ({"joint_delta": grown}, {("rightEye", "scale")}),
        ({"world_from_avatar": world}, still),
        ({}, still),
    ):
        file = File(written(replace(full_avatar(), clips=(still_clip(**fields),))))
        assert channels(file) == found
        times = file.accessor(file.json["animations"][0]["samplers"][0]["input"])[:, 0]
        np.testing.assert_array_equal(times, (np.arange(6) / 25).astype(np.float32))


def test_vertex_ids_survive_half_floats_and_a_flipped_v() -> None:
    ids = np.concatenate([np.arange(70_000), np.arange(500_000, 523_000)])
    uv = vertex_id_uv(ids).astype(np.float16).astype(np.float64)
    np.testing.assert_array_equal(uv[:, 0] + 256 * (uv[:, 1] - 2), ids)
    assert (1 - uv[:, 1]).max() < 0
    file = File(written(full_avatar()))
    u, v = file.attribute("TEXCOORD_0").T
    np.testing.assert_array_equal(u + 256 * (v - 2), file.attribute("_VERTEX_ID")[:, 0])


@pytest.mark.parametrize(
    ("vertices", "joints", "index", "joint"), [(65535, 256, 5123, 5121), (65536, 257, 5125, 5123)]
)
def test_numbers_are_as_wide_as_they_must_be(vertices: int, joints: int, index: int, joint: int) -> None:
    """The largest number of a type is not used as an index: it would restart a strip."""
    file = File(written(grid_avatar(vertices, joints)))
    primitive, accessors = file.json["meshes"][0]["primitives"][0], file.json["accessors"]
    assert accessors[primitive["indices"]]["componentType"] == index
    assert accessors[primitive["attributes"]["JOINTS_0"]]["componentType"] == joint
    assert file.triangles.max() == vertices - 1
    np.testing.assert_array_equal(file.attribute("JOINTS_0")[:, 0], np.arange(vertices) % joints)


def test_a_rig_that_gltf_cannot_hold_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    joints = 65_536
    rig = rig_of(full_avatar())
    avatar = with_rig(full_avatar(), joint_names=("j",) * joints, skin=replace(rig.skin, columns=joints))
    with pytest.raises(AvatarError, match=r"^rig.glb: joints: .*65535"):
        rig_glb(avatar)
    with pytest.raises(ValueError, match="4 or 8"):
        rig_glb(full_avatar(), 5)
    monkeypatch.setattr(glb_builder, "MOST_BYTES", 10_000)
    with pytest.raises(AvatarError, match=r"^rig.glb: .* 10000"):
        written(full_avatar())


def test_there_is_no_file_where_there_is_nothing_to_show() -> None:
    none = np.zeros((0, 4, 4), np.float32)
    jointless = with_rig(
        grid_avatar(9, 1),
        joint_names=(),
        parents=np.zeros(0, np.int32),
        rest_local=none,
        inverse_bind_matrix=none,
        joint_basis=np.zeros((4, 0, 3), np.float32),
        corrective_joints=np.zeros(0, np.int32),
        skin=SparseRows.empty(9, 0, {"weight": ()}),
        correctives=SparseRows.empty(9, 0, {"position": (3,)}),
    )
    flat = with_rig(full_avatar(), triangles=np.zeros((0, 3), np.uint32))
    for avatar in (surface_avatar(rigged=False), jointless, flat):
        assert rig_glb(avatar) is None
    assert engine_residual(jointless)["poses"] == engine_residual(flat)["poses"] == 0


def test_the_documents_form() -> None:
    """The Khronos validator's checks of accessors, and further guarantees of the format."""
    file = File(written(full_avatar()))
    document, nodes = file.json, file.json["nodes"]
    assert set(document["asset"]) == {"version", "generator"} and "extensionsUsed" not in document
    assert [nodes[n]["name"] for n in document["scenes"][0]["nodes"]] == ["avatar_mesh", "avatar_root"]
    assert [nodes[n]["name"] for n in document["skins"][0]["joints"]] == list(JOINTS)
    assert file.target_names == list(target_names(full_avatar()))
    assert document["materials"][0]["doubleSided"] is False
    for index, accessor in enumerate(document["accessors"]):
        if "min" in accessor:
            rows = file.accessor(index)
            assert [accessor["min"], accessor["max"]] == [
                rows.min(axis=0).tolist(),
                rows.max(axis=0).tolist(),
            ]
    assert sum("min" in a for a in document["accessors"]) == 1 + len(file.target_names) + 2


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


@pytest.mark.parametrize("influences", [4, 8])
def test_weights_are_the_strongest_and_add_up_to_1(influences: int) -> None:
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
    assert f"JOINTS_{influences // 4}" not in file.json["meshes"][0]["primitives"][0]["attributes"]
