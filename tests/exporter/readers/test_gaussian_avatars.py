"""What the GaussianAvatars reader makes of good and of bad runs."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from avatar_export.options import ReadOptions
from avatar_export.readers.table import read
from avatar_runtime.avatar import Avatar
from tests.exporter.bodies import body_files
from tests.exporter.readers import splatting_files
from tests.exporter.readers.splatting_files import COUNT, FACES, VERTICES, obj_text, write_gaussian_run
from tests.exporter.refusals import refused

A = splatting_files.arrays(degree=3)
IDS = A["sample_fidxs"].astype("f4")
MODEL = body_files.body(body_files.FLAME_PARENTS)


@pytest.fixture(scope="module")
def mesh(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("mesh") / "mesh.obj"
    path.write_text(obj_text(VERTICES * 2))
    return path


def _read(path: Path, mesh: Path | None, **options: Any) -> Avatar:
    return read(path, ReadOptions(**{"no_rig": True, "mesh": mesh, **options}), "gaussian_avatars")


def _paths(avatar: Avatar) -> list[str]:
    return [f["path"] for f in avatar.provenance["source_files"]]


def test_the_avatar_to_the_last_field(mesh: Path, tmp_path: Path) -> None:
    write_gaussian_run(tmp_path / "subject", A)
    avatar = _read(tmp_path / "subject", mesh)
    e, g, rules = avatar.embedding, avatar.gaussians, avatar.rules
    assert e is not None
    for got, want in (
        (e.canonical_vertices, (VERTICES * 2).astype("f4")), (e.triangles, FACES), (e.triangle, A["sample_fidxs"]),
        (e.barycentric, np.full((COUNT, 3), np.float32(1 / 3))), (e.local_offset, A["ply_xyz"]), (g.sh, A["sh"]),
        (e.local_quat_wxyz, A["ply_rot"]), (e.displacement, np.zeros(0)), (g.opacity_logit, A["opacity_logit"]),
    ):  # fmt: skip
        assert np.array_equal(got, want)
    assert (rules.position, rules.rotation) == ("triangle_frame", "triangle_frame")
    assert (rules.scale, rules.sh_direction) == ("triangle_linear", "world")
    assert (avatar.name, avatar.training_per_bundle, avatar.raster.near) == ("subject", 1.0, 0.2)
    assert (avatar.raster.background, avatar.sh_degree) == ((1.0, 1.0, 1.0), 3)
    assert [(x.first, x.count, x.binding) for x in avatar.groups] == [(0, COUNT, "surface")]
    assert avatar.provenance["system"] == "gaussian_avatars"
    (note,) = [note for note in avatar.provenance["notes"] if not note.startswith("no rig")]
    assert "assumed" in note
    assert _paths(avatar) == ["flame_param.npz", "mesh/mesh.obj", "point_cloud.ply"]


@pytest.fixture(scope="module")
def subject(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run on the mesh of a small body model, with the subject's own offsets of its vertices."""
    folder = tmp_path_factory.mktemp("subject")
    body_files.write_body(folder / "body.npz", MODEL)
    iteration = write_gaussian_run(folder / "run", A, vertices=None)
    offset = np.random.default_rng(2).normal(0, 0.01, MODEL["v_template"].shape)
    poses = body_files.poses(5)
    body_files.flame_param(iteration / "flame_param.npz", poses, offset)
    np.save(folder / "shaped.npy", MODEL["v_template"] + MODEL["identity"] @ poses["shape"] + offset)
    return folder


def test_a_body_model_gives_the_mesh_of_the_subject(subject: Path, tmp_path: Path) -> None:
    body = subject / "body.npz"
    avatar = _read(subject / "run", None, no_rig=False, body_model=body)
    e, rig = avatar.embedding, avatar.rig
    assert e is not None and rig is not None
    assert np.allclose(e.canonical_vertices, np.load(subject / "shaped.npy"), rtol=0, atol=1e-6)
    assert np.array_equal(rig.vertices, e.canonical_vertices) and np.array_equal(rig.triangles, e.triangles)
    assert [(clip.name, clip.frames) for clip in avatar.clips] == [("flame_param", body_files.FRAMES)]
    assert not any(note.startswith("doubtful") and "pose" in note for note in avatar.provenance["notes"])
    assert _paths(avatar) == ["body_model/body.npz", "point_cloud.ply", "poses/flame_param.npz"]
    bare = _read(subject / "run", None, body_model=body)
    assert bare.rig is None and np.array_equal(bare.embedding.canonical_vertices, MODEL["v_template"])
    np.savez(tmp_path / "mesh.npz", vertices=MODEL["v_template"] * 1.5, faces=MODEL["triangles"])
    avatar = _read(subject / "run", tmp_path / "mesh.npz", no_rig=False, body_model=body)
    assert np.array_equal(avatar.embedding.canonical_vertices, MODEL["v_template"] * np.float32(1.5))
    assert not np.array_equal(avatar.rig.vertices, avatar.embedding.canonical_vertices)


def test_no_rig_refuses_what_gives_no_mesh(subject: Path) -> None:
    for given in (("body_model", "shape"), ("mesh", "body_model"), ("mesh", "rig"), ("rig", "body_model")):
        options = {"mesh": None, **dict.fromkeys(given, subject / "body.npz")}
        unused = f"--{given[1].replace('_', '-')}"
        refused(f"gaussian_avatars: {unused} would have no", _read, subject / "run", **options)


def _with(value: Any, ids: Any = IDS) -> Any:
    return np.where(np.arange(COUNT) == 5, value, ids).astype(ids.dtype)


@pytest.mark.parametrize(
    ("binding", "message"),
    [
        (_with(8), r"binding_0\[5\]: is 8, .* 8 triangles \(0..7\) of mesh.obj"),
        *((_with(value), rf"binding_0\[5\]: is {value}, but") for value in (-1, 1.5, np.nan, np.inf)),
        (_with(2**31 - 1, IDS.astype("i4")), r"binding_0\[5\]: is 2.14748365e\+09, but"),
        (False, "property binding_0: is missing"),
    ],
)
def test_bad_bindings(binding: Any, message: str, mesh: Path, tmp_path: Path) -> None:
    write_gaussian_run(tmp_path, A, binding=binding)
    assert refused(message, _read, tmp_path, mesh).owner == "gaussian_avatars"


def test_bad_meshes(subject: Path, mesh: Path, tmp_path: Path) -> None:
    write_gaussian_run(tmp_path / "run", A)
    write_gaussian_run(tmp_path / "flame", A, vertices=5143)
    (tmp_path / "flat.obj").write_text(obj_text(faces=np.concatenate([FACES[:7], [[0, 3, 3]]])))
    (tmp_path / "empty").mkdir()
    for run, at, options, says in (
        ("run", None, {}, "--mesh .* 120 vertices and 168"),
        ("run", tmp_path / "flat.obj", {}, r"flat.obj: triangle 7 \(vertices 0, 3, 3\) has no area, but carries"),
        ("flame", mesh, {}, r"static_offset: has shape \[1, 5143, 3\], but mesh.obj has 6 vertices"),
        ("flame", None, {"body_model": subject / "body.npz"}, r"static_offset: has .*5143.* 120 "),
        ("empty", mesh, {}, "has no point_cloud.ply"),
        *(("run", mesh, {name: value}, f"--{name.replace('_', '-')} cannot be used here") for name, value in (
            ("sh_direction", "world"), ("mesh_scaling", True), ("quaternion_sign", "w_positive"))),
    ):  # fmt: skip
        refused(says, _read, tmp_path / run, at, **options)
