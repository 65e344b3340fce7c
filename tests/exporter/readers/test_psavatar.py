"""What the PSAvatar reader makes of good runs, what it refuses, and which folders it takes for runs."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given

from avatar_export.bodies.body_model import read_body_model
from avatar_export.bodies.body_rig import bake_rig
from avatar_export.options import ReadOptions
from avatar_export.readers import table as readers
from avatar_export.readers.psavatar import reader as psavatar
from avatar_export.readers.psavatar.files import StoredPoints, read_points
from avatar_runtime.avatar import F32, Rig, SparseRows
from avatar_runtime.io.errors import AvatarError
from tests.exporter.readers import splatting_files
from tests.exporter.readers.psavatar_run import COUNT, NAMES, arrays, read_run, write_run
from tests.hostile import MANGLING, mangled, only_avatar_errors, peak_bytes

A = arrays()
JOINTS = ("root", "neck", "jaw", "leftEye", "rightEye")
Change = Callable[[dict[str, Any]], Any]


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("runs") / "subject"
    write_run(folder, A, {"acquisition": "points", "order": "mesh_first"})
    return folder


def dense(sparse: SparseRows) -> F32:
    """[rows, columns, 3] of `position`."""
    found = np.zeros((sparse.rows, sparse.columns, 3), np.float32)
    for row in range(sparse.rows):
        for e in range(int(sparse.row_ptr[row]), int(sparse.row_ptr[row + 1])):
            found[row, sparse.column[e]] = sparse.values["position"][e]
    return found


def rig_of(run: Path) -> Rig:
    return bake_rig(read_body_model(run / "body.npz"))


def points_of(run: Path) -> StoredPoints:
    return read_points(run / "point_cloud" / "iteration_9" / "psavatar.npz", COUNT)


def test_the_avatar_to_the_last_field(run: Path) -> None:
    avatar, stored = read_run(run), splatting_files.arrays()
    e, g, rules = avatar.embedding, avatar.gaussians, avatar.rules
    assert e is not None and avatar.rig is not None
    assert np.array_equal(e.canonical_vertices, A["canonical_vertices"])
    assert np.array_equal(e.triangles, A["triangles"]) and np.array_equal(e.triangle, A["triangle"])
    assert np.array_equal(e.barycentric, A["barycentric"])
    assert np.array_equal(e.displacement, A["displacement"])
    assert np.array_equal(e.local_quat_wxyz, A["local_quat_wxyz"]) and e.local_offset.shape == (0, 3)
    assert np.array_equal(g.log_scale, stored["log_scale"]) and np.array_equal(g.sh, stored["sh"])
    assert np.array_equal(g.opacity_logit, stored["opacity_logit"])
    assert (rules.position, rules.rotation, rules.scale, rules.sh_direction) == (
        "interpolated_normal", "bary_vertex_lbs", "none", "inverse_rotation",
    )  # fmt: skip
    assert (avatar.name, avatar.training_per_bundle, avatar.sh_degree) == ("subject", 4.0, 1)
    assert avatar.raster.near == pytest.approx(0.05) and avatar.raster.background == "random"
    assert [(x.first, x.count, x.binding) for x in avatar.groups] == [(0, COUNT, "surface")]
    assert avatar.enhancer is None
    p = avatar.provenance
    assert p["system"] == "psavatar"
    assert [f["path"] for f in p["source_files"]] == [
        "body_model/body.npz", "point_cloud.ply", "psavatar.npz", "rules.json",
    ]  # fmt: skip
    notes = {note.kind: note.values for note in p["notes"]}
    assert notes["recorded_rules"]["rules"]["order"] == "mesh_first" and notes["rig_fits"]["far"] < 1e-3


def test_learned_bases_are_added_to_those_of_the_body_model(run: Path) -> None:
    rig, plain = read_run(run).rig, rig_of(run)
    assert rig is not None
    morphs, correctives = dense(plain.morphs), dense(plain.correctives)
    for name, basis in zip(NAMES, A["basis"], strict=True):
        parts = name.split("/")
        if parts[0] == "expression":
            morphs[:, int(parts[1][-3:])] += basis
        else:
            corrective = JOINTS.index(parts[1]) - 1  # the root corrects nothing
            correctives[:, 9 * corrective + 3 * int(parts[2]) + int(parts[3])] += basis
    np.testing.assert_allclose(dense(rig.morphs), morphs, atol=1e-9)
    np.testing.assert_allclose(dense(rig.correctives), correctives, atol=1e-9)
    for name in ("joint_basis", "rest_local", "inverse_bind_matrix", "corrective_joints", "vertices"):
        assert np.array_equal(getattr(rig, name), getattr(plain, name)), name


def test_what_hardly_moves_a_vertex_is_left_out_unless_exact(tmp_path: Path) -> None:
    a = {**A, "basis": A["basis"].copy()}
    a["basis"][1] = 0  # expression/exp_001
    a["basis"][1, 8] = (2e-9, 0, 0)
    a["basis"][1, 7] = (5e-10, -9e-10, 0)
    write_run(tmp_path, a)
    plain = dense(rig_of(tmp_path).morphs)[7, 1]
    found = {
        exact: read_run(tmp_path, body_model=tmp_path / "body.npz", shape=Path("zero"), exact=exact).rig
        for exact in (False, True)
    }
    assert found[False] is not None and found[True] is not None
    assert np.array_equal(dense(found[False].morphs)[7, 1], plain)
    assert np.array_equal(dense(found[False].morphs)[8, 1], dense(found[True].morphs)[8, 1])
    wanted = plain.astype(float) + a["basis"][1, 7]
    assert np.array_equal(dense(found[True].morphs)[7, 1], wanted.astype("f4"))


def test_a_rig_without_correctives_gets_those_that_were_learned(run: Path) -> None:
    plain = rig_of(run)
    empty = SparseRows.empty(len(plain.vertices), 0, {"position": (3,)})
    bare = replace(plain, correctives=empty, corrective_joints=np.zeros(0, np.int32))
    rig = psavatar.taught(bare, ["exp_000", "exp_001", "exp_002"], points_of(run), 0.0)
    assert rig.corrective_joints.tolist() == [2, 1]  # jaw, neck: as they are named
    assert rig.correctives.columns == 18
    np.testing.assert_allclose(dense(rig.correctives)[:, 2], A["basis"][0], atol=1e-9)  # jaw, row 0 column 2
    np.testing.assert_allclose(
        dense(rig.correctives)[:, 13], A["basis"][2], atol=1e-9
    )  # neck, row 1 column 1


def test_a_rig_whose_joints_rest_turned_is_refused(run: Path) -> None:
    plain = rig_of(run)
    rest = plain.rest_local.copy()
    rest[2, :3, :3] = [[0, -1, 0], [1, 0, 0], [0, 0, 1]]
    with pytest.raises(AvatarError, match="joint 'jaw' of the rig has a rotated rest frame"):
        psavatar.taught(
            replace(plain, rest_local=rest), ["exp_000", "exp_001", "exp_002"], points_of(run), 0.0
        )


def test_no_rig_refuses_what_only_a_rig_uses(run: Path) -> None:
    with pytest.raises(AvatarError, match=r"psavatar: --body-model and --shape would have no .*; leave out"):
        read_run(run, no_rig=True, body_model=run / "body.npz", shape=Path("zero"))


def test_without_a_rig_it_is_an_approximation_or_nothing(run: Path) -> None:
    with pytest.raises(AvatarError, match="needs the skeleton of its training"):
        psavatar.read(run, ReadOptions())
    avatar = read_run(run, no_rig=True)
    assert avatar.rig is None and avatar.rules.rotation == "vertex_quaternion"
    assert "without_skeleton" in {note.kind for note in avatar.provenance["notes"]}


def test_it_is_detected_by_content(run: Path, tmp_path: Path) -> None:
    write_run(tmp_path / "renamed", A, name="anything.npz")
    for path in (run, run / "point_cloud" / "iteration_9", tmp_path / "renamed"):
        assert psavatar.detect(path)
        assert readers.find(path).system == "psavatar"
    folder = write_run(tmp_path / "less", {key: A[key] for key in A if key != "basis"})
    (folder / "junk.npz").write_bytes(b"PK\3\4")
    assert not psavatar.detect(tmp_path / "less")
    splatting_files.write_splatting_run(tmp_path / "other", splatting_files.arrays())
    assert not psavatar.detect(tmp_path / "other") and not psavatar.detect(tmp_path)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda a: a.update(triangle=a["triangle"][:-1]), r"triangle: expected whole numbers \[24\], got int32\[23\]"),
        (lambda a: a.update(triangle=a["triangle"].astype("f4")), r"triangle: expected whole numbers \[24\]"),
        (lambda a: a["triangle"].__setitem__(5, -1), r"triangle\[5\]: is -1, but there are 92 triangles"),
        (lambda a: a["triangle"].__setitem__(5, 92), r"triangle\[5\]: is 92, but there are 92 triangles"),
        (lambda a: a["triangles"].__setitem__((3, 1), 63), r"triangles\[3\]: is \[.*63.*\], but there are 63 vertices"),
        (lambda a: a["triangles"].__setitem__(a["triangle"][4], [1, 1, 2]), "1, 1, 2. has no area, but carries"),
        (lambda a: a["barycentric"].__setitem__(6, [0.5, 0.3, 0.3]), r"barycentric\[6\]: adds up to 1.1"),
        (lambda a: a["barycentric"].__setitem__(6, [-0.1, 0.6, 0.5]), r"barycentric\[6\]: has a weight of -0.1"),
        (lambda a: a["displacement"].__setitem__(9, np.nan), r"displacement\[9\]: is not finite"),
        (lambda a: a["canonical_vertices"].__setitem__((2, 0), np.inf), r"canonical_vertices\[2\]: is not finite"),
        (lambda a: a["canonical_vertices"].__setitem__((2, 0), 1e20), r"canonical_vertices\[2\]: .* larger than 10000"),
        (lambda a: a["displacement"].__setitem__(9, 2e4), r"displacement\[9\]: is not finite, or larger than 10000"),
        (lambda a: a["basis"].__setitem__((2, 0, 0), 3e38), r"basis\[2\]: is not finite, or larger than 10000"),
        (lambda a: a.update(canonical_vertices=np.zeros((0, 3), "f4")), "there are 0 vertices"),
        (lambda a: a.update(local_quat_wxyz=a["local_quat_wxyz"][:, :3]), r"expected floats \[24, 4\]"),
        (lambda a: a.update(basis=a["basis"][:, :-1]), r"basis: expected floats \[rows, 63, 3\], got float32\[4, 62"),
        (lambda a: a["basis"].__setitem__((2, 0, 0), 7.0), r"basis\[2\] \(pose/neck/1/1\): moves a vertex by more"),
        (lambda a: a.update(basis_names=np.array(NAMES[:3])), "basis_names: has 3 names, expected 4 different"),
        (lambda a: a.update(basis_names=np.array([NAMES[0]] * 4)), "basis_names: has 4 names, expected 4 different"),
        (lambda a: a.update(basis_names=np.arange(4)), "basis_names: expected a list of names"),
        (lambda a: a["basis_names"].__setitem__(0, "pose/jaw/0/3"), "'pose/jaw/0/3' is neither"),
        (lambda a: a["basis_names"].__setitem__(0, "jaw"), "'jaw' is neither expression/NAME nor"),
        (lambda a: a["basis_names"].__setitem__(0, "pose/jew/0/2"), "'jew' is not a joint of the rig; did you"),
        (lambda a: a["basis_names"].__setitem__(1, "expression/exp_101"), "exp_101"),
        (lambda a: a["training_per_metre"].__setitem__(0, 0.0), "training units per metre"),
    ],
)  # fmt: skip
def test_bad_arrays_are_refused(change: Change, message: str, tmp_path: Path) -> None:
    a = {key: value.copy() for key, value in A.items()}
    change(a)
    write_run(tmp_path, a)
    with pytest.raises(AvatarError, match=message) as error:
        read_run(tmp_path)
    assert error.value.owner == "psavatar" and "\n" not in str(error.value)


def test_other_rules_and_orders_are_refused(tmp_path: Path) -> None:
    write_run(tmp_path, A, {"order": "as_printed"})
    with pytest.raises(AvatarError, match=r"rules.order: is 'as_printed', expected one of mesh_first"):
        read_run(tmp_path)


def test_options_that_mean_nothing_here_are_refused(run: Path) -> None:
    with pytest.raises(AvatarError, match="--units cannot be used here"):
        psavatar.read(run, ReadOptions(units=4.0))


def test_half_an_enhancer_is_refused(tmp_path: Path) -> None:
    folder = write_run(tmp_path, A)
    (folder / "enhancer.onnx").write_bytes(b"")
    with pytest.raises(AvatarError, match=r"enhancer.json: is missing"):
        read_run(tmp_path)


def test_a_header_that_promises_much_takes_no_memory(tmp_path: Path) -> None:
    """The shape in a .npy is checked against the bytes that are there."""
    a = {key: value for key, value in A.items() if key != "basis"}
    write_run(tmp_path, {**a, "basis": np.zeros(3, "f4")})
    path = tmp_path / "point_cloud" / "iteration_9" / "psavatar.npz"
    whole = path.read_bytes()
    path.write_bytes(whole.replace(b"'shape': (3,), ", b"'shape':(1<<9,)"))
    assert peak_bytes(lambda: only_avatar_errors(lambda: read_run(tmp_path))) < 8 << 20


@pytest.fixture(scope="module")
def fuzzed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Its files are overwritten by each example."""
    folder = tmp_path_factory.mktemp("fuzz")
    write_run(folder, A)
    return folder


@MANGLING
@given(data=mangled(b"".join(value.tobytes() for value in A.values())))
def test_mangled_arrays(fuzzed: Path, data: bytes) -> None:
    """Any bytes in place of the numbers."""
    a, at = {}, 0
    for key, value in A.items():
        raw = data[at : at + value.nbytes].ljust(value.nbytes, b"\0")
        a[key] = np.frombuffer(raw, value.dtype).reshape(value.shape)
        at += value.nbytes
    np.savez(fuzzed / "point_cloud" / "iteration_9" / "psavatar.npz", **a)
    only_avatar_errors(lambda: read_run(fuzzed))
