"""What the SplattingAvatar reader makes of good and bad runs, and which folders it takes for runs."""

from __future__ import annotations

import copy
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from avatar_export.readers import gaussian_avatars, lam
from avatar_export.readers import table as readers
from avatar_export.readers.gaussian_blendshapes import reader as gaussian_blendshapes
from avatar_export.readers.splatting_avatar import reader as splatting_avatar
from tests.exporter.readers import lam_files, splatting_files
from tests.exporter.readers.splatting_files import (
    CONFIG,
    COUNT,
    FACES,
    VERTICES,
    read_run,
    write_splatting_run,
)
from tests.exporter.refusals import put, refused
from tests.golden import BlendshapesGolden
from tests.hostile import Array, peak_bytes

A = splatting_files.arrays()


def test_the_avatar_to_the_last_field(run: Path) -> None:
    avatar = read_run(run)
    e, g, rules, b = avatar.embedding, avatar.gaussians, avatar.rules, avatar.blendshapes
    assert e is not None
    for got, want in (
        (e.canonical_vertices, VERTICES.astype("f4") / 4), (e.triangles, FACES), (e.triangle, A["sample_fidxs"]),
        (e.barycentric, A["sample_bary"]), (e.displacement, A["_xyz"][:, 2] / 4), (e.local_offset, np.zeros((0, 3))),
        (e.local_quat_wxyz, A["_rotation"]), (g.opacity_logit, A["opacity_logit"]), (g.sh, A["sh"]),
    ):  # fmt: skip
        assert np.array_equal(got, want)
    assert np.allclose(g.log_scale, A["log_scale"].astype("f8") - np.log(4), rtol=0, atol=1e-6)
    assert (avatar.name, avatar.training_per_bundle, avatar.raster.near) == ("subject", 4.0, 0.05)
    assert (avatar.raster.background, avatar.sh_degree) == ("random", 1)
    assert [(x.first, x.count, x.binding) for x in avatar.groups] == [(0, COUNT, "surface")]
    assert (rules.position, rules.rotation, rules.scale) == ("normal", "vertex_quaternion", "log_area")
    assert (rules.sh_direction, rules.quaternion_sign) == ("inverse_rotation", "w_positive")
    assert not any(p.entries for p in (b.geometry, b.appearance, b.correctives, b.late_morphs, avatar.skin))
    assert avatar.rig is None and avatar.clips == () and avatar.expressions == ()
    p = avatar.provenance
    assert (p["system"], p["form"]) == ("splatting_avatar", "embedding.json")
    names = ["config.yaml", "embedding.json", "embedding.obj", "point_cloud.ply"]
    assert [f["path"] for f in p["source_files"]] == names


def test_both_forms_are_one_avatar(run: Path, tmp_path: Path) -> None:
    legacy = splatting_files.legacy(A)
    write_splatting_run(tmp_path / "old", A, embedding=legacy, form="canonical.sample.json")
    assert splatting_avatar.detect(tmp_path / "old")
    new, old = read_run(run), read_run(tmp_path / "old")
    assert old.provenance["form"] == "canonical.sample.json"
    for field in ("canonical_vertices", "triangle", "barycentric", "displacement", "local_quat_wxyz"):
        assert np.array_equal(getattr(new.embedding, field), getattr(old.embedding, field))


@pytest.mark.parametrize(
    "name", ["/elsewhere/run/mesh.obj", r"C:\runs\mesh.obj", "../../mesh.obj", "mesh.obj"]
)
def test_the_mesh_lies_beside_whatever_folder_is_named(name: str, run: Path, tmp_path: Path) -> None:
    """The file names a path of the trainer's machine; nothing outside the run is opened."""
    folder = run / "point_cloud" / "iteration_30000"
    for decoy in (run, run.parent):
        (decoy / "mesh.obj").write_text(splatting_files.obj_text(VERTICES * 3))
    (folder / "embedding.json").write_text(json.dumps({**splatting_files.document(A), "cano_mesh": name}))
    refused("embedding.json: names '.*', .* no 'mesh.obj' beside it; .*--mesh", read_run, run)
    (folder / "embedding.obj").rename(folder / "mesh.obj")
    assert np.array_equal(read_run(run).embedding.canonical_vertices, VERTICES.astype("f4") / 4)
    assert read_run(run, mesh=run / "mesh.obj").embedding.canonical_vertices.max() > 0.05


def test_the_newest_iteration_is_read(run: Path) -> None:
    for iteration, logit in ((9000, 1.0), (100000, 2.0)):
        write_splatting_run(run, {**A, "opacity_logit": np.full(COUNT, logit, "f4")}, iteration=iteration)
    (run / "point_cloud" / "iteration_final").mkdir()
    older = run / "point_cloud" / "iteration_9000"
    for path, logit in ((run, 2), (older, 1), (older / "point_cloud.ply", 1)):
        assert splatting_avatar.detect(path)
        avatar = read_run(path)
        assert (avatar.gaussians.opacity_logit == logit).all()
        assert (avatar.name, avatar.training_per_bundle) == ("subject", 4.0)  # the run's config.yaml


HEAD, BODY = "dataset: {frameset_type: imavatar}\n", "dataset: {frameset_type: instant_avatar}\n"


@pytest.mark.parametrize(
    ("config", "options", "found", "said"),
    [
        (HEAD, {}, (4, "log_area", "world", 1), "imavatar"),
        (BODY, {}, (1, "none", "world", 1), "instant_avatar"),
        ("seed: 1\n", {}, (1, "none", "world", 1), "assumed"),
        (None, {}, (1, "none", "world", 1), "point_cloud.ply"),
        (BODY + "model: {with_mesh_scaling: true, sh_degree: 0}\n", {}, (1, "log_area", "world", 0), "model.sh_degree"),
        ("pipe: {convert_SHs_python: true}\n", {}, (1, "none", "inverse_rotation", 1), "pipe.convert_SHs_python"),
        (CONFIG, {"units": 2.5, "mesh_scaling": False, "sh_direction": "world", "sh_degree": 0},
         (2.5, "none", "world", 0), "--units"),
        ("model: {sh_degree: x, with_mesh_scaling: 3}\npipe: {convert_SHs_python: 1}\n",
         {"mesh_scaling": True, "sh_direction": "world", "sh_degree": 1}, (1, "log_area", "world", 1), "--sh-degree"),
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
    assert rules.quaternion_sign == "w_positive"
    assert read_run(tmp_path, **options, quaternion_sign="largest_positive").rules.quaternion_sign[0] == "l"


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
    for said in ("no _rotation", "_xyz of 2 Gaussians", "0.00098", "0.0525 m high", "another frame's"):
        assert said in notes


def test_detection(run: Path, blendshapes_golden: BlendshapesGolden, tmp_path: Path) -> None:
    plain = splatting_files.write_gaussian_run(tmp_path / "plain", A, binding=False, vertices=None)
    bound = splatting_files.write_gaussian_run(tmp_path / "bound", A)
    zipped = lam_files.write_zip(tmp_path / "made.zip", lam_files.files())
    modules = (splatting_avatar, gaussian_avatars, gaussian_blendshapes, lam)
    for path, want in (
        (run, ["splatting_avatar"]), (plain, []), (bound, ["gaussian_avatars"]),
        (tmp_path / "bound", ["gaussian_avatars"]), (zipped, ["lam"]),
        (blendshapes_golden.viewer, ["gaussian_blendshapes"]), (blendshapes_golden.raw, ["gaussian_blendshapes"]),
    ):  # fmt: skip
        assert [module.SYSTEM for module in modules if module.detect(path)] == want
        assert not want or readers.find(path).system == want[0]


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda d: d["sample_fidxs"].pop(), "sample_fidxs: has 23 rows, .* 24"),
        *((put("sample_bary", value), "sample_bary: is not a list") for value in (3, None)),
        *((lambda d, key=key: d.pop(key), f"{key}: is missing") for key in ("sample_bary", "cano_mesh")),
        (put("cano_mesh", 3), "cano_mesh: is not text"),
        *((put("cano_mesh", name), "cano_mesh: is not a file name") for name in ("..", "a/", "a\0b", "\ud800")),
        (put("cano_mesh", "point_cloud.ply"), "point_cloud.ply: is not a mesh"),
        (put("sample_fidxs", 5, 8), r"sample_fidxs\[5\]: is 8, .* \(0..7\)"),
        (put("sample_fidxs", 5, 1.5), r"sample_fidxs\[5\]: is 1.5"),
        *((put("sample_fidxs", 5, value), r"sample_fidxs\[5\]: is not a number") for value in (True, [1])),
        *((put("sample_bary", 6, value), r"sample_bary\[6\]: is not a list of 3")
          for value in ([0.5, 0.5], "abc", {"a": 1, "b": 2, "c": 3})),
        *((put("sample_bary", 6, value), r"sample_bary\[6\]: is not a number")
          for value in ([1, "0.5", 0], [1, None, 0], [True, False, False])),
        (put("sample_bary", 6, [0.5, 0.3, 0.2002]), r"sample_bary\[6\]: adds up to 1.0002"),
        (put("sample_bary", 6, [-0.0011, 0.5, 0.5011]), r"sample_bary\[6\]: has a weight of -0.0011"),
        (put("_xyz", 9, 2, 1e39), r"_xyz\[9\]: .*1e\+39.*not finite"),
        (put("_rotation", 9, 3, 10**310), "_rotation: .*too large"),
    ],
)  # fmt: skip
def test_bad_embeddings(change: Callable[[Any], Any], message: str, tmp_path: Path) -> None:
    document = splatting_files.document(A)
    change(document)
    write_splatting_run(tmp_path, A, embedding=document)
    assert refused(message, read_run, tmp_path).owner == "splatting_avatar"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "not valid JSON"),
        ("[1, 2]", "not a JSON object"),
        ('{"sample_fidxs": [NaN]}', "NaN is not a number"),
        ('{"a": [' * 7000, "too deeply"),  # 14,000 levels; Python 3.13 reads up to 10,000
        *(("[" + part, "far more lists") for part in ("[],[]," * 40000, "0," * 40000, "{},[]" * 9000)),
        (" " * 1_100_000, "1100000 bytes long; up to 1073152"),
        ("\udc80", "not valid JSON"),
    ],
)
def test_what_is_no_embedding(text: str, message: str, run: Path) -> None:
    path = run / "point_cloud" / "iteration_30000" / "embedding.json"
    path.write_bytes(text.encode("utf8", errors="surrogateescape"))
    assert splatting_avatar.detect(run)
    assert peak_bytes(lambda: refused(message, read_run, run)) < 20e6


BOMB = "a0: &a0 [x, x, x, x, x, x, x, x, x]\n" + "".join(
    f"a{i}: &a{i} [{', '.join([f'*a{i - 1}'] * 9)}]\n" for i in range(1, 12)
)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("- 1\n", "has no settings"),
        *((text, "is not YAML") for text in (
            "a: [1\n", "a: !!python/object/apply:os.system [true]\n", "a: !!python/name:os.system\n",
            "a: !!int ''\n", "a: !!timestamp 2001-99-99\n", "a: " + "[" * 3000, "a: " + "9" * 5000)),
        *((text, "aliases") for text in ("a: &a [1]\nb: *a\n", "a: &a {b: 1}\nc: {<<: *a}\n", BOMB)),
        ("#" * 70_000, "70000 bytes long; up to 65536"),
        ("model: {with_mesh_scaling: 1}\n", "model.with_mesh_scaling: is '1', expected bool"),
        ("model: {sh_degree: 2}\n", "degree 1, .* says 2; .*--sh-degree"),
        ("model: {xyz_as_uvd: false}\n", "model.xyz_as_uvd: is false"),
        ("pipe: {convert_SHs_python: 'no'}\n", "pipe.convert_SHs_python: is 'no', expected bool"),
    ],
)  # fmt: skip
def test_bad_configs(text: str, message: str, tmp_path: Path) -> None:
    write_splatting_run(tmp_path, A, config=text)
    refused(message, read_run, tmp_path)


@pytest.mark.parametrize(
    ("vertices", "faces", "message"),
    [
        (VERTICES, FACES[:5], r"sample_fidxs\[\d+\]: is \d, .* \(0..4\)"),
        (VERTICES[:5], FACES, "embedding.obj: line 16: face 4 has corners 3, 1, 6, .* 1..5"),
        (np.where(VERTICES == 0.11, 1e-7, VERTICES), np.concatenate([FACES[:1] * 0, FACES[1:]]),
         r"embedding.obj: triangle 0 \(vertices 0, 0, 0\) has no area, but carries Gaussian \d+"),
        (np.concatenate([VERTICES[:4], (VERTICES[:1] + VERTICES[2:3]) / 2, VERTICES[5:]]), FACES,
         r"triangle 0 \(vertices 0, 2, 4\) has no area"),
    ],
)  # fmt: skip
def test_bad_meshes(vertices: Array, faces: Array, message: str, tmp_path: Path) -> None:
    write_splatting_run(tmp_path, A, obj=splatting_files.obj_text(vertices, faces))
    refused(message, read_run, tmp_path)


def test_bad_options(run: Path) -> None:
    for option in ("rig", "body_model", "shape", "poses"):
        flag = f"--{option.replace('_', '-')}"
        refused(f"splatting_avatar: {flag} .*--no-rig", read_run, run, **{option: Path("any")})
    refused("none.glb: --rig: no such file", read_run, run, rig=Path("none.glb"), no_rig=False)
    for option, value in (("rotation", "polar3"), ("eyelids", Path("x")), ("anchor_faces", Path("x"))):
        flag = f"--{option.replace('_', '-')}"
        refused(f"{flag} cannot be used here", read_run, run, **{option: value})


def test_missing_files_are_named(run: Path, tmp_path: Path) -> None:
    options = splatting_avatar.WITHOUT_RIG
    refused("no point_cloud.ply with embedding.json or", splatting_avatar.read, tmp_path, options)
    (run / "point_cloud" / "iteration_30000" / "point_cloud.ply").write_bytes(b"ply\n")
    refused("splatting_avatar: .*point_cloud.ply: has no end_header", read_run, run)
