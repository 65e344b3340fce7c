"""The Gaussian Blendshapes samples: exact layout, the two forms agree, the head moves as its shapes say."""

from __future__ import annotations

import json
import pickletools
import zipfile
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from samples.make import make_gaussian_blendshapes
from samples.subjects.body_model import JOINTS, LOWER_TEETH_MIX, PARENTS
from samples.subjects.head import load_head
from samples.systems.gaussian_blendshapes import NAN_ROWS

from tests.samples.torch_file import load_checkpoint
from tests.shared_data import shared

P, RAW = 1500, 1503
DUMP = {
    "pos": (P, 3),
    "shs": (P, 16, 3),
    "scale": (P, 3),
    "rot": (P, 4),
    "opacity": (P, 1),
    "xyz_t": (P, 3, 50),
    "shs_t": (P, 16, 3, 50),
    "scale_t": (P, 3, 50),
    "rot_t": (P, 4, 50),
    "opacity_t": (P, 1, 50),
    "pos_t": (36, P, 3),
    "W": (P, 5),
    "eyelid": (P, 3, 2),
}
TUPLE = {
    1: (RAW, 3),
    2: (RAW, 1, 3),
    3: (RAW, 15, 3),
    4: (RAW, 3),
    5: (RAW, 4),
    6: (RAW, 1),
    7: (RAW,),
    8: (RAW, 1),
    9: (RAW, 1),
    10: (RAW, 3, 50),
    11: (RAW, 16, 3, 50),
    12: (RAW, 3, 50),
    13: (RAW, 4, 50),
    14: (RAW, 1, 50),
}
ACC = {
    "init_rot": (RAW, 4, 50),
    "init_sh": (RAW, 16, 3, 50),
    "init_xyz": (RAW, 3, 50),
    "pose_blendshape": (36, RAW, 3),
    "eye_blendshape": (RAW, 3, 2),
    "expr_mask_tensor": (RAW, 50),
    "W": (RAW, 5),
}
GOLDEN = "golden/gaussian_blendshapes"


def dump(base: Path, name: str, folder: str = "fix_chkpnt40000") -> np.ndarray:
    return np.load(base / "model" / folder / f"{name}.npy", allow_pickle=False)


def npz(path: Path) -> dict[str, np.ndarray]:
    """All arrays of an .npz."""
    with np.load(path, allow_pickle=False) as file:
        return {name: file[name] for name in file.files}


@pytest.fixture(scope="module")
def raw(conformance: Path) -> tuple[tuple, dict[str, np.ndarray]]:
    (state, iteration) = load_checkpoint(conformance / "model" / "fix_chkpnt40000.pth")
    assert iteration == 40000
    acc = np.load(conformance / "model" / "acc40000.npy", allow_pickle=True)
    assert acc.shape == () and acc.dtype == object
    return state, acc.item()


def test_dump_layout(conformance: Path) -> None:
    folder = conformance / "model" / "fix_chkpnt40000"
    assert {p.stem for p in folder.iterdir()} == set(DUMP)
    for name, shape in DUMP.items():
        array = dump(conformance, name)
        assert (array.dtype, array.shape) == (np.float32, shape), name
        assert array.flags.c_contiguous and np.isfinite(array).all(), name
    for mouth in ("mouth0_chkpnt40000", "mouth1_chkpnt40000"):
        assert {p.stem for p in (conformance / "model" / mouth).iterdir()} == {
            "pos", "shs", "scale", "rot", "opacity",
        }  # fmt: skip
        assert dump(conformance, "shs", mouth).shape == (150, 16, 3)


def test_raw_layout(raw: tuple[tuple, dict[str, np.ndarray]]) -> None:
    state, acc = raw
    assert len(state) == 19 and state[0] == 3 and state[18] == 1.0
    assert {k: state[k].shape for k in TUPLE} == TUPLE
    assert all(state[k].dtype == np.float32 for k in TUPLE)
    assert state[15].dtype == np.int64 and state[15].ndim == 1 and len(state[15]) != RAW
    assert state[16].shape == (len(state[15]), 3)
    assert sorted(state[17]["state"]) == list(range(11)) and len(state[17]["param_groups"]) == 11
    assert {k: v.shape for k, v in acc.items()} == ACC
    assert list(acc) == list(ACC) and all(v.dtype == np.float32 for v in acc.values())


def test_mouth_checkpoints_hold_what_the_dump_holds(conformance: Path) -> None:
    for k in (0, 1):
        state, _ = load_checkpoint(conformance / "model" / f"mouth{k}_chkpnt40000.pth")
        assert len(state) == 12
        folder = f"mouth{k}_chkpnt40000"
        np.testing.assert_array_equal(state[1], dump(conformance, "pos", folder))
        shs = np.concatenate([state[2], state[3]], axis=1)
        np.testing.assert_array_equal(shs, dump(conformance, "shs", folder))
        for item, name in ((4, "scale"), (5, "rot"), (6, "opacity")):
            np.testing.assert_array_equal(state[item], dump(conformance, name, folder))


def test_folded_raw_form_is_the_dump_to_the_bit(conformance: Path, raw: tuple[tuple, dict]) -> None:
    state, acc = raw
    shs = np.concatenate([state[2], state[3]], axis=1)
    bad = np.isnan(state[1]).any(axis=1) | np.isnan(shs).any(axis=(1, 2))
    assert np.flatnonzero(bad).tolist() == sorted(NAN_ROWS)
    mask = acc["expr_mask_tensor"]
    expected = {
        "pos": state[1],
        "shs": shs,
        "scale": state[4],
        "rot": state[5],
        "opacity": state[6],
        "xyz_t": acc["init_xyz"] + mask[:, None] * state[10],
        "shs_t": acc["init_sh"] + mask[:, None, None] * state[11],
        "scale_t": mask[:, None] * state[12],
        "rot_t": acc["init_rot"] + mask[:, None] * state[13],
        "opacity_t": mask[:, None] * state[14],
        "W": acc["W"],
        "eyelid": acc["eye_blendshape"],
    }
    for name, array in expected.items():
        np.testing.assert_array_equal(array[~bad], dump(conformance, name), err_msg=name)
    np.testing.assert_array_equal(acc["pose_blendshape"][:, ~bad], dump(conformance, "pos_t"))


def test_no_field_of_the_conformance_avatar_is_zero(conformance: Path, raw: tuple[tuple, dict]) -> None:
    for name in DUMP:
        array = dump(conformance, name)
        if name.endswith("_t") and name != "pos_t":
            assert np.any(array != 0, axis=tuple(range(array.ndim - 1))).all(), name
        assert np.abs(array).max() > 1e-4, name
    state, acc = raw
    for array in (*[state[k] for k in TUPLE], *acc.values()):
        assert np.nanmax(np.abs(array)) > 0
    lengths = np.linalg.norm(state[5], axis=1)
    assert lengths.min() < 0.7 and lengths.max() > 1.3
    assert np.any(np.load(conformance / "body" / "shape.npy"))
    body = npz(conformance / "body" / "body_model.npz")
    moved = np.einsum("jv,vck->jck", body["J_regressor"], body["shapedirs_expression"])
    assert np.abs(moved).max() > 1e-3, "expressions move the joints"


def test_learned_values_are_zero_where_the_mask_is(raw: tuple[tuple, dict]) -> None:
    state, acc = raw
    still = acc["expr_mask_tensor"] == 0
    assert 0 < still.mean() < 1
    for k in (10, 11, 12, 13, 14):
        assert not np.moveaxis(state[k], -1, 1)[still].any()


def test_checkpoint_is_pickled_as_the_released_code_pickles_it(conformance: Path, tmp_path: Path) -> None:
    with zipfile.ZipFile(shared(f"{GOLDEN}/model_raw.zip")) as zip_:
        zip_.extractall(tmp_path)
    for name in ("fix_chkpnt40000.pth", "mouth0_chkpnt40000.pth"):
        genuine, ours = (opcodes(p / name) for p in (tmp_path / "model", conformance / "model"))
        # Both begin the same up to the numbers; the genuine optimiser state was cut to save space.
        assert ours[: ours.index("step")] == genuine[: genuine.index("step")]
        assert set(ours) >= set(genuine) - {str(RAW), "1503"}
    records = [
        zipfile.ZipFile(p / "fix_chkpnt40000.pth").namelist()
        for p in (tmp_path / "model", conformance / "model")
    ]
    assert records[1][0] == records[0][0] and records[1][-1] == records[0][-1]


def opcodes(path: Path) -> list[str]:
    """Opcode names and the strings that are names; numbers, memo indices and record keys left out."""
    with zipfile.ZipFile(path) as zip_:
        pickled = zip_.read(f"{path.stem}/data.pkl")
    out = []
    for op, arg, _ in pickletools.genops(pickled):
        name = {"LONG_BINPUT": "BINPUT", "LONG_BINGET": "BINGET"}.get(op.name, op.name)
        name = "INT" if name in ("BININT", "BININT1", "BININT2") else name
        out.append(arg if isinstance(arg, str) and not arg.isdigit() else name)
    return out


def test_records_are_stored_and_aligned_like_torch(conformance: Path) -> None:
    path = conformance / "model" / "fix_chkpnt40000.pth"
    data = path.read_bytes()
    with zipfile.ZipFile(path) as zip_:
        for info in zip_.infolist():
            assert info.compress_type == zipfile.ZIP_STORED
            head = info.header_offset
            name, extra = (int.from_bytes(data[head + i : head + i + 2], "little") for i in (26, 28))
            assert (head + 30 + name + extra) % 64 == 0, info.filename
        assert not [n for n in zip_.namelist() if n.endswith("byteorder")]


def test_body_model_has_the_keys_of_the_reference(conformance: Path) -> None:
    ours = npz(conformance / "body" / "body_model.npz")
    reference = npz(shared(f"{GOLDEN}/body/body_model.npz"))
    assert set(ours) == set(reference) - {"ict_vertex_index", "neck_exclude_vertices"}
    for key in ours:
        assert ours[key].dtype.kind == reference[key].dtype.kind and ours[key].ndim == reference[key].ndim, (
            key
        )
    for key in ("parents", "posedirs", "lbs_weights"):
        assert ours[key].shape[1:] == reference[key].shape[1:], key


def test_body_model_is_sound(plain: Path) -> None:
    body = npz(plain / "body" / "body_model.npz")
    np.testing.assert_allclose(body["lbs_weights"].sum(axis=1), 1, atol=1e-6)
    assert body["lbs_weights"].min() >= 0
    np.testing.assert_allclose(body["J_regressor"].sum(axis=1), 1, atol=1e-6)
    joints = body["J_regressor"] @ body["v_template"]
    np.testing.assert_allclose(joints[3:], load_head().eye_centres, atol=1e-6)
    moved = np.einsum("jv,vck->jck", body["J_regressor"], body["shapedirs_expression"])
    assert np.abs(moved).max() < 1e-5, "no expression moves a joint of the plain avatar"
    assert body["parents"].tolist() == list(PARENTS) == [-1, 0, 1, 1, 1]
    names = body["expression_names"].tolist()
    assert len(set(names)) == 51 and "tongueOut" not in names
    faces = np.loadtxt(plain / "body" / "back_of_head.txt", dtype=int)
    np.testing.assert_array_equal(faces, body["back_of_head_faces"])
    assert body["v_template"][body["faces"][faces]][..., 2].max() < -0.05
    for side in ("l", "r"):
        lid = np.load(plain / "body" / f"{side}_eyelid.npy")
        assert lid.dtype == np.float64 and lid.shape == body["v_template"].shape and np.any(lid)


def turned(rotvec: np.ndarray) -> np.ndarray:
    angle = np.linalg.norm(rotvec)
    x, y, z = rotvec / max(angle, 1e-12)
    k = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * k + (1 - np.cos(angle)) * k @ k


def driven(base: Path, **weights: float) -> dict[str, float]:
    matrix = json.loads((base / "driving.json").read_text())
    inputs = np.array([weights.get(name, 0.0) for name in matrix["inputs"]])
    return dict(zip(matrix["outputs"], np.array(matrix["matrix"]) @ inputs, strict=True))


def rotation_vector(out: dict[str, float], joint: str) -> np.ndarray:
    return np.array([out.get(f"joint/{joint}/{axis}", 0.0) for axis in "xyz"])


def test_driving_matrix_names_what_the_body_has(plain: Path) -> None:
    out = driven(plain, jawOpen=0.5, mouthSmileLeft=0.25)
    body = npz(plain / "body" / "body_model.npz")
    names = body["expression_names"].tolist()
    known = {f"expression/{n}" for n in names} | {f"joint/{j}/{a}" for j in JOINTS for a in "xyz"}
    assert set(out) <= known and {f"expression/{n}" for n in names} <= set(out)
    assert out["expression/mouthSmileLeft"] == 0.25 and out["expression/jawOpen"] == 0.5
    assert 0.15 < out["joint/jaw/x"] < 0.35, "opening turns the chin down, by 9 to 20 degrees at half weight"


def test_eyes_turn_the_right_way(plain: Path) -> None:
    def gaze(joint: str, **weights: float) -> np.ndarray:
        return turned(rotation_vector(driven(plain, **weights), joint)) @ (0, 0, 1)

    assert gaze("leftEye", eyeLookOutLeft=1)[0] > 0.3, "+X is the subject's left"
    assert gaze("leftEye", eyeLookInLeft=1)[0] < -0.3
    assert gaze("rightEye", eyeLookOutRight=1)[0] < -0.3
    assert gaze("rightEye", eyeLookInRight=1)[0] > 0.3
    assert gaze("leftEye", eyeLookUpLeft=1)[1] > 0.2
    assert gaze("rightEye", eyeLookDownRight=1)[1] < -0.2


def test_the_jaw_joint_carries_the_lower_teeth_as_the_shape_does(plain: Path) -> None:
    head = load_head()
    body = npz(plain / "body" / "body_model.npz")
    jaw = (body["J_regressor"] @ body["v_template"])[2]
    rotation = turned(rotation_vector(driven(plain, jawOpen=1), "jaw"))
    teeth = head.in_part("lower_teeth")
    x = head.vertices[teeth]
    moved = x + LOWER_TEETH_MIX[2] * ((x - jaw) @ rotation.T + jaw - x)
    error = np.linalg.norm(moved - x - head.expression("jawOpen")[teeth], axis=1)
    assert np.linalg.norm(head.expression("jawOpen")[teeth], axis=1).max() > 0.03
    assert error.max() < 0.0006


def nearest_vertex(points: np.ndarray, vertices: np.ndarray) -> np.ndarray:
    """The mesh vertex nearest to each point, by brute force."""
    nearest = np.empty(len(points), int)
    for first in range(0, len(points), 200):
        rows = slice(first, first + 200)
        gap = points[rows, None] - vertices[None]
        nearest[rows] = np.argmin(np.einsum("nvx,nvx->nv", gap, gap), axis=1)
    return nearest


@pytest.mark.parametrize("name", ["jawOpen", "jawForward", "mouthSmileLeft", "eyeBlinkRight"])
def test_posed_gaussians_follow_the_shape_of_the_head(plain: Path, name: str) -> None:
    """Blend and skin the Gaussians by hand; they end where the scan's shape takes the surface under them."""
    head = load_head()
    body = npz(plain / "body" / "body_model.npz")
    names = body["expression_names"].tolist()
    out = driven(plain, **{name: 1})
    jaw = (body["J_regressor"] @ body["v_template"])[2]
    rotation = turned(rotation_vector(out, "jaw"))
    start = dump(plain, "pos").astype(float)
    blended = start + dump(plain, "xyz_t")[..., names.index(name)]
    weight = dump(plain, "W")[:, 2:3]
    posed = blended + weight * ((blended - jaw) @ rotation.T + jaw - blended)
    expected = head.expression(name)[nearest_vertex(start, head.vertices)]
    error = np.linalg.norm(posed - start - expected, axis=1)
    assert np.linalg.norm(expected, axis=1).max() > 0.003
    assert np.median(error) < 1e-4 and np.percentile(error, 90) < 2e-3


def test_splats_at_rest_cover_closed_lids_and_a_turned_jaw(plain: Path) -> None:
    """The eyelid field and the jaw joint bring no scale: every splat they move still meets its neighbours."""
    body = npz(plain / "body" / "body_model.npz")
    start, lids = dump(plain, "pos").astype(float), dump(plain, "eyelid").astype(float)
    weight = dump(plain, "W")[:, 2:3]
    jaw = (body["J_regressor"] @ body["v_template"])[2]
    closed = start + lids.sum(axis=2)
    posed = closed + weight * ((closed - jaw) @ turned(np.array([np.radians(15), 0, 0])).T + jaw - closed)
    sigma = np.exp(dump(plain, "scale")[:, :2]).mean(axis=1)
    lid = np.flatnonzero(np.linalg.norm(lids, axis=(1, 2)) > 0.004)
    x, y, z = start.T
    lip = np.flatnonzero((np.abs(x) < 0.035) & (np.abs(y + 0.042) < 0.015) & (z > 0.09))
    for rows in (lid, lip):
        gap = np.linalg.norm(posed[rows, None] - posed[None], axis=2)
        sixth = np.sort(gap, axis=1)[:, 1:7].mean(axis=1)
        assert len(rows) > 20 and np.percentile(sixth / sigma[rows], 95) < 1.8


def test_the_bust_fades_out_and_the_rest_is_solid(plain: Path) -> None:
    opacity = 1 / (1 + np.exp(-dump(plain, "opacity")[:, 0]))
    y = dump(plain, "pos")[:, 1]
    assert opacity[y < -0.19].max() < 0.3 and opacity[y > -0.08].min() > 0.99


def test_skin_of_the_sides_is_no_bluer_than_that_of_the_front(plain: Path) -> None:
    rgb = dump(plain, "shs")[:, 0] * 0.28209479 + 0.5
    x, y, z = dump(plain, "pos").T
    tint = rgb[:, 2] / rgb[:, 0]
    side = (np.abs(x) > 0.045) & (y > -0.07) & (y < 0) & (z > 0) & (z < 0.06)
    front = (np.abs(np.abs(x) - 0.035) < 0.01) & (np.abs(y) < 0.015) & (z > 0.06)
    assert side.sum() > 30 and front.sum() > 10
    assert np.percentile(tint[side], 95) < np.median(tint[front]) + 0.02


def splat_normals(quat_wxyz: np.ndarray) -> np.ndarray:
    """The third axis of each rotation: the flat one."""
    w, x, y, z = (quat_wxyz / np.linalg.norm(quat_wxyz, axis=1, keepdims=True)).T
    return np.stack([2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)], axis=1)


def test_blended_splats_stay_flat_on_the_skin(plain: Path) -> None:
    head, name = load_head(), "cheekPuff"
    names = npz(plain / "body" / "body_model.npz")["expression_names"].tolist()
    at = nearest_vertex(dump(plain, "pos").astype(float), head.vertices)
    puffed = replace(head, vertices=head.vertices + head.expression(name))
    quat = dump(plain, "rot").astype(float)
    blended = quat + dump(plain, "rot_t")[..., names.index(name)]
    tilts = np.sum(head.vertex_normals[at] * puffed.vertex_normals[at], axis=1) < np.cos(np.radians(8))
    assert tilts.sum() > 50

    def off(q: np.ndarray, skin: np.ndarray) -> float:
        cosine = np.sum(splat_normals(q) * skin[at], axis=1)[tilts]
        return float(np.median(np.degrees(np.arccos(np.clip(cosine, -1, 1)))))

    assert off(quat, head.vertex_normals) < 4
    assert off(blended, puffed.vertex_normals) < 4 < off(quat, puffed.vertex_normals)


def test_same_bytes_every_time(conformance: Path, tmp_path: Path) -> None:
    again = make_gaussian_blendshapes(tmp_path, form="both", full=True)
    files = sorted(p.relative_to(conformance) for p in conformance.rglob("*") if p.is_file())
    assert files == sorted(p.relative_to(again) for p in again.rglob("*") if p.is_file())
    for name in files:
        assert (conformance / name).read_bytes() == (again / name).read_bytes(), name


def test_unknown_form_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="form"):
        make_gaussian_blendshapes(tmp_path, form="both ")
