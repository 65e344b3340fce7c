"""What the SplattingAvatar reader makes of good runs, and which folders it takes for runs."""

from __future__ import annotations

import copy
import json
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from avatar_export.readers import gaussian_avatars, lam
from avatar_export.readers import table as readers
from avatar_export.readers.gaussian_blendshapes import reader as gaussian_blendshapes
from avatar_export.readers.splatting_avatar import reader as splatting_avatar
from avatar_runtime.io.errors import AvatarError
from tests.exporter.readers import lam_files, splatting_files
from tests.exporter.readers.splatting_files import (
    COUNT,
    FACES,
    VERTICES,
    notes_of,
    read_run,
    write_splatting_run,
)
from tests.golden import BlendshapesGolden
from tests.shared_data import shared

A = splatting_files.arrays()
GOLDEN = {"small_sh0": 1.0, "small_sh3": 1.0, "head_m_sh0": 1.0, "head_x4_face_sh3": 4.0}


def test_the_avatar_to_the_last_field(run: Path) -> None:
    """Units are 4 a metre: config.yaml says imavatar."""
    avatar = read_run(run)
    e, g = avatar.embedding, avatar.gaussians
    assert e is not None
    assert np.array_equal(e.canonical_vertices, VERTICES.astype("f4") / 4)
    assert np.array_equal(e.triangles, FACES) and np.array_equal(e.triangle, A["sample_fidxs"])
    assert np.array_equal(e.barycentric, A["sample_bary"])
    assert np.array_equal(e.displacement, A["_xyz"][:, 2] / 4)
    assert e.local_offset.shape == (0, 3)
    assert np.array_equal(e.local_quat_wxyz, A["_rotation"])
    assert np.allclose(g.log_scale, A["log_scale"].astype("f8") - np.log(4), rtol=0, atol=1e-6)
    assert np.array_equal(g.opacity_logit, A["opacity_logit"]) and np.array_equal(g.sh, A["sh"])
    assert (avatar.name, avatar.training_per_bundle, avatar.raster.near) == ("subject", 4.0, 0.05)
    assert (avatar.raster.background, avatar.sh_degree) == ("random", 1)
    assert [(x.first, x.count, x.binding) for x in avatar.groups] == [(0, COUNT, "surface")]
    rules = avatar.rules
    assert (rules.position, rules.rotation, rules.scale) == ("normal", "vertex_quaternion", "log_area")
    assert (rules.sh_direction, rules.quaternion_sign) == ("inverse_rotation", "w_positive")
    b = avatar.blendshapes
    assert [p.entries for p in (b.geometry, b.appearance, b.correctives, b.late_morphs, avatar.skin)] == [
        0
    ] * 5
    assert avatar.rig is None and avatar.clips == () and avatar.expressions == ()
    p = avatar.provenance
    assert (p["system"], p["form"]) == ("splatting_avatar", "embedding.json")
    assert [f["path"] for f in p["source_files"]] == [
        "config.yaml", "embedding.json", "embedding.obj", "point_cloud.ply"
    ]  # fmt: skip


def test_the_binding_pose_follows_from_the_embedding(run: Path) -> None:
    """Position: corner by corner, in float64; rotation: the mesh turns nothing. The .ply's own are not read."""
    avatar = read_run(run, units=1.0)
    faces = [tuple(map(int, face)) for face in FACES]
    normal = np.zeros((len(VERTICES), 3))
    for a, b, c in faces:
        across = np.cross(VERTICES[b] - VERTICES[a], VERTICES[c] - VERTICES[a])
        for corner in (a, b, c):
            normal[corner] += across
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    for i in range(COUNT):
        corners, weights = list(faces[A["sample_fidxs"][i]]), A["sample_bary"][i].astype("f8")
        n = weights @ normal[corners]
        expected = weights @ VERTICES[corners] + A["_xyz"][i, 2] * n / np.linalg.norm(n)
        assert np.allclose(avatar.gaussians.mean[i], expected, rtol=0, atol=1e-7)
    assert np.allclose(avatar.gaussians.quat_wxyz, A["_rotation"], rtol=0, atol=2e-6)


@pytest.mark.parametrize("case", GOLDEN)
def test_golden_runs(case: str) -> None:
    folder = shared(f"golden/splatting_avatar/splatting_avatar/{case}")
    given, units = np.load(folder / "static.npz"), GOLDEN[case]
    assert splatting_avatar.detect(folder / "run")
    avatar = read_run(folder / "run", units=units)
    e = avatar.embedding
    assert e is not None and units == given["units_per_metre"]
    lines = (folder / "run/point_cloud/iteration_30000/embedding.obj").read_text().splitlines()
    vertices = np.array([line.split()[1:] for line in lines if line.startswith("v ")], "f8").astype("f4")
    faces = (
        np.array([[c.split("/")[0] for c in line.split()[1:]] for line in lines if line[:2] == "f "], "i8")
        - 1
    )
    assert np.array_equal(e.canonical_vertices, vertices / np.float32(units))
    assert np.array_equal(e.triangles, faces)
    assert np.array_equal(e.triangle, given["face_index"])
    assert np.array_equal(e.barycentric, given["barycentric"])
    assert np.array_equal(e.displacement * np.float32(units), given["displacement"])
    assert np.array_equal(e.local_quat_wxyz, given["rotation_raw"])
    log_scale = avatar.gaussians.log_scale.astype("f8") + np.log(units)
    assert np.allclose(log_scale, given["scale_log"], rtol=0, atol=5e-7)
    sigmoid = 1 / (1 + np.exp(-avatar.gaussians.opacity_logit.astype("f8")))
    assert np.allclose(sigmoid, given["opacity"][:, 0], rtol=0, atol=1e-6)
    assert avatar.gaussians.sh_degree == avatar.sh_degree == given["sh_degree"]
    assert avatar.rules.scale == "log_area" and avatar.rules.sh_direction == "world"
    if "features_dc" in given:
        assert np.array_equal(avatar.gaussians.sh[:, :1], given["features_dc"])
        assert np.array_equal(avatar.gaussians.sh[:, 1:], given["features_rest"])
        assert np.abs(avatar.gaussians.mean - given["canonical_xyz_ply"]).max() < 1e-6  # the .obj is rounded
    assert len(notes_of(avatar)) == 1


def test_a_head_in_metres_read_as_four_times_that_is_doubted() -> None:
    """Its config.yaml says imavatar, so 4 is assumed, and the note says that the mesh is small then."""
    avatar = read_run(shared("golden/splatting_avatar/splatting_avatar/small_sh0/run"))
    assert avatar.training_per_bundle == 4
    assert any("m high at 4 training units a metre; --units" in note for note in avatar.provenance["notes"])


def test_both_forms_are_one_avatar(run: Path, tmp_path: Path) -> None:
    old = tmp_path / "old"
    write_splatting_run(old, A, embedding=splatting_files.legacy(A), form="canonical.sample.json")
    assert splatting_avatar.detect(old)
    new, legacy = read_run(run), read_run(old)
    assert legacy.provenance["form"] == "canonical.sample.json"
    for field in ("canonical_vertices", "triangle", "barycentric", "displacement", "local_quat_wxyz"):
        assert np.array_equal(getattr(new.embedding, field), getattr(legacy.embedding, field))


@pytest.mark.parametrize(
    "name", ["/elsewhere/run/mesh.obj", r"C:\runs\mesh.obj", "../../mesh.obj", "mesh.obj"]
)
def test_the_mesh_lies_beside_whatever_folder_is_named(name: str, run: Path, tmp_path: Path) -> None:
    """The file names a path of the trainer's machine; nothing outside the run is opened."""
    folder = run / "point_cloud" / "iteration_30000"
    for decoy in (run, run.parent):
        (decoy / "mesh.obj").write_text(splatting_files.obj_text(VERTICES * 3))
    (folder / "embedding.json").write_text(json.dumps({**splatting_files.document(A), "cano_mesh": name}))
    with pytest.raises(
        AvatarError, match=r"embedding.json: names '.*', but there is no 'mesh.obj' beside it; pass --mesh"
    ):
        read_run(run)
    (folder / "embedding.obj").rename(folder / "mesh.obj")
    assert np.array_equal(read_run(run).embedding.canonical_vertices, VERTICES.astype("f4") / 4)
    assert read_run(run, mesh=run / "mesh.obj").embedding.canonical_vertices.max() > 0.05


def test_the_newest_iteration_isread_run(run: Path) -> None:
    for iteration, logit in ((9000, 1.0), (100000, 2.0)):
        other = {**A, "opacity_logit": np.full(COUNT, logit, "f4")}
        write_splatting_run(run, other, iteration=iteration)
    iterations = run / "point_cloud"
    (iterations / "iteration_final").mkdir()
    assert (read_run(run).gaussians.opacity_logit == 2).all()
    for path in (iterations / "iteration_9000", iterations / "iteration_9000" / "point_cloud.ply"):
        assert splatting_avatar.detect(path)
        avatar = read_run(path)
        assert (avatar.gaussians.opacity_logit == 1).all()
        assert (avatar.name, avatar.training_per_bundle) == ("subject", 4.0)  # the run's config.yaml


def test_files_in_one_folder(run: Path, tmp_path: Path) -> None:
    """Not in the trainer's layout: config.yaml counts beside the .ply only."""
    flat = tmp_path / "flat"
    shutil.copytree(run / "point_cloud" / "iteration_30000", flat)
    shutil.copy(run / "config.yaml", tmp_path)
    assert read_run(flat).training_per_bundle == 1
    shutil.copy(run / "config.yaml", flat)
    assert read_run(flat).training_per_bundle == 4
    assert read_run(flat / "point_cloud.ply").name == "flat"


HEAD, BODY = "dataset: {frameset_type: imavatar}\n", "dataset: {frameset_type: instant_avatar}\n"


@pytest.mark.parametrize(
    ("config", "options", "found", "said"),
    [
        (HEAD, {}, (4, "log_area", "world", 1), "4 training units a metre (assumed, usual for imavatar)"),
        (BODY, {}, (1, "none", "world", 1), "mesh scaling off (assumed, usual for instant_avatar)"),
        ("seed: 1\n", {}, (1, "none", "world", 1), "1 training unit a metre (assumed, nothing says otherwise)"),
        (None, {}, (1, "none", "world", 1), "SH degree 1 (point_cloud.ply)"),
        ("model:\npipe: 3\n", {}, (1, "none", "world", 1), "SH direction world (assumed, the code's default)"),
        (HEAD + "model: {with_mesh_scaling: false}\n", {}, (4, "none", "world", 1), "(config.yaml model.with_"),
        (BODY + "model: {with_mesh_scaling: true, sh_degree: 0}\n", {}, (1, "log_area", "world", 0), "degree 0 (conf"),
        ("pipe: {convert_SHs_python: true}\n", {}, (1, "none", "inverse_rotation", 1), "(config.yaml pipe.convert"),
        (splatting_files.CONFIG, {"units": 2.5, "mesh_scaling": False, "sh_direction": "world", "sh_degree": 0},
         (2.5, "none", "world", 0), "2.5 training units a metre (--units); mesh scaling off (--mesh-scaling); "
         "SH direction world (--sh-direction); SH degree 0 (--sh-degree)"),
        (None, {"mesh_scaling": True}, (1, "log_area", "world", 1), "mesh scaling on (--mesh-scaling)"),
        ("model: {sh_degree: x, with_mesh_scaling: 3}\npipe: {convert_SHs_python: 1}\n",
         {"mesh_scaling": True, "sh_direction": "world", "sh_degree": 1}, (1, "log_area", "world", 1), "(--sh-degree)"),
    ],
)  # fmt: skip
def test_settings(
    config: str | None, options: dict[str, Any], found: tuple[Any, ...], said: str, tmp_path: Path
) -> None:
    write_splatting_run(tmp_path, A, config=config)
    avatar = read_run(tmp_path, **options)
    rules = avatar.rules
    assert (avatar.training_per_bundle, rules.scale, rules.sh_direction, avatar.sh_degree) == found
    assert said in avatar.provenance["notes"][0]
    assert avatar.raster.near == pytest.approx(0.2 / avatar.training_per_bundle)


def test_a_config_as_omegaconf_saves_it(tmp_path: Path) -> None:
    """Interpolations, missing values and a list of configs among the settings."""
    text = (
        "dataset:\n  dat_dir: ???\n  frameset_type: imavatar\n  num_for_train: -350\n"
        "optim:\n  optim_xyz:\n    scheduler_args:\n      lr_max_steps: ${optim.total_iteration}\n"
        "yaml_confs:\n- dataset:\n    dat_dir: ???\n- model:\n    with_mesh_scaling: false\nyaml_dir: configs\n"
    )
    write_splatting_run(tmp_path, A, config=text)
    assert read_run(tmp_path).rules.scale == "log_area"


def test_the_sign_policy_is_an_option(run: Path) -> None:
    assert read_run(run, quaternion_sign="largest_positive").rules.quaternion_sign == "largest_positive"
    for options in ({"quaternion_sign": "up"}, {"sh_direction": "up"}):
        with pytest.raises(ValueError, match="'up' is not one of"):
            read_run(run, **options)


def test_what_is_not_stored_as_it_should_be_is_noted(tmp_path: Path) -> None:
    a = copy.deepcopy(A)
    a["_xyz"][4, 0] = a["_xyz"][7, 1] = 0.25
    document = splatting_files.document(a)
    del document["_rotation"]
    write_splatting_run(tmp_path, a, embedding=document)
    avatar = read_run(tmp_path)
    assert np.array_equal(avatar.embedding.local_quat_wxyz, A["ply_rot"])
    assert np.array_equal(avatar.embedding.displacement, A["_xyz"][:, 2] / 4)
    notes = "\n".join(avatar.provenance["notes"])
    assert "no _rotation in embedding.json: rot_* of point_cloud.ply is taken" in notes
    assert "_xyz of 2 Gaussians has first numbers that are not 0" in notes
    assert "1 Gaussians lie up to 0.00098 outside their triangle; kept so" in notes
    assert "the mesh is 0.0525 m high at 4 training units a metre; --units sets another number" in notes
    assert "mm (median) from the embedding: another frame's, or not its mesh" in notes


def test_a_sound_run_raises_no_doubts(run: Path) -> None:
    a = copy.deepcopy(A)
    a["sample_bary"][2] = [0.25, 0.25, 0.5]
    folder = write_splatting_run(run, a)
    a["ply_xyz"] = read_run(run, units=1.0).gaussians.mean
    splatting_files.write_ply(folder / "point_cloud.ply", a)
    assert len(notes_of(read_run(run, units=1.0))) == 1


def test_detection_leaves_other_systems_alone(
    run: Path, blendshapes_golden: BlendshapesGolden, tmp_path: Path
) -> None:
    plain = splatting_files.write_gaussian_run(tmp_path / "plain", A, binding=False, vertices=None)
    bound = splatting_files.write_gaussian_run(tmp_path / "bound", A)
    zipped = lam_files.write_zip(tmp_path / "made.zip", lam_files.files())
    ours = (splatting_avatar, gaussian_avatars)
    found = {path: [m.SYSTEM for m in (*ours, gaussian_blendshapes, lam) if m.detect(path)] for path in (
        run, plain, bound, tmp_path / "bound", zipped, blendshapes_golden.viewer, blendshapes_golden.raw)}  # fmt: skip
    assert list(found.values()) == [
        ["splatting_avatar"], [], ["gaussian_avatars"], ["gaussian_avatars"], ["lam"],
        ["gaussian_blendshapes"], ["gaussian_blendshapes"],
    ]  # fmt: skip
    assert readers.find(run).system == "splatting_avatar"
    assert readers.find(bound).system == "gaussian_avatars"


def test_detection_never_raises(tmp_path: Path) -> None:
    (tmp_path / "point_cloud.ply").mkdir()
    (tmp_path / "point_cloud").write_bytes(b"")
    (tmp_path / "loop").symlink_to(tmp_path / "loop")
    (tmp_path / "some.ply").write_bytes(bytes(range(256)))
    (tmp_path / "long").mkdir()
    (tmp_path / "long" / "point_cloud.ply").symlink_to("/dev/zero")
    names = ("", "loop", "some.ply", "long", "gone", "x" * 5000, "a\0b", "\udc80")
    for name in names:
        for module in (splatting_avatar, gaussian_avatars):
            assert module.detect(tmp_path / name) is False
