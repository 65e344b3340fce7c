"""rig.glb in three.js, Babylon.js and Blender: the same vertices in the same order, posed as engine_pose says."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from avatar_export.writers.residual import engine_residual
from avatar_export.writers.rig_poses import residual_poses
from avatar_runtime.avatar import Avatar
from avatar_runtime.engine_pose import engine_pose, target_names
from avatar_runtime.player import Player
from tests.interop.clients import ROOT_NODE, Answer, ask, job_pose, oracle_state
from tests.interop.rigs import POSES, RigFile, clip_frames, clip_poses, random_poses, rig_file, with_odd_names
from tests.measured import Measure
from tests.oracles.gltf_pose import File
from tests.rigs import strongest, written

Array = npt.NDArray[np.float64]

TOLERANCE = 1e-5  # of the mesh's height
RIGS = (
    "full/4",
    "full/8",
    *(f"{name}/4" for name in ("odd_names", "blendshapes", "lam", "splatting_head_sh3")),
)
RIGS += ("body/4", "asm/4")
CLIENTS = ("three", "babylon", "blender")
FOUR_ONLY = {("three", "full/8")}  # tested on its own below


@dataclass(frozen=True)
class Asked:
    """A client, the rig.glb that it was given, and its answer."""

    client: str
    given: RigFile
    answer: Answer

    def vertex_ids(self) -> npt.NDArray[np.int64]:
        """[v] rows of rig.safetensors, from the UV copy."""
        u, v = self.answer.rows("attribute/uv", 2).astype(np.int64).T
        return u + 256 * (np.where(v < 0, 1 - v, v) - 2)  # Blender flips v

    def worst(self, name: str, expected: Array) -> float:
        """Largest coordinate error of posed vertices, in parts of the mesh's height."""
        return float(np.abs(self.answer.rows(name) - expected).max()) / self.given.height


@pytest.fixture(scope="session")
def rig_files(avatars: Mapping[str, Avatar], tmp_path_factory: pytest.TempPathFactory) -> dict[str, RigFile]:
    rigged = {**avatars, "odd_names": with_odd_names(avatars["full"])}
    files = {}
    for rig in RIGS:
        name, influences = rig.split("/")
        files[rig] = rig_file(rigged[name], int(influences), tmp_path_factory.mktemp(name))
    return files


def cases() -> Iterator[Any]:
    """Every client with every rig that it can show in full."""
    for client in CLIENTS:
        for rig in RIGS:
            if (client, rig) not in FOUR_ONLY:
                marks = [pytest.mark.bpy] if client == "blender" else []
                yield pytest.param((client, rig), id=f"{client}-{rig}", marks=marks)


@pytest.fixture(scope="session", params=list(cases()))
def asked(request: pytest.FixtureRequest, rig_files: dict[str, RigFile]) -> Asked:
    client, rig = request.param
    return put(client, rig_files[rig])


def put(client: str, given: RigFile) -> Asked:
    """Ask a client for all poses of a rig and some frames of its clips."""
    avatar = given.avatar
    return Asked(
        client,
        given,
        ask(
            f"{client}_rig",
            glb=str(given.path),
            poses=[
                job_pose(avatar, engine_pose(avatar, pose))
                for pose in (*random_poses(avatar), *residual_poses(avatar))
            ],
            clips=[
                {"clip": clip.name, "times": [k / clip.fps for k in clip_frames(clip)]}
                for clip in avatar.clips
            ],
        ),
    )


def test_names_arrive(asked: Asked) -> None:
    facts, avatar = asked.answer.facts, asked.given.avatar
    # Babylon.js takes the node that skin.skeleton names for a bone too.
    assert [name for name in facts["joints"] if name != ROOT_NODE] == list(asked.given.rig.joint_names)
    assert facts["targets"] == list(target_names(avatar))
    assert sorted(facts["clips"]) == sorted(clip.name for clip in avatar.clips)


def test_vertex_ids_arrive_and_name_the_vertices(asked: Asked) -> None:
    rows, rig = asked.vertex_ids(), asked.given.rig
    assert len(rows) == asked.answer.facts["vertices"]
    # Blender goes through its own bind pose; the others hand the file's floats on.
    rounding = 1e-6 * np.abs(rig.vertices).max() if asked.client == "blender" else 0
    np.testing.assert_allclose(
        asked.answer.rows("attribute/position"), rig.vertices[rows], rtol=0, atol=rounding
    )
    if asked.client != "babylon":  # which has no room for attributes with other names
        np.testing.assert_array_equal(asked.answer.arrays["attribute/_vertex_id"], rows)


def test_order_of_vertices_triangles_and_corners_is_kept(asked: Asked) -> None:
    rows, rig = asked.vertex_ids(), asked.given.rig
    assert (np.diff(rows) > 0).all()
    shown = rows[asked.answer.rows("triangles").astype(np.int64)]
    left = iter(rig.triangles.tolist())
    assert all(triangle in left for triangle in shown.tolist())  # a subsequence of the rig's triangles
    used = {*map(tuple, np.sort(shown, axis=1).tolist())}
    missing = [t for t in np.sort(rig.triangles, axis=1).tolist() if tuple(t) not in used]
    a, b, c = np.moveaxis(rig.vertices[np.array(missing, np.int64).reshape(-1, 3)].astype(np.float64), 1, 0)
    assert (np.cross(b - a, c - a) == 0).all()  # only triangles without area are left out


def test_posed_vertices(asked: Asked, measured: Measure) -> None:
    given, sets = asked.given, asked.given.influences // 4
    for k, pose in enumerate(random_poses(given.avatar)):
        expected = given.file.posed(oracle_state(given.avatar, engine_pose(given.avatar, pose)), sets)
        error = asked.worst(f"pose/{k}", expected)
        measured(f"rig.glb posed in {asked.client}, parts of height", error, TOLERANCE)
        assert error <= TOLERANCE


def test_residual_is_as_stated(asked: Asked, measured: Measure) -> None:
    """Against the runtime's mesh a client shows the error that the manifest states, not a larger one."""
    avatar, rows = asked.given.avatar, asked.vertex_ids()
    stated_mm = engine_residual(avatar, asked.given.influences)["residual_mm"]
    player = Player(avatar)
    worst_mm = max(
        1e3 * float(np.linalg.norm(asked.answer.rows(f"pose/{k}") - player.mesh(pose)[rows], axis=1).max())
        for k, pose in enumerate(residual_poses(avatar), start=POSES)
    )
    measured(f"rig.glb in {asked.client} from the runtime's mesh, mm", worst_mm)
    assert abs(worst_mm - stated_mm) <= 1e-3 + 1e3 * TOLERANCE * asked.given.height


def test_clips_play(asked: Asked, measured: Measure) -> None:
    """Keys of each clip, by the client's own animation system."""
    given, sets = asked.given, asked.given.influences // 4
    for clip in given.avatar.clips:
        for k, pose in enumerate(clip_poses(given.avatar, clip)):
            expected = given.file.posed(oracle_state(given.avatar, engine_pose(given.avatar, pose)), sets)
            error = asked.worst(f"clip/{clip.name}/{k}", expected)
            measured(f"clips of rig.glb in {asked.client}, parts of height", error, TOLERANCE)
            assert error <= TOLERANCE


def test_three_shows_the_strongest_four_of_eight(rig_files: dict[str, RigFile]) -> None:
    """It knows JOINTS_0 alone and makes its weights add up to 1: the strongest four, not the four that fit best."""
    asked = put("three", rig_files["full/8"])
    avatar = asked.given.avatar
    four = File(written(strongest(avatar, 4)))
    assert (asked.given.file.attribute("WEIGHTS_1") > 0).any()
    for k, pose in enumerate(random_poses(avatar)):
        expected = four.posed(oracle_state(avatar, engine_pose(avatar, pose)))
        assert asked.worst(f"pose/{k}", expected) <= TOLERANCE


def test_clients_have_the_pinned_versions(asked: Asked) -> None:
    if asked.client != "blender":  # any that is installed
        assert asked.answer.facts["version"] == {"three": "187", "babylon": "9.34.0"}[asked.client]
