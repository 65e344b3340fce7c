"""Rigs under embedded Gaussians: from a rig file, from a body model with tracked poses, or none."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from avatar_export.clips.poses import clip_poses, rig_avatar
from avatar_export.notes.text import stored
from avatar_export.options import ReadOptions
from avatar_export.rigs.embedded_rig import EmbeddedRig, embedded_rig
from avatar_runtime.player import Player
from tests.exporter.bodies import body_files
from tests.exporter.bodies.body_files import FLAME_PARENTS
from tests.exporter.refusals import refused
from tests.exporter.rigs import rig_files
from tests.measured import Measure
from tests.oracles.lbs import posed_vertices

METRES = 1e-6
SHEET = rig_files.sheet().astype("u4")


def _glb(folder: Path, **options: Any) -> Path:
    path = folder / "made.glb"
    path.write_bytes(rig_files.rig_glb(rig_files.split(), **options))
    return path


def _played(found: EmbeddedRig, clip: int = 0) -> list[np.ndarray]:
    assert found.rig is not None
    avatar = rig_avatar(found.rig, found.expressions)
    player = Player(avatar)
    return [player.mesh(pose) for pose in clip_poses(avatar, found.clips[clip])]


@pytest.mark.parametrize("ids", [None, "uv"])
def test_a_rig_file(tmp_path: Path, ids: str | None) -> None:
    path = _glb(tmp_path, ids=ids, lying=True)
    if ids:
        vertices, triangles, order = rig_files.posed(0, 0), rig_files.sheet(), np.arange(63)
    else:
        vertices, triangles, order = rig_files.shuffled(rig_files.posed(0, 0))
    vertices = np.round(vertices, 6).astype("f4")
    found = embedded_rig(vertices, triangles.astype("u4"), ReadOptions(rig=path), "me")
    assert found.rig is not None and len(found.rig.vertices) == len(vertices)
    np.testing.assert_array_equal(found.rig.triangles, triangles)
    assert tuple(e.name for e in found.expressions) == rig_files.MORPHS
    assert [(c.name, c.frames) for c in found.clips] == [("nod", rig_files.FRAMES)]
    assert (found.driving.mode, found.driving.head_joint) == ("names", "head")
    assert found.head_pose_in == "mesh" and found.files == {"rig/made.glb": path}
    assert ("the vertex ids in the file" if ids else "their connectivity") in str(stored(found.notes))
    used = np.unique(triangles)
    for frame, played in enumerate(_played(found)):
        share = frame / (rig_files.FRAMES - 1)
        want = rig_files.posed(share * rig_files.ANGLE, share)[order]
        np.testing.assert_allclose(played[used], want[used], atol=METRES)


def test_a_mesh_in_no_pose_of_the_rig_is_said(tmp_path: Path) -> None:
    vertices = (1.5 * rig_files.posed(0.4, 0)).astype("f4")
    found = embedded_rig(vertices, SHEET, ReadOptions(rig=_glb(tmp_path)), "me")
    assert found.notes[-1].doubtful


def _flame(folder: Path) -> tuple[dict[str, Any], dict[str, Any], Path, Path]:
    model, p = body_files.body(FLAME_PARENTS), body_files.poses(5)
    p["translation"][:] = 0
    body = body_files.write_body(folder / "body.npz", model)
    return model, p, body, body_files.flame_json(folder / "flame_params.json", p)


def _at(model: dict[str, Any], p: dict[str, Any], t: int) -> Any:
    return posed_vertices(model, p["shape"], p["expression"][t], p["rotation"][t], p["translation"][t])


def test_flame_with_tracked_poses(tmp_path: Path, measured: Measure) -> None:
    model, p, body, poses = _flame(tmp_path)
    canonical = (np.round(4 * _at(model, p, 0), 6) / 4).astype("f4")
    triangles = body_files.sheet()[::-1].astype("u4")
    found = embedded_rig(canonical, triangles, ReadOptions(body_model=body, poses=poses), "me")
    assert found.rig is not None
    np.testing.assert_array_equal(found.rig.triangles, triangles)
    assert found.driving.mode == "none" and found.driving.head_joint == "neck"
    assert found.driving.left_eye_joint == "leftEye"
    assert [(c.name, c.fps, c.frames) for c in found.clips] == [("flame_params", 25, body_files.FRAMES)]
    assert found.files == {"body_model/body.npz": body, "poses/flame_params.json": poses}
    for said in ("25 frames a second", "the same numbering", "0.000"):
        assert said in str(stored(found.notes))
    for t, played in enumerate(_played(found)):
        off = np.abs(played - _at(model, p, t)).max()
        measured("embedded FLAME against plain LBS m", off, METRES)
        assert off < METRES


def test_the_identity_of_shape_goes_before_that_of_poses(tmp_path: Path) -> None:
    model, p, body, poses = _flame(tmp_path)
    np.save(tmp_path / "shape.npy", 2 * p["shape"])
    options = ReadOptions(body_model=body, poses=poses, shape=tmp_path / "shape.npy")
    doubled = {**p, "shape": 2 * p["shape"]}
    found = embedded_rig(_at(model, doubled, 0).astype("f4"), SHEET, options, "me")
    np.testing.assert_allclose(_played(found)[2], _at(model, doubled, 2), atol=METRES)
    assert found.files["shape/shape.npy"] == tmp_path / "shape.npy"
    mean = embedded_rig(_at(model, p, 0).astype("f4"), SHEET, replace(options, shape=Path("zero")), "me")
    np.testing.assert_allclose(_played(mean)[2], _at(model, {**p, "shape": []}, 2), atol=METRES)


def test_what_a_data_set_folder_holds(tmp_path: Path) -> None:
    model, p, body, _ = _flame(tmp_path)
    canonical = _at(model, p, 0).astype("f4")
    (tmp_path / "data" / "train").mkdir(parents=True)
    body.rename(tmp_path / "data" / "body_model.npz")
    (tmp_path / "flame_params.json").rename(tmp_path / "data" / "train" / "flame_params.json")
    found = embedded_rig(canonical, SHEET, ReadOptions(dataset=tmp_path / "data"), "me")
    assert set(found.files) == {"body_model/body_model.npz", "poses/flame_params.json"}
    np.testing.assert_allclose(_played(found)[4], _at(model, p, 4), atol=METRES)


def test_poses_on_a_rig_file(tmp_path: Path) -> None:
    path = _glb(tmp_path)
    pose = np.zeros((2, 72))
    pose[1, 45:48] = (0, 0, rig_files.ANGLE)  # joint 15 of SMPL: head
    np.savez(tmp_path / "poses.npz", thetas=pose)
    options = ReadOptions(rig=path, poses=tmp_path / "poses.npz")
    found = embedded_rig(rig_files.vertices(), SHEET, options, "me")
    assert [clip.name for clip in found.clips] == ["poses", "nod"]
    used = np.unique(SHEET)
    np.testing.assert_allclose(
        _played(found)[1][used], rig_files.posed(rig_files.ANGLE, 0)[used], atol=METRES
    )


def test_what_cannot_be(tmp_path: Path) -> None:
    vertices = rig_files.vertices()
    path = _glb(tmp_path)
    for options, message in (
        ({"rig": path, "body_model": path}, "--rig and --body-model both give a rig"),
        ({"rig": tmp_path / "no.glb"}, r"no\.glb: --rig: no such file"),
        ({"body_model": tmp_path / "no.pkl"}, "--body-model: no such file"),
        ({"poses": tmp_path / "no.npz"}, "--poses needs a rig"),
        ({"dataset": tmp_path / "no"}, "--dataset: no such folder"),
    ):
        refused(f"^me: .*{message}", embedded_rig, vertices, SHEET, ReadOptions(**options), "me")
    says = r"^me: .*made\.glb: the mesh has 6\d vertices in 91 triangles"
    refused(says, embedded_rig, vertices, SHEET[1:], ReadOptions(rig=path), "me")
    body = body_files.write_body(tmp_path / "body.npz", body_files.body(FLAME_PARENTS))
    short = body_files.flame_param(tmp_path / "flame_param.npz", body_files.poses(5), np.zeros((60, 3)))
    options = ReadOptions(body_model=body, poses=short)
    refused("static_offset: has 60 vertices, .* 63", embedded_rig, vertices, SHEET, options, "me")
