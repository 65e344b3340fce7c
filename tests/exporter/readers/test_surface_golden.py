"""SplattingAvatar and GaussianAvatars as their released codes compute them: checkpoint in, posed splats out.

Every case is read twice, as trained in metres (u = 1) and as trained in units of which four make a metre: the
same numbers must come out, in training units.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from avatar_export.notes.text import DOUBTFUL
from avatar_export.options import ReadOptions
from avatar_export.readers.table import read
from avatar_runtime.avatar import Avatar
from avatar_runtime.player import Player
from avatar_runtime.pose import Pose
from avatar_runtime.stages.activate import Splats
from avatar_runtime.stages.project import splat_colour
from tests.golden import (
    HEAD_SURFACE_CASES,
    ON,
    SMALL_SURFACE_CASES,
    SurfaceCase,
    head_surface_case,
    unpack_surface_cases,
)
from tests.measured import Measure

Array = Any
SPLATTING, GAUSSIAN = "splatting_avatar/", "gaussian_avatars/"
XYZ, DEGREES, SCALE, COLOUR = 1e-6, 5e-4, 1e-5, 1e-6
UNITS = (1.0, 4.0)
# Half a turn with an expression: triangle quaternions of opposite sign nearly cancel, and the released code's own
# float32 sum is off by more than elsewhere: 1 of 2000 colours lies 1.07e-6 away from the same sum in float64.
CANCELLED = {("splatting_avatar/head_x4_face_sh3", "rotY170_jawOpen_smile"): 1.2e-6}


@pytest.fixture(scope="module")
def committed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("surface_cases")
    unpack_surface_cases(folder)
    return folder


@pytest.fixture(params=SMALL_SURFACE_CASES + HEAD_SURFACE_CASES)
def name(request: pytest.FixtureRequest) -> str:
    value: str = request.param
    return value


@pytest.fixture
def case(name: str, committed: Path) -> SurfaceCase:
    if name in SMALL_SURFACE_CASES:
        return SurfaceCase(committed / name, None)
    return head_surface_case(name)


def degrees(a: Array, b: Array) -> float:
    """Largest angle between rotations [N, 4], signs aside."""
    a, b = (np.asarray(q, np.float64) / np.linalg.norm(q, axis=1, keepdims=True) for q in (a, b))
    chord = np.minimum(np.linalg.norm(a - b, axis=1), np.linalg.norm(a + b, axis=1))
    return float(np.degrees(4 * np.arcsin(np.minimum(chord / 2, 1))).max())


def worst(a: Array, b: Array) -> float:
    return float(np.abs(np.asarray(a, np.float64) - b).max())


def mesh_file(case: SurfaceCase, folder: Path, u: float) -> Path:
    """The mesh that GaussianAvatars' Gaussians sit on, in metres; any pose of it may be canonical."""
    path = folder / "mesh.npz"
    pose = "template" if case.poses is None else "jawOpen_smile"
    np.savez(path, vertices=case.posed_vertices(pose) / u, faces=case.triangles())
    return path


def avatar(case: SurfaceCase, tmp_path: Path, u: float, **options: Any) -> Avatar:
    if GAUSSIAN in case.folder.as_posix():
        options["mesh"] = mesh_file(case, tmp_path, u)
    return read(case.run, ReadOptions(units=u, **options))


def posed(played: Avatar, case: SurfaceCase, pose: str, u: float, backend: str) -> Splats:
    vertices = (case.posed_vertices(pose) / u).astype(np.float32)
    return Player(played, backend).animate(Pose(), posed_vertices=vertices)


def colour_error(splats: Splats, expected: Array, eyes: Array, u: float) -> float:
    degree = {1: 0, 16: 3}[splats.sh.shape[1]]
    return max(
        worst(splat_colour(splats, (eye / u).astype(np.float32), degree), want)
        for eye, want in zip(eyes, expected, strict=True)
    )


@pytest.mark.parametrize("u", UNITS)
def test_every_pose(
    case: SurfaceCase, name: str, u: float, backend: str, tmp_path: Path, measured: Measure
) -> None:
    static, system = case.static(), name.split("/")[0] + ON[backend]
    played = avatar(case, tmp_path, u)
    inner = avatar(case, tmp_path, u, sh_direction="inverse_rotation") if SPLATTING in name else played
    for pose in case.pose_names():
        expected, splats = case.expected(pose), posed(played, case, pose, u, backend)
        scale = expected["scale_on" if SPLATTING in name else "scale"]
        figures = {
            "xyz": (worst(splats.mean * np.float64(u), expected["xyz"]), XYZ),
            "rotation, degrees": (degrees(splats.quat_wxyz, expected["rotation"]), DEGREES),
            "scale, relative": (worst(splats.scale * np.float64(u) / scale, 1), SCALE),
            "opacity": (worst(splats.opacity, static["opacity"].reshape(-1)), 1e-6),
        }
        limit = CANCELLED.get((name, pose), COLOUR)
        if "rgb_world_direction" in expected:
            eyes = static["camera_centres"]
            turned = posed(inner, case, pose, u, backend)
            inside = colour_error(turned, expected["rgb_embedded_direction"], eyes, u)
            figures["colour along R^T d"] = (inside, limit)
            figures["colour"] = (colour_error(splats, expected["rgb_world_direction"], eyes, u), COLOUR)
        elif "rgb" in expected:
            figures["colour"] = (colour_error(splats, expected["rgb"], static["camera_centres"], u), COLOUR)
        else:
            plain = splat_colour(splats, np.zeros(3, np.float32), 0)
            figures["colour"] = (worst(plain, static["rgb"]), COLOUR)
        for what, (error, most) in figures.items():
            note = " (half a turn)" if what == "colour along R^T d" and limit > COLOUR else ""
            measured(f"{system}, {what}{note}", error, most)
            assert error <= most, (name, pose, what)


@pytest.mark.parametrize("u", UNITS)
def test_older_signs(case: SurfaceCase, u: float, backend: str, tmp_path: Path, measured: Measure) -> None:
    poses = [pose for pose in case.pose_names() if "rotation_alt" in case.expected(pose)]
    if not poses:
        return
    older = avatar(case, tmp_path, u, quaternion_sign="largest_positive")
    differs = False
    for pose in poses:
        expected, splats = case.expected(pose), posed(older, case, pose, u, backend)
        error = degrees(splats.quat_wxyz, expected["rotation_alt"])
        measured(f"splatting_avatar{ON[backend]}, older sign policy, degrees", error, DEGREES)
        assert error <= DEGREES, pose
        differs |= degrees(expected["rotation"], expected["rotation_alt"]) > 1
    assert differs, "the vectors tell the two policies apart"


def test_without_mesh_scaling(case: SurfaceCase, backend: str, tmp_path: Path) -> None:
    if GAUSSIAN in case.folder.as_posix():
        return
    still = avatar(case, tmp_path, 4.0, mesh_scaling=False)
    for pose in case.pose_names():
        splats = posed(still, case, pose, 4.0, backend)
        assert worst(splats.scale * 4.0 / case.static()["scale_off"], 1) <= SCALE


def test_the_checkpoint_raises_no_doubt(case: SurfaceCase, name: str, tmp_path: Path) -> None:
    """Of a mesh of 20 triangles, too: its Gaussians lie 8 % of its size away, less than an edge is long."""
    read_case = avatar(case, tmp_path, 4.0 if "_x4_" in name else 1.0)
    assert [note for note in read_case.provenance["notes"] if note.startswith(DOUBTFUL)] == []
