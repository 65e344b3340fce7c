"""What the SplattingAvatar reader makes of good and of bad runs."""

from __future__ import annotations

import copy
import json
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from avatar_export import read as readers
from avatar_export.readers import gaussian_avatars, gaussian_blendshapes, lam, splatting_avatar
from avatar_export.readers.options import ReadOptions
from avatar_runtime.avatar import Avatar
from avatar_runtime.errors import AvatarError
from tests.exporter.readers import lam_files, splatting_files
from tests.exporter.readers.made import MANGLING, Array, mangled, only_avatar_errors, peak_bytes
from tests.exporter.readers.splatting_files import COUNT, FACES, VERTICES, write_splatting_run
from tests.golden import BlendshapesGolden
from tests.shared_data import shared

A = splatting_files.arrays()
GOLDEN = {"small_sh0": 1.0, "small_sh3": 1.0, "head_m_sh0": 1.0, "head_x4_face_sh3": 4.0}


def _read(path: Path, **options: Any) -> Avatar:
    return splatting_avatar.read(path, ReadOptions(**{"no_rig": True, **options})).check()


def _notes(avatar: Avatar) -> list[str]:
    """What the reader itself has to say; that there is no rig, its part for rigs says."""
    return [note for note in avatar.provenance["notes"] if not note.startswith("no rig")]


@pytest.fixture
def run(tmp_path: Path) -> Path:
    write_splatting_run(tmp_path / "subject", A)
    return tmp_path / "subject"


def test_the_avatar_to_the_last_field(run: Path) -> None:
    """Units are 4 a metre: config.yaml says imavatar."""
    avatar = _read(run)
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
    avatar = _read(run, units=1.0)
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
    avatar = _read(folder / "run", units=units)
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
    assert len(_notes(avatar)) == 1


def test_a_head_in_metres_read_as_four_times_that_is_doubted() -> None:
    """Its config.yaml says imavatar, so 4 is assumed, and the note says that the mesh is small then."""
    avatar = _read(shared("golden/splatting_avatar/splatting_avatar/small_sh0/run"))
    assert avatar.training_per_bundle == 4
    assert any("m high at 4 training units a metre; --units" in note for note in avatar.provenance["notes"])


def test_both_forms_are_one_avatar(run: Path, tmp_path: Path) -> None:
    old = tmp_path / "old"
    write_splatting_run(old, A, embedding=splatting_files.legacy(A), form="canonical.sample.json")
    assert splatting_avatar.detect(old)
    new, legacy = _read(run), _read(old)
    assert legacy.provenance["form"] == "canonical.sample.json"
    for field in ("canonical_vertices", "triangle", "barycentric", "displacement", "local_quat_wxyz"):
        assert np.array_equal(getattr(new.embedding, field), getattr(legacy.embedding, field))


@pytest.mark.parametrize(
    "name", ["/home/someone/run/mesh.obj", r"C:\runs\mesh.obj", "../../mesh.obj", "mesh.obj"]
)
def test_the_mesh_lies_beside_whatever_folder_is_named(name: str, run: Path, tmp_path: Path) -> None:
    """The file names a path of the trainer's machine; nothing outside the run is opened."""
    folder = run / "point_cloud" / "iteration_30000"
    for decoy in (run, run.parent):
        (decoy / "mesh.obj").write_text(splatting_files.obj_text(VERTICES * 3))
    (folder / "embedding.json").write_text(json.dumps({**splatting_files.document(A), "cano_mesh": name}))
    with pytest.raises(
        AvatarError, match=r"embedding.json: names '.*', but no 'mesh.obj' lies beside it; pass --mesh"
    ):
        _read(run)
    (folder / "embedding.obj").rename(folder / "mesh.obj")
    assert np.array_equal(_read(run).embedding.canonical_vertices, VERTICES.astype("f4") / 4)
    assert _read(run, mesh=run / "mesh.obj").embedding.canonical_vertices.max() > 0.05


def test_the_newest_iteration_is_read(run: Path) -> None:
    for iteration, logit in ((9000, 1.0), (100000, 2.0)):
        other = {**A, "opacity_logit": np.full(COUNT, logit, "f4")}
        write_splatting_run(run, other, iteration=iteration)
    iterations = run / "point_cloud"
    (iterations / "iteration_final").mkdir()
    assert (_read(run).gaussians.opacity_logit == 2).all()
    for path in (iterations / "iteration_9000", iterations / "iteration_9000" / "point_cloud.ply"):
        assert splatting_avatar.detect(path)
        avatar = _read(path)
        assert (avatar.gaussians.opacity_logit == 1).all()
        assert (avatar.name, avatar.training_per_bundle) == ("subject", 4.0)  # the run's config.yaml


def test_files_in_one_folder(run: Path, tmp_path: Path) -> None:
    """Not in the trainer's layout: config.yaml counts beside the .ply only."""
    flat = tmp_path / "flat"
    shutil.copytree(run / "point_cloud" / "iteration_30000", flat)
    shutil.copy(run / "config.yaml", tmp_path)
    assert _read(flat).training_per_bundle == 1
    shutil.copy(run / "config.yaml", flat)
    assert _read(flat).training_per_bundle == 4
    assert _read(flat / "point_cloud.ply").name == "flat"


HEAD, BODY = "dataset: {frameset_type: imavatar}\n", "dataset: {frameset_type: instant_avatar}\n"


@pytest.mark.parametrize(
    ("config", "options", "found", "said"),
    [
        (HEAD, {}, (4, "log_area", "world", 1), "4 training units a metre (assumed, usual for imavatar)"),
        (BODY, {}, (1, "none", "world", 1), "mesh scaling off (assumed, usual for instant_avatar)"),
        ("seed: 1\n", {}, (1, "none", "world", 1), "1 training units a metre (assumed, nothing says otherwise)"),
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
    avatar = _read(tmp_path, **options)
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
    assert _read(tmp_path).rules.scale == "log_area"


def test_the_sign_policy_is_an_option(run: Path) -> None:
    assert _read(run, quaternion_sign="largest_positive").rules.quaternion_sign == "largest_positive"
    for options in ({"quaternion_sign": "up"}, {"sh_direction": "up"}):
        with pytest.raises(AvatarError, match="'up' is none of"):
            _read(run, **options)


def test_what_is_not_stored_as_it_should_be_is_noted(tmp_path: Path) -> None:
    a = copy.deepcopy(A)
    a["_xyz"][4, 0] = a["_xyz"][7, 1] = 0.25
    document = splatting_files.document(a)
    del document["_rotation"]
    write_splatting_run(tmp_path, a, embedding=document)
    avatar = _read(tmp_path)
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
    a["ply_xyz"] = _read(run, units=1.0).gaussians.mean
    splatting_files.write_ply(folder / "point_cloud.ply", a)
    assert len(_notes(_read(run, units=1.0))) == 1


def _set(key: str, *at: Any) -> Callable[[dict[str, Any]], None]:
    """Puts the last of `at` to where the others lead."""

    def change(document: dict[str, Any]) -> None:
        owner: Any = document
        for step in (key, *at[:-2]):
            owner = owner[step]
        owner[at[-2]] = at[-1]

    return change


def _without(key: str) -> Callable[[dict[str, Any]], None]:
    return lambda document: document.pop(key)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda d: d["sample_fidxs"].pop(), r"json: sample_fidxs: has 23 rows, but the .ply has 24 Gaussians"),
        (lambda d: d["_xyz"].append([0, 0, 0]), r"_xyz: has 25 rows, but the .ply has 24 Gaussians"),
        (lambda d: d.update(sample_bary=3), "sample_bary: is no list, but the .ply has 24 Gaussians"),
        (lambda d: d.update(sample_bary=None), "sample_bary: is no list"),
        (_without("sample_bary"), "sample_bary: is missing"),
        (_without("cano_mesh"), "cano_mesh: is missing"),
        (lambda d: d.update(cano_mesh=3), "cano_mesh: is no text"),
        (lambda d: d.update(cano_mesh=".."), "cano_mesh: is no file name"),
        (lambda d: d.update(cano_mesh="a/"), "cano_mesh: is no file name"),
        (lambda d: d.update(cano_mesh="a\0b"), "cano_mesh: is no file name"),
        (lambda d: d.update(cano_mesh="\ud800"), "cano_mesh: is no file name"),
        (lambda d: d.update(cano_mesh="embedding.ply"), "but no 'embedding.ply' lies beside it"),
        (lambda d: d.update(cano_mesh="point_cloud.ply"), "point_cloud.ply: is no mesh read here"),
        (_set("sample_fidxs", 5, 8), r"sample_fidxs\[5\]: is 8, but the mesh has 8 triangles \(0..7\)"),
        (_set("sample_fidxs", 5, -1), r"sample_fidxs\[5\]: is -1, but"),
        (_set("sample_fidxs", 5, 1.5), r"sample_fidxs\[5\]: is 1.5, but"),
        (_set("sample_fidxs", 5, 10**300), r"sample_fidxs\[5\]: is 1e\+300, but"),
        (_set("sample_fidxs", 5, True), r"sample_fidxs\[5\]: is no number"),
        (_set("sample_fidxs", 5, [1]), r"sample_fidxs\[5\]: is no number"),
        (_set("sample_bary", 6, [0.5, 0.5]), r"sample_bary\[6\]: is no list of 3 numbers"),
        (_set("sample_bary", 6, "abc"), r"sample_bary\[6\]: is no list of 3 numbers"),
        (_set("sample_bary", 6, {"a": 1, "b": 2, "c": 3}), r"sample_bary\[6\]: is no list of 3 numbers"),
        (_set("sample_bary", 6, 1, "0.5"), r"sample_bary\[6\]: is no number"),
        (_set("sample_bary", 6, 1, None), r"sample_bary\[6\]: is no number"),
        (_set("sample_bary", 6, [True, False, False]), r"sample_bary\[6\]: is no number"),
        (_set("sample_bary", 6, [0.5, 0.3, 0.2002]), r"sample_bary\[6\]: adds up to 1.0002, expected 1 within 0.0001"),
        (_set("sample_bary", 6, [-0.0011, 0.5, 0.5011]), r"sample_bary\[6\]: holds -0.0011, far outside the triangle"),
        (_set("_xyz", 9, 2, 1e39), r"_xyz\[9\]: is \[.*1e\+39\], not finite in float32"),
        (_set("_rotation", 9, 3, 10**310), "_rotation: holds a number beyond all bounds"),
        (_set("_rotation", 9, [1, 0, 0]), r"_rotation\[9\]: is no list of 4 numbers"),
    ],
)  # fmt: skip
def test_bad_embeddings_are_refused(change: Callable[[Any], Any], message: str, tmp_path: Path) -> None:
    document = splatting_files.document(A)
    change(document)
    write_splatting_run(tmp_path, A, embedding=document)
    with pytest.raises(AvatarError, match=message) as caught:
        _read(tmp_path)
    assert caught.value.owner == "splatting_avatar"


def test_weights_up_to_the_tolerances_are_kept(tmp_path: Path) -> None:
    a = copy.deepcopy(A)
    a["sample_bary"][6] = [-1e-3, 0.5, 0.501]
    a["sample_bary"][7] = [0.5, 0.3, 0.20009]
    write_splatting_run(tmp_path, a)
    assert np.array_equal(_read(tmp_path).embedding.barycentric, a["sample_bary"])


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "is no JSON that can be read"),
        ("[1, 2]", "holds no JSON object"),
        ('{"sample_fidxs": [NaN]}', "NaN is no number"),
        ('{"sample_fidxs": [-Infinity]}', "-Infinity is no number"),
        ('{"a": ' + "[" * 5000, "RecursionError"),
        ('{"a": ' + "9" * 5000 + "}", "is no JSON that can be read"),
        ("[" + "[],[]," * 40000, "holds far more lists and numbers than 24 Gaussians need"),
        ("[" + "0," * 40000, "holds far more lists"),
        ("[" + "{},[]" * 9000, "holds far more lists"),
        (" " * 1_100_000, r"is 1100000 bytes long; up to 1073152 are read"),
        ("\udc80", "is no JSON that can be read"),
    ],
)
def test_what_is_no_embedding_is_refused(text: str, message: str, run: Path) -> None:
    path = run / "point_cloud" / "iteration_30000" / "embedding.json"
    path.write_bytes(text.encode("utf8", errors="surrogateescape"))
    assert splatting_avatar.detect(run)

    def read() -> None:
        with pytest.raises(AvatarError, match=message):
            _read(run)

    assert peak_bytes(read) < 20e6


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("- 1\n", "config.yaml: holds no settings"),
        ("a: [1\n", "config.yaml: is no YAML that is read here"),
        ("a: &a [1]\nb: *a\n", "has aliases; write them out"),
        ("a: &a {b: 1}\nc: {<<: *a}\n", "has aliases; write them out"),
        ("a: !!python/object/apply:os.system [true]\n", "is no YAML that is read here"),
        ("a: !!python/name:os.system\n", "is no YAML that is read here"),
        ("a: !!int ''\n", "is no YAML that is read here"),
        ("a: !!timestamp 2001-99-99\n", "is no YAML that is read here"),
        ("a: " + "[" * 3000, "is no YAML that is read here"),
        ("a: " + "9" * 5000, "is no YAML that is read here"),
        ("#" * 70_000, "is 70000 bytes long; up to 65536 are read"),
        ("model: {with_mesh_scaling: 1}\n", "config.yaml: model.with_mesh_scaling: is '1', expected bool"),
        ("model: {sh_degree: true}\n", "model.sh_degree: is 'True', expected int"),
        ("model: {sh_degree: 2}\n", r"stores SH of degree 1, but config.yaml model.sh_degree says 2; pass --sh-degree"),
        ("model: {sh_degree: -1}\n", "says -1; pass --sh-degree"),
        ("model: {xyz_as_uvd: false}\n", "model.xyz_as_uvd: is false: these Gaussians do not ride on the mesh"),
        ("pipe: {convert_SHs_python: 'no'}\n", "pipe.convert_SHs_python: is 'no', expected bool"),
        ("dataset: {frameset_type: 3}\n", "dataset.frameset_type: is '3', expected str"),
    ],
)  # fmt: skip
def test_bad_configs_are_refused(text: str, message: str, tmp_path: Path) -> None:
    write_splatting_run(tmp_path, A, config=text)
    with pytest.raises(AvatarError, match=message):
        _read(tmp_path)


def test_yaml_bombs_stay_small(tmp_path: Path) -> None:
    bomb = "a0: &a0 [x, x, x, x, x, x, x, x, x]\n"
    bomb += "".join(f"a{i}: &a{i} [{', '.join([f'*a{i - 1}'] * 9)}]\n" for i in range(1, 12))
    write_splatting_run(tmp_path, A, config=bomb)
    with pytest.raises(AvatarError, match="has aliases"):
        _read(tmp_path)


@pytest.mark.parametrize(
    ("vertices", "faces", "message"),
    [
        (VERTICES, FACES[:5], r"sample_fidxs\[\d+\]: is \d, but the mesh has 5 triangles \(0..4\)"),
        (VERTICES[:5], FACES, r"embedding.obj: line 16: face 4 has corners 3, 1, 6, but there are vertices 1..5"),
        (np.where(VERTICES == 0.11, 1e-7, VERTICES), np.concatenate([FACES[:1] * 0, FACES[1:]]),
         r"embedding.obj: triangle 0 \(vertices 0, 0, 0\) has no area, but carries Gaussian \d+; mend"),
        (np.concatenate([VERTICES[:4], (VERTICES[:1] + VERTICES[2:3]) / 2, VERTICES[5:]]), FACES,
         r"triangle 0 \(vertices 0, 2, 4\) has no area"),
    ],
)  # fmt: skip
def test_bad_meshes_are_refused(vertices: Array, faces: Array, message: str, tmp_path: Path) -> None:
    write_splatting_run(tmp_path, A, obj=splatting_files.obj_text(vertices, faces))
    with pytest.raises(AvatarError, match=message):
        _read(tmp_path)


def test_a_flat_triangle_without_gaussians_is_no_matter(tmp_path: Path) -> None:
    faces = np.concatenate([FACES, [[0, 0, 1]]])
    write_splatting_run(tmp_path, A, obj=splatting_files.obj_text(faces=faces))
    assert len(_read(tmp_path).embedding.triangles) == 9


@pytest.mark.parametrize("size", [3e39, 1e30, 1e-30, 1e-44])
def test_absurd_sizes_raise_nothing_else(size: float, run: Path, tmp_path: Path) -> None:
    np.savez(tmp_path / "mesh.npz", vertices=VERTICES * size, faces=FACES)
    only_avatar_errors(lambda: _read(run, mesh=tmp_path / "mesh.npz"))


def test_positions_beyond_float32_are_refused(tmp_path: Path) -> None:
    a = copy.deepcopy(A)
    a["_xyz"][:, 2] = 3.3e38
    write_splatting_run(tmp_path, a)
    np.savez(tmp_path / "mesh.npz", vertices=VERTICES * 3e39, faces=FACES)
    with pytest.raises(AvatarError, match=r"gaussians.mean: is .* finite numbers are needed"):
        _read(tmp_path, mesh=tmp_path / "mesh.npz", units=1.0)


@pytest.mark.parametrize("units", [0.0, -1.0, 1e7, float("nan"), float("inf")])
def test_impossible_units_are_refused(units: float, run: Path) -> None:
    with pytest.raises(AvatarError, match=r"--units: is .*; training units in a metre are 1e-06 to 1e"):
        _read(run, units=units)


def test_no_rig_leaves_a_rig_that_is_given_alone(run: Path) -> None:
    assert _read(run, rig=Path("none.glb")).rig is None
    with pytest.raises(AvatarError, match=r"none.glb: --rig: no such file"):
        _read(run, rig=Path("none.glb"), no_rig=False)


def test_options_without_a_use_are_refused(run: Path) -> None:
    for options in ({"rotation": "polar3"}, {"eyelids": Path("x")}, {"anchor_faces": Path("x")}):
        with pytest.raises(AvatarError, match=f"--{next(iter(options)).replace('_', '-')} is no option here"):
            _read(run, **options)


def test_missing_files_are_named(run: Path, tmp_path: Path) -> None:
    for path in (tmp_path / "nowhere", tmp_path):
        with pytest.raises(
            AvatarError, match=r"holds no point_cloud.ply with embedding.json or canonical.sample.json"
        ):
            _read(path)
    (run / "point_cloud" / "iteration_30000" / "point_cloud.ply").write_bytes(b"ply\n")
    with pytest.raises(AvatarError, match=r"splatting_avatar: .*point_cloud.ply: has no end_header"):
        _read(run)


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


TEXT = json.dumps(splatting_files.document(A))
PLACES: list[tuple[Any, ...]] = [
    *[(key,) for key in ("cano_mesh", "sample_fidxs", "sample_bary", "_xyz", "_rotation")],
    *[(key, row) for key in ("sample_fidxs", "sample_bary", "_xyz", "_rotation") for row in (0, 5, 23)],
    *[
        (key, row, column)
        for key in ("sample_bary", "_xyz", "_rotation")
        for row in (0, 23)
        for column in (0, 2)
    ],
]
VALUES = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=9)
    | st.sampled_from([2**63, -(2**63) - 1, 10**310, 1e308, 1e39, -1e-3, "embedding.obj", "\ud800"]),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=3), inner, max_size=3),
    max_leaves=6,
)  # fmt: skip


@pytest.fixture(scope="module")
def one_run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """For fuzzing: its files are overwritten by each example."""
    return write_splatting_run(tmp_path_factory.mktemp("fuzz"), A, config=None)


def _fuzz(folder: Path, name: str, data: bytes) -> None:
    (folder / name).write_bytes(data)
    assert splatting_avatar.detect(folder)
    only_avatar_errors(lambda: _read(folder))


@MANGLING
@given(mangled(TEXT.encode()))
def test_mangled_embedding(one_run: Path, data: bytes) -> None:
    _fuzz(one_run, "embedding.json", data)


@MANGLING
@given(st.sampled_from(PLACES), VALUES)
def test_any_value_anywhere_in_the_embedding(one_run: Path, place: tuple[Any, ...], value: Any) -> None:
    document = splatting_files.document(A)
    _set(place[0], *place[1:], value)(document) if len(place) > 1 else document.update({place[0]: value})
    _fuzz(one_run, "embedding.json", json.dumps(document).encode())


@pytest.fixture(scope="module")
def other_run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_splatting_run(tmp_path_factory.mktemp("fuzz"), A, config=None)


@MANGLING
@given(mangled(splatting_files.CONFIG.encode()))
def test_mangled_config(other_run: Path, data: bytes) -> None:
    _fuzz(other_run, "config.yaml", data)


@pytest.fixture(scope="module")
def third_run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_splatting_run(tmp_path_factory.mktemp("fuzz"), A, config=None)


@MANGLING
@given(mangled(splatting_files.obj_text().encode()))
def test_mangled_mesh(third_run: Path, data: bytes) -> None:
    _fuzz(third_run, "embedding.obj", data)
