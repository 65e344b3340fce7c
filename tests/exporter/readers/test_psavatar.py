"""What the PSAvatar reader makes of good runs, what it refuses, and which folders it takes for runs."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from avatar_export.bodies.body_model import read_body_model
from avatar_export.bodies.body_rig import bake_rig
from avatar_export.options import ReadOptions
from avatar_export.readers import table as readers
from avatar_export.readers.psavatar import reader as psavatar
from avatar_export.readers.psavatar.files import read_points
from avatar_runtime.avatar import Rig
from tests.exporter.readers import splatting_files
from tests.exporter.readers.psavatar_run import COUNT, NAMES, arrays, read_run, write_run
from tests.exporter.refusals import put, refused
from tests.rigs import dense

A = arrays()
JOINTS = ("root", "neck", "jaw", "leftEye", "rightEye")
EXPRESSIONS = ["exp_000", "exp_001", "exp_002"]
Change = Callable[[dict[str, Any]], Any]


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("runs") / "subject"
    write_run(folder, A, {"acquisition": "points", "order": "mesh_first"})
    return folder


def rig_of(run: Path) -> Rig:
    return bake_rig(read_body_model(run / "body.npz"))


def taught(run: Path, rig: Rig) -> Rig:
    """`rig` with what the run's points have learned."""
    points = read_points(run / "point_cloud" / "iteration_9" / "psavatar.npz", COUNT)
    return psavatar.taught(rig, EXPRESSIONS, points, 0.0)


def test_the_avatar_to_the_last_field(run: Path) -> None:
    avatar, stored = read_run(run), splatting_files.arrays()
    e, g, rules = avatar.embedding, avatar.gaussians, avatar.rules
    assert e is not None and avatar.rig is not None
    for name in {*A} - {"basis", "basis_names", "training_per_metre"}:
        assert np.array_equal(getattr(e, name), A[name]), name
    for name in ("log_scale", "sh", "opacity_logit"):
        assert np.array_equal(getattr(g, name), stored[name]), name
    assert e.local_offset.shape == (0, 3) and avatar.enhancer is None
    found = (rules.position, rules.rotation, rules.scale, rules.sh_direction)
    assert found == ("interpolated_normal", "bary_vertex_lbs", "none", "inverse_rotation")
    assert (avatar.name, avatar.training_per_bundle, avatar.sh_degree) == ("subject", 4.0, 1)
    assert avatar.raster.near == pytest.approx(0.05) and avatar.raster.background == "random"
    assert [(x.first, x.count, x.binding) for x in avatar.groups] == [(0, COUNT, "surface")]
    p = avatar.provenance
    assert p["system"] == "psavatar"
    files = ["body_model/body.npz", "point_cloud.ply", "psavatar.npz", "rules.json"]
    assert [f["path"] for f in p["source_files"]] == files
    assert "mesh_first" in str(p["notes"]) and "0.000 mm" in str(p["notes"])


def test_learned_bases_are_added_to_those_of_the_body_model(run: Path) -> None:
    rig, plain = read_run(run).rig, rig_of(run)
    assert rig is not None
    morphs, correctives = dense(plain.morphs, "position"), dense(plain.correctives, "position")
    for name, basis in zip(NAMES, A["basis"], strict=True):
        kind, at, *entry = name.split("/")
        if kind == "expression":
            morphs[:, int(at[-3:])] += basis
        else:  # the root corrects nothing
            correctives[:, 9 * (JOINTS.index(at) - 1) + 3 * int(entry[0]) + int(entry[1])] += basis
    np.testing.assert_allclose(dense(rig.morphs, "position"), morphs, atol=1e-9)
    np.testing.assert_allclose(dense(rig.correctives, "position"), correctives, atol=1e-9)
    for name in ("joint_basis", "rest_local", "inverse_bind_matrix", "corrective_joints", "vertices"):
        assert np.array_equal(getattr(rig, name), getattr(plain, name)), name


def test_bad_options_and_rigs(run: Path) -> None:
    plain = rig_of(run)
    rest = plain.rest_local.copy()
    rest[2, :3, :3] = [[0, -1, 0], [1, 0, 0], [0, 0, 1]]
    refused("joint 'jaw' of the rig has a rotated rest frame", taught, run, replace(plain, rest_local=rest))
    shape = Path("zero")
    refused("--body-model and --shape", read_run, run, no_rig=True, body_model=run / "body.npz", shape=shape)
    refused("needs the skeleton of its training", psavatar.read, run, ReadOptions())
    refused("--units cannot be used here", psavatar.read, run, ReadOptions(units=4.0))


def test_without_a_rig_it_is_an_approximation(run: Path) -> None:
    avatar = read_run(run, no_rig=True)
    assert avatar.rig is None and avatar.rules.rotation == "vertex_quaternion"
    assert "without a rig" in str(avatar.provenance["notes"])


def test_it_is_detected_by_content(run: Path, tmp_path: Path) -> None:
    write_run(tmp_path / "renamed", A, name="anything.npz")
    for path in (run, run / "point_cloud" / "iteration_9", tmp_path / "renamed"):
        assert psavatar.detect(path) and readers.find(path).system == "psavatar"
    folder = write_run(tmp_path / "less", {key: A[key] for key in A if key != "basis"})
    (folder / "junk.npz").write_bytes(b"PK\3\4")
    splatting_files.write_splatting_run(tmp_path / "other", splatting_files.arrays())
    assert not any(psavatar.detect(path) for path in (tmp_path / "less", tmp_path / "other", tmp_path))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda a: a.update(triangle=a["triangle"][:-1]), r"triangle: expected whole numbers \[24\], got int32\[23\]"),
        *((put("triangle", 5, value), rf"triangle\[5\]: is {value}, .* 92 triangles") for value in (-1, 92)),
        (put("triangles", (3, 1), 63), r"triangles\[3\]: is \[.*63.*\], but there are 63 vertices"),
        (put("triangles", A["triangle"][4], [1, 1, 2]), "1, 1, 2. has no area, but carries"),
        (put("barycentric", 6, [0.5, 0.3, 0.3]), r"barycentric\[6\]: adds up to 1.1"),
        *((put("displacement", 9, value), r"displacement\[9\]: is not finite.* 10000") for value in (np.nan, 2e4)),
        *((put("canonical_vertices", (2, 0), value), r"canonical_vertices\[2\]: is not finite.* 10000")
          for value in (np.inf, 1e20)),
        (put("canonical_vertices", np.zeros((0, 3), "f4")), "there are 0 vertices"),
        (lambda a: a.update(local_quat_wxyz=a["local_quat_wxyz"][:, :3]), r"expected floats \[24, 4\]"),
        (put("basis", (2, 0, 0), 7.0), r"basis\[2\] \(pose/neck/1/1\): moves a vertex by more"),
        (put("basis_names", np.array(NAMES[:3])), "basis_names: has 3 names, expected 4 different"),
        *((put("basis_names", 0, name), f"'{name}' is neither") for name in ("pose/jaw/0/3", "jaw")),
        (put("basis_names", 0, "pose/jew/0/2"), "'jew' is not a joint of the rig; did you"),
        (put("basis_names", 1, "expression/exp_101"), "exp_101"),
        (put("training_per_metre", 0, 0.0), "training units per metre"),
    ],
)  # fmt: skip
def test_bad_arrays(change: Change, message: str, tmp_path: Path) -> None:
    a = {key: value.copy() for key, value in A.items()}
    change(a)
    write_run(tmp_path, a)
    assert refused(message, read_run, tmp_path).owner == "psavatar"


def test_bad_files_beside_it(tmp_path: Path) -> None:
    folder = write_run(tmp_path, A, {"order": "as_printed"})
    refused("rules.order: is 'as_printed', expected one of mesh_first", read_run, tmp_path)
    (tmp_path / "rules.json").unlink()
    (folder / "enhancer.onnx").write_bytes(b"")
    refused("enhancer.json: is missing", read_run, tmp_path)
