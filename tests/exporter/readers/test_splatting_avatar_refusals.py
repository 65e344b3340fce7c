"""What the SplattingAvatar reader refuses, and what it lets pass at the border."""

from __future__ import annotations

import copy
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from avatar_export.readers.splatting_avatar import reader as splatting_avatar
from avatar_runtime.io.errors import AvatarError
from tests.exporter.readers import splatting_files
from tests.exporter.readers.splatting_files import (
    FACES,
    VERTICES,
    put,
    read_run,
    write_splatting_run,
)
from tests.hostile import Array, only_avatar_errors, peak_bytes

A = splatting_files.arrays()


def _without(key: str) -> Callable[[dict[str, Any]], None]:
    return lambda document: document.pop(key)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda d: d["sample_fidxs"].pop(), r"json: sample_fidxs: has 23 rows, but the .ply has 24 Gaussians"),
        (lambda d: d["_xyz"].append([0, 0, 0]), r"_xyz: has 25 rows, but the .ply has 24 Gaussians"),
        (lambda d: d.update(sample_bary=3), "sample_bary: is not a list, but the .ply has 24 Gaussians"),
        (lambda d: d.update(sample_bary=None), "sample_bary: is not a list"),
        (_without("sample_bary"), "sample_bary: is missing"),
        (_without("cano_mesh"), "cano_mesh: is missing"),
        (lambda d: d.update(cano_mesh=3), "cano_mesh: is not text"),
        (lambda d: d.update(cano_mesh=".."), "cano_mesh: is not a file name"),
        (lambda d: d.update(cano_mesh="a/"), "cano_mesh: is not a file name"),
        (lambda d: d.update(cano_mesh="a\0b"), "cano_mesh: is not a file name"),
        (lambda d: d.update(cano_mesh="\ud800"), "cano_mesh: is not a file name"),
        (lambda d: d.update(cano_mesh="embedding.ply"), "but there is no 'embedding.ply' beside it"),
        (lambda d: d.update(cano_mesh="point_cloud.ply"), "point_cloud.ply: is not a mesh file that can be read"),
        (put("sample_fidxs", 5, 8), r"sample_fidxs\[5\]: is 8, but the mesh has 8 triangles \(0..7\)"),
        (put("sample_fidxs", 5, -1), r"sample_fidxs\[5\]: is -1, but"),
        (put("sample_fidxs", 5, 1.5), r"sample_fidxs\[5\]: is 1.5, but"),
        (put("sample_fidxs", 5, 10**300), r"sample_fidxs\[5\]: is 1e\+300, but"),
        (put("sample_fidxs", 5, True), r"sample_fidxs\[5\]: is not a number"),
        (put("sample_fidxs", 5, [1]), r"sample_fidxs\[5\]: is not a number"),
        (put("sample_bary", 6, [0.5, 0.5]), r"sample_bary\[6\]: is not a list of 3 numbers"),
        (put("sample_bary", 6, "abc"), r"sample_bary\[6\]: is not a list of 3 numbers"),
        (put("sample_bary", 6, {"a": 1, "b": 2, "c": 3}), r"sample_bary\[6\]: is not a list of 3 numbers"),
        (put("sample_bary", 6, 1, "0.5"), r"sample_bary\[6\]: is not a number"),
        (put("sample_bary", 6, 1, None), r"sample_bary\[6\]: is not a number"),
        (put("sample_bary", 6, [True, False, False]), r"sample_bary\[6\]: is not a number"),
        (put("sample_bary", 6, [0.5, 0.3, 0.2002]), r"sample_bary\[6\]: adds up to 1.0002, expected 1 within 0.0001"),
        (put("sample_bary", 6, [-0.0011, 0.5, 0.5011]), r"sample_bary\[6\]: has a weight of -0.0011, far outside"),
        (put("_xyz", 9, 2, 1e39), r"_xyz\[9\]: is \[.*1e\+39\], which is not finite in float32"),
        (put("_rotation", 9, 3, 10**310), "_rotation: holds a number that is too large"),
        (put("_rotation", 9, [1, 0, 0]), r"_rotation\[9\]: is not a list of 4 numbers"),
    ],
)  # fmt: skip
def test_bad_embeddings_are_refused(change: Callable[[Any], Any], message: str, tmp_path: Path) -> None:
    document = splatting_files.document(A)
    change(document)
    write_splatting_run(tmp_path, A, embedding=document)
    with pytest.raises(AvatarError, match=message) as caught:
        read_run(tmp_path)
    assert caught.value.owner == "splatting_avatar"


def test_weights_up_to_the_tolerances_are_kept(tmp_path: Path) -> None:
    a = copy.deepcopy(A)
    a["sample_bary"][6] = [-1e-3, 0.5, 0.501]
    a["sample_bary"][7] = [0.5, 0.3, 0.20009]
    write_splatting_run(tmp_path, a)
    assert np.array_equal(read_run(tmp_path).embedding.barycentric, a["sample_bary"])


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "is not valid JSON"),
        ("[1, 2]", "is not a JSON object"),
        ('{"sample_fidxs": [NaN]}', "NaN is not a number"),
        ('{"sample_fidxs": [-Infinity]}', "-Infinity is not a number"),
        ('{"a": [' * 7000, "it is nested too deeply"),  # 14,000 levels; Python 3.13 reads up to 10,000
        ('{"a": ' + "9" * 5000 + "}", "is not valid JSON"),
        ("[" + "[],[]," * 40000, "has far more lists and numbers than 24 Gaussians need"),
        ("[" + "0," * 40000, "has far more lists"),
        ("[" + "{},[]" * 9000, "has far more lists"),
        (" " * 1_100_000, r"is 1100000 bytes long; up to 1073152 are read"),
        ("\udc80", "is not valid JSON"),
    ],
)
def test_what_is_no_embedding_is_refused(text: str, message: str, run: Path) -> None:
    path = run / "point_cloud" / "iteration_30000" / "embedding.json"
    path.write_bytes(text.encode("utf8", errors="surrogateescape"))
    assert splatting_avatar.detect(run)

    def read() -> None:
        with pytest.raises(AvatarError, match=message):
            read_run(run)

    assert peak_bytes(read) < 20e6


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("- 1\n", "config.yaml: has no settings"),
        ("a: [1\n", "config.yaml: is not YAML that can be read"),
        ("a: &a [1]\nb: *a\n", "aliases are not supported; write them out"),
        ("a: &a {b: 1}\nc: {<<: *a}\n", "aliases are not supported; write them out"),
        ("a: !!python/object/apply:os.system [true]\n", "is not YAML that can be read"),
        ("a: !!python/name:os.system\n", "is not YAML that can be read"),
        ("a: !!int ''\n", "is not YAML that can be read"),
        ("a: !!timestamp 2001-99-99\n", "is not YAML that can be read"),
        ("a: " + "[" * 3000, "is not YAML that can be read"),
        ("a: " + "9" * 5000, "is not YAML that can be read"),
        ("#" * 70_000, "is 70000 bytes long; up to 65536 are read"),
        ("model: {with_mesh_scaling: 1}\n", "config.yaml: model.with_mesh_scaling: is '1', expected bool"),
        ("model: {sh_degree: true}\n", "model.sh_degree: is 'True', expected int"),
        ("model: {sh_degree: 2}\n", r"stores SH of degree 1, but config.yaml model.sh_degree says 2; pass --sh-degree"),
        ("model: {sh_degree: -1}\n", "says -1; pass --sh-degree"),
        ("model: {xyz_as_uvd: false}\n", "model.xyz_as_uvd: is false: these Gaussians are not embedded in the mesh"),
        ("pipe: {convert_SHs_python: 'no'}\n", "pipe.convert_SHs_python: is 'no', expected bool"),
        ("dataset: {frameset_type: 3}\n", "dataset.frameset_type: is '3', expected str"),
    ],
)  # fmt: skip
def test_bad_configs_are_refused(text: str, message: str, tmp_path: Path) -> None:
    write_splatting_run(tmp_path, A, config=text)
    with pytest.raises(AvatarError, match=message):
        read_run(tmp_path)


def test_yaml_bombs_stay_small(tmp_path: Path) -> None:
    bomb = "a0: &a0 [x, x, x, x, x, x, x, x, x]\n"
    bomb += "".join(f"a{i}: &a{i} [{', '.join([f'*a{i - 1}'] * 9)}]\n" for i in range(1, 12))
    write_splatting_run(tmp_path, A, config=bomb)
    with pytest.raises(AvatarError, match="aliases are not supported"):
        read_run(tmp_path)


@pytest.mark.parametrize(
    ("vertices", "faces", "message"),
    [
        (VERTICES, FACES[:5], r"sample_fidxs\[\d+\]: is \d, but the mesh has 5 triangles \(0..4\)"),
        (VERTICES[:5], FACES, r"embedding.obj: line 16: face 4 has corners 3, 1, 6, but there are vertices 1..5"),
        (np.where(VERTICES == 0.11, 1e-7, VERTICES), np.concatenate([FACES[:1] * 0, FACES[1:]]),
         r"embedding.obj: triangle 0 \(vertices 0, 0, 0\) has no area, but carries Gaussian \d+; repair"),
        (np.concatenate([VERTICES[:4], (VERTICES[:1] + VERTICES[2:3]) / 2, VERTICES[5:]]), FACES,
         r"triangle 0 \(vertices 0, 2, 4\) has no area"),
    ],
)  # fmt: skip
def test_bad_meshes_are_refused(vertices: Array, faces: Array, message: str, tmp_path: Path) -> None:
    write_splatting_run(tmp_path, A, obj=splatting_files.obj_text(vertices, faces))
    with pytest.raises(AvatarError, match=message):
        read_run(tmp_path)


def test_a_flat_triangle_without_gaussians_is_no_matter(tmp_path: Path) -> None:
    faces = np.concatenate([FACES, [[0, 0, 1]]])
    write_splatting_run(tmp_path, A, obj=splatting_files.obj_text(faces=faces))
    assert len(read_run(tmp_path).embedding.triangles) == 9


@pytest.mark.parametrize("size", [3e39, 1e30, 1e-30, 1e-44])
def test_absurd_sizes_raise_nothing_else(size: float, run: Path, tmp_path: Path) -> None:
    np.savez(tmp_path / "mesh.npz", vertices=VERTICES * size, faces=FACES)
    only_avatar_errors(lambda: read_run(run, mesh=tmp_path / "mesh.npz"))


def test_positions_beyond_float32_are_refused(tmp_path: Path) -> None:
    a = copy.deepcopy(A)
    a["_xyz"][:, 2] = 3.3e38
    write_splatting_run(tmp_path, a)
    np.savez(tmp_path / "mesh.npz", vertices=VERTICES * 3e39, faces=FACES)
    with pytest.raises(AvatarError, match=r"gaussians.mean: is .* finite numbers are needed"):
        read_run(tmp_path, mesh=tmp_path / "mesh.npz", units=1.0)


@pytest.mark.parametrize("units", [0.0, -1.0, 1e7])
def test_impossible_units_are_refused(units: float, run: Path) -> None:
    with pytest.raises(ValueError, match=r"units is .*; 1e-06 to 1e\+06 is needed"):
        read_run(run, units=units)


@pytest.mark.parametrize("units", [float("nan"), float("inf")])
def test_units_that_are_not_finite_are_refused(units: float, run: Path) -> None:
    with pytest.raises(ValueError, match=r"units is .*; a finite number is needed"):
        read_run(run, units=units)


@pytest.mark.parametrize("option", ["rig", "body_model", "shape", "poses"])
def test_no_rig_refuses_what_only_a_rig_uses(option: str, run: Path) -> None:
    flag = f"--{option.replace('_', '-')}"
    with pytest.raises(
        AvatarError, match=rf"splatting_avatar: {flag} would have no .*; leave out {flag}, or --no-rig"
    ):
        read_run(run, **{option: Path("any")})


def test_a_rig_that_is_missing_is_named(run: Path) -> None:
    with pytest.raises(AvatarError, match=r"none.glb: --rig: no such file"):
        read_run(run, rig=Path("none.glb"), no_rig=False)


def test_options_without_a_use_are_refused(run: Path) -> None:
    for options in ({"rotation": "polar3"}, {"eyelids": Path("x")}, {"anchor_faces": Path("x")}):
        with pytest.raises(
            AvatarError, match=f"--{next(iter(options)).replace('_', '-')} cannot be used here"
        ):
            read_run(run, **options)


def test_missing_files_are_named(run: Path, tmp_path: Path) -> None:
    for path in (tmp_path / "nowhere", tmp_path):
        with pytest.raises(
            AvatarError, match=r"has no point_cloud.ply with embedding.json or canonical.sample.json"
        ):
            splatting_avatar.read(path, splatting_avatar.WITHOUT_RIG)
    (run / "point_cloud" / "iteration_30000" / "point_cloud.ply").write_bytes(b"ply\n")
    with pytest.raises(AvatarError, match=r"splatting_avatar: .*point_cloud.ply: has no end_header"):
        read_run(run)
