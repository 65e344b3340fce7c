"""rig.glb, posed by an oracle that reads nothing but its bytes: it moves as the runtime does."""

from __future__ import annotations

import hashlib
import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from avatar_export.writers import glb_builder
from avatar_export.writers.engine_mesh import vertex_id_uv
from avatar_export.writers.residual import engine_residual
from avatar_export.writers.rig_glb import rig_glb
from avatar_export.writers.rig_poses import residual_poses
from avatar_export.writers.splats_glb import splats_glb
from avatar_runtime.avatar import Clip, SparseRows
from avatar_runtime.engine_pose import EnginePose, engine_clip, engine_pose, target_names
from avatar_runtime.io.errors import AvatarError
from avatar_runtime.pose import Pose, joint_rotation
from avatar_runtime.rotation import homogeneous, matrix_from_rotvec
from tests.avatars import JOINTS, VERTICES, full_avatar, surface_avatar
from tests.measured import Measure
from tests.oracles.gltf_pose import File, State
from tests.rigs import (
    EXACT,
    distance,
    grid_avatar,
    rig_of,
    runtime_mesh,
    sparse,
    state_of,
    strongest,
    with_rig,
    without_late,
    written,
)

Array = npt.NDArray[Any]
ROOT = Path(__file__).parents[3]


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


@pytest.mark.parametrize("seed", range(3))
def test_five_influences_are_exact_with_two_sets(seed: int, measured: Measure) -> None:
    avatar = full_avatar(seed)
    most = int(np.diff(rig_of(avatar).skin.row_ptr.astype(int)).max())
    avatar = avatar if most == 5 else with_rig(avatar, skin=sparse(np.full((VERTICES, 5), 0.2), "weight"))
    file = File(written(avatar, 8))
    for pose in map(without_late, residual_poses(avatar)):
        state = state_of(avatar, engine_pose(avatar, pose))
        off = distance(file.posed(state, sets=2), runtime_mesh(avatar, file, pose))
        measured("rig.glb: oracle against the runtime, eight influences, metres", off, EXACT)
        assert off <= EXACT


def test_clips_at_their_keys_are_engine_pose(measured: Measure) -> None:
    avatar = strongest(full_avatar(), 4)
    file = File(written(avatar))
    assert [a["name"] for a in file.json["animations"]] == ["nod", "blink"]
    for clip in avatar.clips:
        frames = engine_clip(avatar, clip)
        for k in range(clip.frames):
            state = file.state(clip.name, k / clip.fps)
            one = EnginePose(*(getattr(frames, name)[k] for name in EnginePose.__dataclass_fields__))
            off = distance(file.posed(state), file.posed(state_of(avatar, one)))
            measured("rig.glb: clip keys against engine_pose, metres", off, EXACT)
            assert off <= EXACT
            frame = Pose(
                dict(zip(avatar.expression_names, clip.expression_weights[k].tolist(), strict=True)),
                dict(zip(JOINTS, clip.joint_delta[k].astype(np.float64), strict=True)),
                world_from_avatar=clip.world_from_avatar[k].astype(np.float64),
            )
            state.weights = [
                0.0 if name in avatar.eyelids else weight
                for name, weight in zip(
                    file.target_names, np.array(list(state.weights), dtype=float).tolist(), strict=True
                )
            ]
            assert distance(file.posed(state), runtime_mesh(avatar, file, frame)) <= EXACT


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
    delta = np.tile(np.eye(4, dtype=np.float32), (6, 5, 1, 1))
    delta[3, 2] = joint_rotation([0.3, 0, 0])
    weights = np.linspace(0, 1, 24, dtype=np.float32).reshape(6, 4)
    avatar = replace(full_avatar(), clips=(still_clip(joint_delta=delta),))
    found = channels(File(written(avatar)))
    assert found == {("jaw", "rotation"), ("avatar_mesh", "weights")}  # correctives follow the jaw
    avatar = replace(avatar, clips=(still_clip(joint_delta=delta, expression_weights=weights),))
    assert channels(File(written(avatar))) == found | {("jaw", "translation")}
    grown = np.tile(np.eye(4, dtype=np.float32), (6, 5, 1, 1))
    grown[2, 4, 0, 0] = 1.5
    avatar = replace(avatar, clips=(still_clip(joint_delta=grown),))
    assert channels(File(written(avatar))) == {("rightEye", "scale")}
    world = np.tile(np.eye(4, dtype=np.float32), (6, 1, 1))
    world[:, 0, 3] = np.arange(6)
    avatar = replace(avatar, clips=(still_clip(world_from_avatar=world),))
    assert channels(File(written(avatar))) == {("avatar_root", "translation")}


def test_a_clip_in_which_nothing_moves_is_still_an_animation() -> None:
    avatar = replace(full_avatar(), clips=(still_clip(),))
    file = File(written(avatar))
    assert channels(file) == {("avatar_root", "translation")}
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


def test_a_rig_that_gltf_cannot_number_is_refused() -> None:
    joints = 65_536
    rig = rig_of(full_avatar())
    avatar = with_rig(full_avatar(), joint_names=("j",) * joints, skin=replace(rig.skin, columns=joints))
    with pytest.raises(
        AvatarError, match=r"^rig.glb: joints: has 65536 joints, but glTF holds 65535; reduce"
    ):
        rig_glb(avatar)
    with pytest.raises(ValueError, match="4 or 8"):
        rig_glb(full_avatar(), 5)


def test_there_is_no_file_where_there_is_nothing_to_show() -> None:
    assert rig_glb(surface_avatar(rigged=False)) is None
    jointless = grid_avatar(9, 1)
    jointless = with_rig(
        jointless,
        joint_names=(),
        parents=np.zeros(0, np.int32),
        rest_local=np.zeros((0, 4, 4), np.float32),
        inverse_bind_matrix=np.zeros((0, 4, 4), np.float32),
        joint_basis=np.zeros((4, 0, 3), np.float32),
        corrective_joints=np.zeros(0, np.int32),
        skin=SparseRows.empty(9, 0, {"weight": ()}),
        correctives=SparseRows.empty(9, 0, {"position": (3,)}),
    )
    assert rig_glb(jointless) is None and engine_residual(jointless)["poses"] == 0
    assert rig_glb(with_rig(full_avatar(), triangles=np.zeros((0, 3), np.uint32))) is None
    assert engine_residual(with_rig(full_avatar(), triangles=np.zeros((0, 3), np.uint32)))["poses"] == 0


def test_a_file_beyond_what_a_glb_holds_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(glb_builder, "MOST_BYTES", 10_000)
    with pytest.raises(AvatarError, match=r"^rig.glb: has \d+ bytes, but a GLB holds at most 10000"):
        written(full_avatar())


def test_the_documents_form() -> None:
    """The Khronos validator's checks of accessors, and further guarantees of the format."""
    avatar = full_avatar()
    file = File(written(avatar))
    document = file.json
    assert set(document["asset"]) == {"version", "generator"} and "extensionsUsed" not in document
    assert [document["nodes"][n]["name"] for n in document["scenes"][0]["nodes"]] == [
        "avatar_mesh",
        "avatar_root",
    ]
    assert [document["nodes"][n]["name"] for n in document["skins"][0]["joints"]] == list(JOINTS)
    assert file.target_names == list(target_names(avatar))
    assert document["materials"][0]["doubleSided"] is False
    for accessor in document["accessors"]:
        if "sparse" in accessor:
            assert "bufferView" not in accessor and "byteOffset" not in accessor
            s = accessor["sparse"]
            rows = file.raw(s["indices"]["bufferView"], s["indices"]["componentType"], s["count"], 1)[:, 0]
            assert (np.diff(rows.astype(int)) > 0).all() and rows.max() < accessor["count"]
    for index, accessor in enumerate(document["accessors"]):
        values = file.accessor(index)
        if "min" in accessor:
            assert accessor["min"] == values.min(axis=0).tolist()
            assert accessor["max"] == values.max(axis=0).tolist()
    assert sum("min" in a for a in document["accessors"]) == 1 + len(file.target_names) + 2
    ends = [v.get("byteOffset", 0) + v["byteLength"] for v in document["bufferViews"]]
    assert max(ends) <= document["buffers"][0]["byteLength"] <= len(file.binary)


def test_names_of_nodes_are_unique() -> None:
    """A joint keeps its name, for drivers look for it."""
    avatar = with_rig(full_avatar(), joint_names=("avatar_root", "avatar_mesh", "jaw", "leftEye", "rightEye"))
    names = [node["name"] for node in File(written(avatar)).json["nodes"]]
    assert names == [
        "avatar_mesh_2",
        "avatar_root_2",
        "avatar_root",
        "avatar_mesh",
        "jaw",
        "leftEye",
        "rightEye",
    ]


CODE = """
import hashlib
from avatar_export.writers.rig_glb import rig_glb
from avatar_export.writers.splats_glb import splats_glb
from tests.avatars import full_avatar
print(hashlib.sha256(b"".join([*rig_glb(full_avatar()), *splats_glb(full_avatar())])).hexdigest())
"""


def test_the_same_bytes_twice_and_in_another_process() -> None:
    first, second = (written(full_avatar()) + b"".join(splats_glb(full_avatar())) for _ in range(2))
    assert first == second
    for seed in ("1", "2"):
        run = subprocess.run(
            [sys.executable, "-c", CODE],
            cwd=ROOT,
            env={**os.environ, "PYTHONHASHSEED": seed},
            capture_output=True,
            text=True,
            check=True,
        )
        assert run.stdout.strip() == hashlib.sha256(first).hexdigest()


def test_the_mesh_has_the_colours_of_its_gaussians_in_linear_light() -> None:
    """Grey Gaussians of display value 0.5 are 0.214 in linear light; vertices that are left out take theirs along."""
    avatar = full_avatar()
    sh = np.zeros_like(avatar.gaussians.sh)
    file = File(written(replace(avatar, gaussians=replace(avatar.gaussians, sh=sh))))
    colour = file.attribute("COLOR_0")
    np.testing.assert_allclose(colour, [[0.2140411, 0.2140411, 0.2140411, 1.0]] * VERTICES, atol=1e-5)
