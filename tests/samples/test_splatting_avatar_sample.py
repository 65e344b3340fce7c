"""The SplattingAvatar samples: the trainer's layout, what its release leaves in one, and that they cover their mesh."""

from __future__ import annotations

import colorsys
import json
import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from plyfile import PlyData
from samples.make import make_body, make_splatting_head
from samples.subjects.body import PATH, load_body
from samples.subjects.head import load_head
from samples.systems.splatting_avatar import Embedded, fit_log_scale
from samples.systems.splatting_avatar_files import save_ply

from avatar_runtime.avatar import Avatar
from avatar_runtime.camera import Camera
from avatar_runtime.clips import frame_pose
from avatar_runtime.player import Player
from tests.oracles.surface_rule import splatting_avatar

RUNS = ("sample_splatting_head", "sample_splatting_head_sh3", "sample_body")
UNITS = {"sample_splatting_head": 4.0, "sample_splatting_head_sh3": 4.0, "sample_body": 1.0}
BASE = ["x", "y", "z", "nx", "ny", "nz", "f_dc_0", "f_dc_1", "f_dc_2"]
TAIL = ["opacity", "scale_0", "scale_1", "scale_2", "rot_0", "rot_1", "rot_2", "rot_3"]


class Run:
    """The files of a run, parsed by other code than wrote them."""

    def __init__(self, folder: Path, units: float) -> None:
        self.units = units
        self.config: dict[str, Any] = yaml.safe_load((folder / "run" / "config.yaml").read_text())
        files = folder / "run" / "point_cloud" / "iteration_30000"
        self.ply = PlyData.read(files / "point_cloud.ply")
        self.rows = self.ply["vertex"].data
        self.embedding = json.loads((files / "embedding.json").read_text())
        self.obj = (files / "embedding.obj").read_text()
        self.vertices = np.array(re.findall(r"^v (\S+) (\S+) (\S+)$", self.obj, re.M), float)
        corners = re.findall(r"^f (\d+)//\1 (\d+)//\2 (\d+)//\3$", self.obj, re.M)
        self.triangles = np.array(corners, int) - 1

    def columns(self, *names: str) -> np.ndarray:
        return np.stack([self.rows[name] for name in names], axis=1).astype(float)

    def listed(self, name: str) -> np.ndarray:
        return np.array(self.embedding[name])


@pytest.fixture(params=RUNS)
def run(request: pytest.FixtureRequest) -> Run:
    return Run(request.getfixturevalue(request.param), UNITS[request.param])


@pytest.fixture
def head(sample_splatting_head: Path) -> Run:
    return Run(sample_splatting_head, 4.0)


@pytest.fixture
def sh3(sample_splatting_head_sh3: Path) -> Run:
    return Run(sample_splatting_head_sh3, 4.0)


def test_layout(run: Run) -> None:
    degree = run.config["model"]["sh_degree"]
    rest = [f"f_rest_{i}" for i in range(3 * ((degree + 1) ** 2 - 1))]
    assert run.ply.byte_order == "<" and not run.ply.text
    assert list(run.rows.dtype.names) == BASE + rest + TAIL
    assert {run.rows.dtype[n].str for n in run.rows.dtype.names} == {"<f4"}
    assert run.config["pipe"]["convert_SHs_python"] is (degree > 0)
    assert list(run.embedding) == ["cano_mesh", "sample_fidxs", "sample_bary", "_xyz", "_rotation"]
    assert run.embedding["cano_mesh"] == "embedding.obj"
    n = len(run.rows)
    assert [run.listed(k).shape for k in list(run.embedding)[1:]] == [(n,), (n, 3), (n, 3), (n, 4)]
    lines = run.obj.splitlines()
    v, f = len(run.vertices), len(run.triangles)
    assert lines[:4] == [
        f"# {v} vertices",
        f"# {v} normals",
        "# 0 texture coordinates",
        f"# {f} triangles",
    ]
    number = r"-?\d+\.\d{6}"
    assert len(re.findall(rf"^vn? {number} {number} {number}$", run.obj, re.M)) == 2 * v
    assert len(lines) == 4 + 2 * v + f


def test_embedding_is_what_training_leaves(run: Run) -> None:
    fidx, bary = run.listed("sample_fidxs"), run.listed("sample_bary")
    assert fidx.min() >= 0 and fidx.max() < len(run.triangles)
    np.testing.assert_allclose(bary.sum(axis=1), 1, atol=1e-6)
    outside = (bary < 0).any(axis=1)
    assert 0 < outside.mean() < 0.03 and bary.min() >= -5.001e-4
    np.testing.assert_array_equal(run.listed("_xyz")[:, :2], 0)
    raw, stored = run.listed("_rotation"), run.columns("rot_0", "rot_1", "rot_2", "rot_3")
    length = np.linalg.norm(raw, axis=1, keepdims=True)
    assert length.min() < 0.6 and length.max() > 2.5
    np.testing.assert_allclose(np.linalg.norm(stored, axis=1), 1, atol=1e-6)
    assert stored[:, 0].min() >= 0
    sign = np.sum(raw * stored, axis=1) / length[:, 0]
    np.testing.assert_allclose(np.abs(sign), 1, atol=1e-6)
    assert 0.4 < np.mean(sign < 0) < 0.6, "half of the raw quaternions have the other sign"


def test_point_cloud_is_the_embedding_on_the_canonical_mesh(run: Run) -> None:
    corner = run.vertices[run.triangles]
    across = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    assert np.linalg.norm(across, axis=1).min() / 2 > 1e-8, "no triangle is degenerate"
    fidx, bary = run.listed("sample_fidxs"), run.listed("sample_bary")
    d, raw = run.listed("_xyz")[:, 2], run.listed("_rotation")
    xyz = run.columns("x", "y", "z")
    scale = run.columns("scale_0", "scale_1", "scale_2")
    for i in np.linspace(0, len(xyz) - 1, 12).astype(int):
        ring = np.isin(run.triangles, run.triangles[fidx[i]]).any(axis=1)  # all that the rule looks at
        at = int(ring[: fidx[i]].sum())
        position, _, _ = splatting_avatar(
            run.vertices, run.vertices, run.triangles[ring], at, bary[i], d[i], raw[i], scale[i]
        )
        np.testing.assert_allclose(xyz[i], position, atol=1.5e-7)


def test_the_canonical_mesh_is_a_posed_first_frame(head: Run, splatting_head_avatar: Avatar) -> None:
    assert splatting_head_avatar.rig is not None and splatting_head_avatar.clips[0].frames == 80
    player = Player(splatting_head_avatar)
    posed = player.mesh(frame_pose(splatting_head_avatar, splatting_head_avatar.clips[0], 0))
    np.testing.assert_allclose(posed * 4, head.vertices, atol=2e-6)
    assert np.linalg.norm(splatting_head_avatar.rig.vertices * 4 - head.vertices, axis=1).max() > 0.04


def test_take(sample_splatting_head: Path, sample_splatting_head_sh3: Path) -> None:
    plain, full = (
        json.loads((folder / "flame_params.json").read_text())
        for folder in (sample_splatting_head, sample_splatting_head_sh3)
    )
    assert set(plain) == {"intrinsics", "shape_params", "frames"} and len(plain["shape_params"]) == 100
    assert not any(plain["shape_params"]) and np.count_nonzero(full["shape_params"]) == 8
    for frame in plain["frames"]:
        assert set(frame) == {"file_path", "world_mat", "expression", "pose"}
        assert np.shape(frame["world_mat"]) == (3, 4) and len(frame["expression"]) == 50
    pose = np.array([frame["pose"] for frame in plain["frames"]])
    assert pose.shape == (80, 15)
    assert pose[:, 6].max() > 0.35 and pose[:, 6].min() < 0.05, "the jaw opens and closes"
    assert np.ptp(pose[:, 4]) > 0.4, "the neck turns"
    assert np.abs(np.diff(pose, axis=0)).max() < 0.2


def test_head_stands_off_its_mesh_to_both_sides(head: Run) -> None:
    d = head.listed("_xyz")[:, 2] / head.units
    assert 0.005 < d.max() < 0.01 and d.min() < -2e-4 and (d != 0).all()
    assert head.config["model"] == {
        "sh_degree": 0,
        "num_init_samples": 4000,
        "xyz_as_uvd": True,
        "with_mesh_scaling": True,
    }
    sigma = np.exp(head.columns("scale_0", "scale_1", "scale_2")) / head.units
    assert 1e-3 < np.median(sigma[:, :2]) < 0.01 and np.median(sigma[:, 2]) < np.median(sigma[:, 0]) / 3


@pytest.mark.parametrize("name", ["sample_splatting_head", "sample_body"])
def test_splats_lie_flat_on_the_canonical_mesh(name: str, request: pytest.FixtureRequest) -> None:
    run = Run(request.getfixturevalue(name), UNITS[name])
    w, x, y, z = (run.listed("_rotation") / np.linalg.norm(run.listed("_rotation"), axis=1, keepdims=True)).T
    third = np.stack([2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)], axis=1)
    vn = np.array(re.findall(r"^vn (\S+) (\S+) (\S+)$", run.obj, re.M), float)
    at = run.triangles[run.listed("sample_fidxs")]
    normal = np.einsum("nc,ncx->nx", run.listed("sample_bary"), vn[at])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    scale = run.columns("scale_0", "scale_1", "scale_2")
    flat = scale[:, 2] < scale[:, :2].min(axis=1) - 1  # not hair, nor the edge of the bust
    assert flat.mean() > 0.7
    degrees = np.degrees(np.arccos(np.clip(np.sum(third * normal, axis=1)[flat], -1, 1)))
    assert np.median(degrees) < 0.5 and np.percentile(degrees, 95) < 8


def test_sh_rest_is_stored_red_green_blue(tmp_path: Path) -> None:
    n = 2
    sh = np.arange(n * 16 * 3, dtype=np.float32).reshape(n, 16, 3)
    mesh = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]])
    bary, rotation = np.full((n, 3), 1 / 3, np.float32), np.ones((n, 4), np.float32)
    face, zero = np.zeros(n, int), np.zeros(n, np.float32)
    save_ply(
        Embedded(mesh, np.array([[0, 1, 2]]), face, bary, zero, rotation, rotation[:, :3], zero, sh),
        tmp_path / "x.ply",
    )
    rows = PlyData.read(tmp_path / "x.ply")["vertex"].data
    assert [rows[f"f_dc_{c}"][1] for c in range(3)] == sh[1, 0].tolist()
    assert [rows[f"f_rest_{15 * c + k}"][1] for c in range(3) for k in range(15)] == sh[
        1, 1:
    ].T.ravel().tolist()


def test_no_field_of_the_conformance_head_is_zero(sh3: Run) -> None:
    assert sh3.config["model"]["sh_degree"] == 3 and len(sh3.rows) == 1500
    for name in set(sh3.rows.dtype.names) - {"nx", "ny", "nz"}:
        assert np.ptp(sh3.rows[name]) > 0.05, name
    rest = sh3.columns(*(f"f_rest_{i}" for i in range(45)))
    assert 0.05 < rest.std() < 0.07 and (rest != 0).all()


def through(avatar: Avatar, frame: int, camera: Camera, skin: np.ndarray) -> np.ndarray:
    """What of the light gets through the near side of a posed mesh, at its vertices that face the camera.

    `skin`: mask of the triangles that count. The Gaussians of the far side are hidden, so that a hole shows.
    """
    assert avatar.embedding is not None
    player, pose = Player(avatar), frame_pose(avatar, avatar.clips[0], frame)
    vertices, triangles = player.mesh(pose).astype(float), avatar.embedding.triangles.astype(int)
    corner = vertices[triangles]
    normal = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    view = camera.centre - corner.mean(axis=1)
    facing = np.sum(normal * view, axis=1) / np.linalg.norm(view, axis=1)
    near = (facing > 0)[avatar.embedding.triangle.astype(int)]
    logit = np.where(near, avatar.gaussians.opacity_logit, np.float32(-30))
    player = Player(replace(avatar, gaussians=replace(avatar.gaussians, opacity_logit=logit)))
    rows = np.unique(triangles[skin & (facing > 0.7)])
    points = np.c_[vertices[rows], np.ones(len(rows))] @ camera.camera_from_world.T
    x = points[:, 0] / points[:, 2] / camera.tan_half_fov_x
    y = points[:, 1] / points[:, 2] / camera.tan_half_fov_y
    column = np.round(((x + 1) * camera.width - 1) / 2).astype(int)
    row = np.round(((y + 1) * camera.height - 1) / 2).astype(int)
    result: np.ndarray = player.frame(pose, camera).image.transmittance[row, column]
    return result


@pytest.mark.parametrize("frame", [0, 6, 15, 36, 54])
def test_no_hole_in_the_skin_as_it_talks(
    splatting_head_avatar: Avatar, frame: int, measured: Callable[[str, float], None]
) -> None:
    """The rule multiplies the logarithm of the scale, so stretched skin shrinks its splats: they have to be fitted."""
    head = load_head()
    centre = head.vertices[head.triangles].mean(axis=1)
    skin = head.triangles_in("face", "head") & (centre[:, 1] > -0.12) & (centre[:, 2] > 0)
    camera = Camera.orbit(np.array([0.0, -0.02, 0.05]), 0.6, 0.0, -0.2, 0.5, 320, 320)
    light = through(splatting_head_avatar, frame, camera, skin)
    assert len(light) > 3000
    measured("light through the skin, 99.5 %", float(np.percentile(light, 99.5)))
    assert np.percentile(light, 99.5) < 0.05


@pytest.mark.parametrize("frame", [0, 15, 30])
def test_no_hole_in_the_suit_as_it_walks(
    body_avatar: Avatar, frame: int, measured: Callable[[str, float], None]
) -> None:
    camera = Camera.orbit(np.array([0.0, 0.75, 0.0]), 4.0, 0.6, 0.1, 0.45, 280, 400)
    assert body_avatar.embedding is not None
    light = through(body_avatar, frame, camera, np.ones(len(body_avatar.embedding.triangles), bool))
    assert len(light) > 500
    measured("light through the suit, 95 %", float(np.percentile(light, 95)))
    assert np.percentile(light, 95) < 0.05


def rows_of_the_file() -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Triangles, positions, joints and weights as the .glb stores them: no attribute has gaps."""
    data = PATH.read_bytes()
    size = int.from_bytes(data[12:16], "little")
    document, binary = json.loads(data[20 : 20 + size]), data[28 + size :]
    primitive = document["meshes"][0]["primitives"][0]
    found = []
    for index in (
        primitive["indices"],
        *(primitive["attributes"][n] for n in ("POSITION", "JOINTS_0", "WEIGHTS_0")),
    ):
        item = document["accessors"][index]
        width = {"SCALAR": 3, "VEC3": 3, "VEC4": 4}[item["type"]]
        start = document["bufferViews"][item["bufferView"]]["byteOffset"] + item["byteOffset"]
        count = item["count"] if item["type"] == "SCALAR" else item["count"] * width
        kind = {5123: "<u2", 5126: "<f4"}[item["componentType"]]
        found.append(np.frombuffer(binary, kind, count, start).reshape(-1, width))
    triangles, position, joints, weights = found
    return triangles.astype(int), position, joints, weights


def test_body_is_the_welded_man_at_his_first_step(sample_body: Path, body_avatar: Avatar) -> None:
    run = Run(sample_body, 1.0)
    assert (sample_body / PATH.name).read_bytes() == PATH.read_bytes()
    triangles, position, joints, weights = rows_of_the_file()
    place: dict[tuple[float, ...], int] = {}
    number = [place.setdefault(tuple(p), len(place)) for p in position.tolist()]
    assert (len(position), len(place)) == (3273, 2338) == (3273, len(run.vertices))
    np.testing.assert_array_equal(np.array(number)[triangles], run.triangles)
    influence: dict[int, dict[int, float]] = {}
    for at, joint, weight in zip(number, joints.tolist(), weights.tolist(), strict=True):
        found = {j: w for j, w in zip(joint, weight, strict=True) if w}
        assert influence.setdefault(at, found) == found, "weights agree over the seams"
    edges = np.sort(np.concatenate([run.triangles[:, [i, (i + 1) % 3]] for i in range(3)]), axis=1)
    assert set(np.unique(edges, axis=0, return_counts=True)[1]) == {2}, "closed"
    posed = Player(body_avatar).mesh(frame_pose(body_avatar, body_avatar.clips[0], 0))
    np.testing.assert_allclose(posed, run.vertices, atol=2e-6)
    assert run.config["model"]["with_mesh_scaling"] is False


def test_the_man_walks_upright_towards_z() -> None:
    body = load_body()
    assert len(body.times) == 48
    for key in range(0, 48, 6):
        v = body.posed(key).vertices
        assert -0.05 < v[:, 1].min() < 0.05 and 1.4 < v[:, 1].max() < 1.55
    # The visor, a disc of the texture, looks ahead.
    uv = body.uv.mean(axis=1)
    visor = np.linalg.norm(uv - (0.65, 0.79), axis=1) < 0.1
    rest = body.posed(0)
    normal = rest.vertex_normals[body.triangles[visor]].mean(axis=(0, 1))
    assert visor.sum() > 5 and normal[2] > 0.8


def test_suit_has_the_colours_of_its_texture(sample_body: Path) -> None:
    run = Run(sample_body, 1.0)
    colour = np.clip(0.5 + 0.28209479177387814 * run.columns("f_dc_0", "f_dc_1", "f_dc_2"), 0, 1)
    hue, _, saturation = np.array([colorsys.rgb_to_hls(*c) for c in colour]).T
    vivid = saturation > 0.4
    white, blue, green = ~vivid, vivid & (np.abs(hue - 0.58) < 0.05), vivid & (np.abs(hue - 0.25) < 0.05)
    assert 0.5 < white.mean() < 0.9 and blue.mean() > 0.08 and green.mean() > 0.05
    assert (white | blue | green).mean() > 0.97


def test_fitted_scales_lie_between_least_squares_and_cover() -> None:
    wanted = np.log(np.array([0.008, 0.01]))[:, None, None]
    ratio = np.array([[1.0], [1.2]])
    none, all_, much = np.zeros(1), np.ones(1), np.full(1, 9.0)
    loose = fit_log_scale(wanted, ratio, none, much)[0, 0]
    grid = np.linspace(-6, -3, 30001)
    error = [np.sum((x * ratio[:, 0] - wanted[:, 0, 0]) ** 2) for x in grid]
    assert abs(grid[int(np.argmin(error))] - loose) < 2e-4
    tight = fit_log_scale(wanted, ratio, all_, much)[0, 0]
    np.testing.assert_allclose(tight, np.log(0.01) / 1.2)
    assert (tight * ratio >= wanted[:, 0] - 1e-9).all()
    held = fit_log_scale(wanted, ratio, all_, np.full(1, 0.1))[0, 0]
    np.testing.assert_allclose(np.max(held * ratio[:, 0] - wanted[:, 0, 0]), 0.1, atol=1e-12)


def test_same_bytes_every_time(tmp_path: Path) -> None:
    for name, make in {
        "head": lambda out: make_splatting_head(out, 300, sh_degree=1, full=True),
        "body": lambda out: make_body(out, 300),
    }.items():
        first, second = (make(tmp_path / name / k) for k in "ab")
        files = sorted(path.relative_to(first) for path in first.rglob("*") if path.is_file())
        assert len(files) > 4
        for file in files:
            assert (first / file).read_bytes() == (second / file).read_bytes(), file
