"""Rigs under embedded Gaussians: from a rig file, from a body model with tracked poses, or none."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from avatar_export.clips.poses import clip_poses, rig_avatar
from avatar_export.clips.sources import clips_from
from avatar_export.notes.note import fact
from avatar_export.options import ReadOptions
from avatar_export.rigs.embedded_rig import EmbeddedRig, embedded_rig, no_rig
from avatar_export.rigs.rig_file import read_rig_file
from avatar_runtime.io.errors import AvatarError
from avatar_runtime.player import Player
from tests.exporter.bodies import body_files
from tests.exporter.bodies.body_files import FLAME_PARENTS, SMPL_PARENTS
from tests.exporter.rigs import rig_files
from tests.measured import Measure
from tests.oracles.lbs import posed_vertices
from tests.shared_data import shared

METRES = 1e-6


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
    """The mesh is the posed first frame, to six decimals and in another order; the rig comes split and shuffled."""
    path = _glb(tmp_path, ids=ids, lying=True)
    if ids:
        vertices, triangles, order = rig_files.posed(0, 0), rig_files.sheet(), np.arange(63)
    else:
        vertices, triangles, order = rig_files.shuffled_mesh(rig_files.posed(0, 0))
    vertices = np.round(vertices, 6).astype("f4")
    found = embedded_rig(vertices, triangles.astype("u4"), ReadOptions(rig=path), "me")
    assert found.rig is not None and len(found.rig.vertices) == len(vertices)
    np.testing.assert_array_equal(found.rig.triangles, triangles)
    assert [(e.name, e.aliases) for e in found.expressions] == [
        ("AK_25_JawOpen", ("jawOpen",)),
        ("smile", ()),
    ]
    assert [(c.name, c.frames) for c in found.clips] == [("nod", rig_files.FRAMES)]
    assert (found.driving.mode, found.driving.head_joint) == ("names", "head")
    assert found.head_pose_in == "mesh" and found.files == {"rig/made.glb": path}
    how = "the vertex ids in the file" if ids else "their connectivity"
    assert found.notes[0] == fact("vertices_found", file="made.glb", how=how)
    assert found.notes[1].kind == "rig_fits" and found.notes[1].values["far"] < 2e-3
    used = np.unique(triangles)
    for frame, played in enumerate(_played(found)):
        share = frame / (rig_files.FRAMES - 1)
        want = rig_files.posed(share * rig_files.ANGLE, share)[order]
        np.testing.assert_allclose(played[used], want[used], atol=METRES)


def test_a_mesh_in_no_pose_of_the_rig_is_said(tmp_path: Path) -> None:
    vertices = (1.5 * rig_files.posed(0.4, 0)).astype("f4")
    found = embedded_rig(vertices, rig_files.sheet().astype("u4"), ReadOptions(rig=_glb(tmp_path)), "me")
    assert (found.notes[-1].kind, found.notes[-1].severity) == ("rig_off", "doubt")


def test_another_mesh_is_refused_by_name(tmp_path: Path) -> None:
    triangles = rig_files.sheet().astype("u4")[1:]
    with pytest.raises(AvatarError, match=r"^me: .*made\.glb: the mesh has 6\d vertices in 91 triangles"):
        embedded_rig(rig_files.vertices(), triangles, ReadOptions(rig=_glb(tmp_path)), "me")


def _flame(folder: Path) -> tuple[dict[str, Any], dict[str, Any], Path, Path]:
    model, p = body_files.body(FLAME_PARENTS), body_files.poses(5)
    p["translation"][:] = 0
    body = body_files.write_body(folder / "body.npz", model)
    return model, p, body, body_files.flame_json(folder / "flame_params.json", p)


def _at(model: dict[str, Any], p: dict[str, Any], t: int, offset: Any = None) -> Any:
    return posed_vertices(
        model, p["shape"], p["expression"][t], p["rotation"][t], p["translation"][t], offset
    )


def test_flame_with_tracked_poses(tmp_path: Path, measured: Measure) -> None:
    """As SplattingAvatar's heads: the first frame times 4 as text of six decimals, divided by 4 again."""
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
    assert found.notes[:2] == (
        fact("rate_assumed", file="flame_params.json", fps=25),
        fact("vertices_found", file="body.npz", how="the same numbering"),
    )
    assert (
        found.notes[2].values["when"] == "in frame 0 of 'flame_params'"
        and found.notes[2].values["far"] < 1e-3
    )
    for t, played in enumerate(_played(found)):
        off = np.abs(played - _at(model, p, t)).max()
        measured("embedded FLAME against plain LBS m", off, METRES)
        assert off < METRES


def test_smpl_renumbered(tmp_path: Path) -> None:
    model, p = body_files.body(SMPL_PARENTS), body_files.poses(24)
    p["expression"][:] = 0
    options = ReadOptions(
        body_model=body_files.write_body(tmp_path / "body.npz", model),
        poses=body_files.smpl_npz(tmp_path / "poses.npz", p, True),
    )
    order = np.random.default_rng(1).permutation(len(model["v_template"]))
    local = np.argsort(order)
    canonical = _at(model, p, 0)[order].astype("f4")
    found = embedded_rig(canonical, local[body_files.sheet()].astype("u4"), options, "me")
    assert found.notes[1].values["how"] == "the order of the triangles"
    used = local[np.unique(body_files.sheet())]
    for t, played in enumerate(_played(found)):
        np.testing.assert_allclose(played[used], _at(model, p, t)[order][used], atol=METRES)


def test_static_offset_of_gaussian_avatars(tmp_path: Path) -> None:
    model, p = body_files.body(FLAME_PARENTS), body_files.poses(5)
    body = body_files.write_body(tmp_path / "body.npz", model)
    offset = np.random.default_rng(3).normal(0, 0.01, model["v_template"].shape)
    poses = body_files.flame_param(tmp_path / "flame_param.npz", p, offset)
    canonical, triangles = _at(model, p, 0, offset).astype("f4"), body_files.sheet().astype("u4")
    found = embedded_rig(canonical, triangles, ReadOptions(body_model=body, poses=poses), "me")
    np.testing.assert_allclose(_played(found)[3], _at(model, p, 3, offset), atol=METRES)
    short = body_files.flame_param(tmp_path / "flame_param.npz", p, offset[:60])
    with pytest.raises(AvatarError, match="static_offset: has 60 vertices, but the body model has 63"):
        embedded_rig(canonical, triangles, ReadOptions(body_model=body, poses=short), "me")


def test_the_identity_of_shape_goes_before_that_of_poses(tmp_path: Path) -> None:
    model, p, body, poses = _flame(tmp_path)
    np.save(tmp_path / "shape.npy", 2 * p["shape"])
    options = ReadOptions(body_model=body, poses=poses, shape=tmp_path / "shape.npy")
    triangles = body_files.sheet().astype("u4")
    doubled = {**p, "shape": 2 * p["shape"]}
    found = embedded_rig(_at(model, doubled, 0).astype("f4"), triangles, options, "me")
    np.testing.assert_allclose(_played(found)[2], _at(model, doubled, 2), atol=METRES)
    assert found.files["shape/shape.npy"] == tmp_path / "shape.npy"
    mean = embedded_rig(_at(model, p, 0).astype("f4"), triangles, replace(options, shape=Path("zero")), "me")
    np.testing.assert_allclose(_played(mean)[2], _at(model, {**p, "shape": []}, 2), atol=METRES)


def test_a_body_model_alone(tmp_path: Path) -> None:
    model, _, body, _ = _flame(tmp_path)
    found = embedded_rig(
        model["v_template"], body_files.sheet().astype("u4"), ReadOptions(body_model=body), "me"
    )
    kinds = ["mean_identity", "vertices_found", "rig_fits", "not_human_if_metres"]
    assert found.clips == () and [note.kind for note in found.notes] == kinds


def test_what_a_data_set_folder_holds(tmp_path: Path) -> None:
    model, p, body, _ = _flame(tmp_path)
    canonical, triangles = _at(model, p, 0).astype("f4"), body_files.sheet().astype("u4")
    (tmp_path / "data" / "train").mkdir(parents=True)
    body.rename(tmp_path / "data" / "body_model.npz")
    (tmp_path / "flame_params.json").rename(tmp_path / "data" / "train" / "flame_params.json")
    found = embedded_rig(canonical, triangles, ReadOptions(dataset=tmp_path / "data"), "me")
    assert set(found.files) == {"body_model/body_model.npz", "poses/flame_params.json"}
    np.testing.assert_allclose(_played(found)[4], _at(model, p, 4), atol=METRES)


def test_poses_on_a_rig_file(tmp_path: Path) -> None:
    """A rig file of a body model: the tracked poses come first, the file's own clips after them."""
    path = _glb(tmp_path)
    pose = np.zeros((2, 72))
    pose[1, 45:48] = (0, 0, rig_files.ANGLE)  # joint 15 of SMPL: head
    np.savez(tmp_path / "poses.npz", thetas=pose)
    triangles = rig_files.sheet().astype("u4")
    options = ReadOptions(rig=path, poses=tmp_path / "poses.npz")
    found = embedded_rig(rig_files.vertices(), triangles, options, "me")
    assert [clip.name for clip in found.clips] == ["poses", "nod"]
    used = np.unique(triangles)
    np.testing.assert_allclose(
        _played(found)[1][used], rig_files.posed(rig_files.ANGLE, 0)[used], atol=METRES
    )


def test_no_rig(tmp_path: Path) -> None:
    vertices, triangles = rig_files.vertices(), rig_files.sheet().astype("u4")
    for found in (no_rig(), embedded_rig(vertices, triangles, ReadOptions(), "me")):
        assert found.rig is None and found.expressions == () and found.clips == () and found.files == {}
        assert [note.kind for note in found.notes] == ["no_rig_given"]


def test_what_cannot_be(tmp_path: Path) -> None:
    vertices, triangles = rig_files.vertices(), rig_files.sheet().astype("u4")
    path = _glb(tmp_path)
    for options, message in (
        (ReadOptions(rig=path, body_model=path), "me: --rig and --body-model both give a rig"),
        (ReadOptions(rig=tmp_path / "no.glb"), r"me: .*no\.glb: --rig: no such file"),
        (ReadOptions(body_model=tmp_path / "no.pkl"), "--body-model: no such file"),
        (ReadOptions(poses=tmp_path / "no.npz"), "--poses needs a rig"),
        (ReadOptions(dataset=tmp_path / "no"), "--dataset: no such folder"),
    ):
        with pytest.raises(AvatarError, match=message):
            embedded_rig(vertices, triangles, options, "me")


def test_cesium_man_walks(measured: Measure) -> None:
    """Welded at his seams, posed as his walk begins, written in another order: he walks as the original does."""
    path = shared("gltf/CesiumMan.glb")
    original = rig_avatar(read_rig_file(path).rig, ())
    assert original.rig is not None
    (walk,) = clips_from(original, path)
    player = Player(original)
    frames = [player.mesh(pose) for pose in clip_poses(original, walk)]
    _, first, weld = np.unique(original.rig.vertices, axis=0, return_index=True, return_inverse=True)
    rng = np.random.default_rng(1)
    order = rng.permutation(len(first))
    triangles = np.argsort(order)[weld.reshape(-1)[original.rig.triangles.astype(int)]]
    canonical = np.round(frames[0][first[order]], 6).astype("f4")
    options = ReadOptions(rig=path)
    found = embedded_rig(canonical, rng.permutation(triangles).astype("u4"), options, "me")
    assert len(canonical) == 2338 and len(frames[0]) == 3273
    assert found.notes[0].values["how"] == "their connectivity"
    assert (walk.fps, walk.frames) == (24, 49)
    for played, frame in zip(_played(found), frames, strict=True):
        off = np.abs(played - frame[first[order]]).max()
        measured("CesiumMan welded and renumbered, walking m", off)
        assert off == 0
