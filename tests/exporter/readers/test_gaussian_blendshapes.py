"""Both upstream forms of Gaussian Blendshapes against every step that the released code computed."""

from __future__ import annotations

import json
import re
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from avatar_export.options import ReadOptions
from avatar_export.readers.gaussian_blendshapes import reader as gaussian_blendshapes
from avatar_export.readers.table import find, read, read_with
from avatar_runtime.avatar import Avatar
from avatar_runtime.io.errors import AvatarError
from avatar_runtime.player import Player
from avatar_runtime.pose import Pose, resolve
from avatar_runtime.rotation import homogeneous
from avatar_runtime.stages.blend import blend
from avatar_runtime.stages.project import sh_colour
from tests.golden import FRAMES, ON, BlendshapesGolden
from tests.measured import Measure

FORMS = ("dump", "raw")
TEETH = 100


def options(golden: BlendshapesGolden, **changes: Any) -> ReadOptions:
    given = {
        "body_model": golden.body / "body_model.npz",
        "shape": golden.frame_file(0),
        "eyelids": golden.body,
        "anchor_faces": golden.body / "back_of_head.txt",
    }
    return ReadOptions(**(given | changes))


def source(golden: BlendshapesGolden, form: str) -> Path:
    return golden.viewer if form == "dump" else golden.raw / "fix_chkpnt40000.pth"


@pytest.fixture(scope="module", params=FORMS)
def played(request: pytest.FixtureRequest, blendshapes_golden: BlendshapesGolden) -> tuple[Avatar, Any]:
    """(avatar, its rows that the golden face arrays hold)."""
    golden = blendshapes_golden
    avatar = read(source(golden, request.param), options(golden))
    rows = np.arange(len(golden.face_rows)) if request.param == "dump" else golden.face_rows
    return avatar, rows


def rotation_6d(values: Any) -> Any:
    """First two rows of a matrix, Gram-Schmidt, third row by cross product (the tracker's convention)."""
    a, b = values.astype(np.float64).reshape(2, 3)
    a = a / np.linalg.norm(a)
    b = b - (a @ b) * a
    b = b / np.linalg.norm(b)
    return homogeneous(np.stack([a, b, np.cross(a, b)]))


def pose_of(avatar: Avatar, frame: dict[str, Any]) -> Pose:
    weights = dict(zip(avatar.expression_names, frame["exp"].tolist(), strict=False))
    joints = {
        "jaw": rotation_6d(frame["jaw_6d"]),
        "leftEye": rotation_6d(frame["eyes_6d"][:6]),
        "rightEye": rotation_6d(frame["eyes_6d"][6:]),
    }
    return Pose(weights, joints, {"left": float(frame["eyelids"][0]), "right": float(frame["eyelids"][1])})


def worst(got: Any, want: Any) -> float:
    assert got.shape == want.shape
    return float(np.abs(got.astype(np.float64) - want).max())


@pytest.mark.parametrize("index", FRAMES)
def test_every_step_meets_the_released_code(
    played: tuple[Avatar, Any],
    blendshapes_golden: BlendshapesGolden,
    index: int,
    backend: str,
    measured: Measure,
) -> None:
    avatar, rows = played
    frame = blendshapes_golden.frame(index)
    pose = pose_of(avatar, frame)
    blended = blend(avatar.gaussians, avatar.blendshapes, resolve(pose, avatar).expression_weights)
    assert worst(blended.mean[rows], frame["face_1_blended_xyz"]) <= 1e-6
    assert worst(blended.quat_wxyz[rows], frame["face_1_blended_rotation_raw"]) <= 2e-6
    assert worst(blended.sh[rows], frame["face_1_blended_sh"]) <= 2e-6
    assert worst(blended.log_scale[rows], frame["face_1_blended_scale_log"]) <= 2e-6
    assert worst(blended.opacity_logit[rows], frame["face_1_blended_opacity_logit"][:, 0]) <= 2e-6
    splats = Player(avatar, backend).animate(pose)
    face = avatar.groups[0].count
    sets = {"face": rows, "upper": face + np.arange(TEETH), "lower": face + TEETH + np.arange(TEETH)}
    for name, at in sets.items():
        measured(
            f"Gaussian Blendshapes{ON[backend]}, positions, m",
            worst(splats.mean[at], frame[f"{name}_xyz"]),
            1e-6,
        )
        measured(
            f"Gaussian Blendshapes{ON[backend]}, quaternions",
            worst(splats.quat_wxyz[at], frame[f"{name}_rotation"]),
            2e-6,
        )
        assert worst(splats.mean[at], frame[f"{name}_xyz"]) <= 1e-6
        assert worst(splats.quat_wxyz[at], frame[f"{name}_rotation"]) <= 2e-6
        scale = frame[f"{name}_scale"].astype(np.float64)
        assert float((np.abs(splats.scale[at] - scale) / scale).max()) <= 2e-6
        assert worst(splats.opacity[at], frame[f"{name}_opacity"][:, 0]) <= 2e-6
        assert splats.sh_rotation is not None
        seen = rotated_sh_error(splats.sh[at], splats.sh_rotation[at], frame[f"{name}_sh"])
        measured(f"Gaussian Blendshapes{ON[backend]}, colour along R^T d against the rotated SH", seen, 2e-6)
        assert seen <= 2e-6


def rotated_sh_error(sh: Any, rotation: Any, rotated: Any) -> float:
    """Largest difference between sh seen along R^T d and the released code's rotated sh seen along d."""
    directions = np.random.default_rng(0).normal(size=(12, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    largest = 0.0
    for d in directions:
        along = np.broadcast_to(d, (len(sh), 3))
        ours = sh_colour(
            sh.astype(np.float64), np.einsum("nji,nj->ni", rotation.astype(np.float64), along), 3
        )
        theirs = sh_colour(rotated.astype(np.float64), along, 3)
        largest = max(largest, float(np.abs(ours - theirs).max()))
    return largest


@pytest.mark.parametrize("index", FRAMES)
def test_mesh(
    played: tuple[Avatar, Any], blendshapes_golden: BlendshapesGolden, index: int, backend: str
) -> None:
    avatar, _ = played
    frame = blendshapes_golden.frame(index)
    vertices = Player(avatar, backend).mesh(pose_of(avatar, frame))
    assert worst(vertices[blendshapes_golden.vertex_rows], frame["mesh_vertices"]) <= 1e-6


def test_rows_with_a_nan_are_dropped_and_listed(blendshapes_golden: BlendshapesGolden) -> None:
    golden = blendshapes_golden
    avatar = read(source(golden, "raw"), options(golden))
    kept = np.setdiff1d(np.arange(1503), avatar.provenance["face_rows_dropped"])
    assert np.array_equal(kept, golden.static()["raw_row_of_kept"])
    assert avatar.provenance["face_rows_read"] == 1503
    assert avatar.groups[0].count == 1500


def test_teeth_fit_by_unique_vertices_is_another_rule(blendshapes_golden: BlendshapesGolden) -> None:
    """Guards the rule itself: the C++ viewer's fit differs from the trainer's by more than the tolerance."""
    frame = blendshapes_golden.frame(3)
    assert np.abs(frame["upper_R"] - frame["upper_R_unique"]).max() > 1e-4


def test_detection(blendshapes_golden: BlendshapesGolden, tmp_path: Path) -> None:
    golden = blendshapes_golden
    for path in (golden.viewer, golden.viewer / "fix_chkpnt40000", golden.raw, source(golden, "raw")):
        assert find(path).system == gaussian_blendshapes.SYSTEM
    assert not gaussian_blendshapes.detect(tmp_path)
    assert not gaussian_blendshapes.detect(tmp_path / "absent")


def test_expressions_only(blendshapes_golden: BlendshapesGolden) -> None:
    golden = blendshapes_golden
    avatar = read(golden.viewer, ReadOptions(no_rig=True))
    assert avatar.rig is None
    assert {g.binding for g in avatar.groups} == {"none"}
    assert len(avatar.expressions) == 50
    splats = Player(avatar).animate(Pose({"exp_003": 0.5}))
    whole = read(golden.viewer, options(golden))
    expected = blend(
        whole.gaussians,
        whole.blendshapes,
        resolve(Pose({whole.expression_names[3]: 0.5}), whole).expression_weights,
    )
    assert np.array_equal(splats.mean, expected.mean)


REFUSALS: dict[str, tuple[dict[str, Any], str]] = {
    "no body model": ({"body_model": None}, "pass --body-model"),
    "no identity": ({"shape": None}, "pass --shape"),
    "no anchor faces": ({"anchor_faces": None}, "pass --anchor-faces"),
    "nothing beside it": (
        {"body_model": None, "shape": None, "anchor_faces": None},
        "pass --body-model .* and --shape .* and --anchor-faces .*or --no-rig",
    ),
    "missing file": ({"body_model": Path("nowhere.npz")}, "no such file"),
    "rotation": ({"rotation": "none"}, "--rotation cannot be used here"),
    "data set": ({"dataset": Path("nowhere")}, "no such folder"),
    "a file for a data set": ({"dataset": Path(__file__)}, "--dataset: is not a folder"),
    "zero in capitals": (
        {"shape": Path("Zero")},
        "--shape: no such file; did you mean `zero`, the mean shape",
    ),
    "a folder for a body model": (
        {"body_model": Path()},
        "--body-model: is a folder; pass a FLAME or SMPL file",
    ),
    "a folder for a shape": ({"shape": Path()}, "--shape: is a folder; pass a tracked .frame"),
    "a folder for anchor faces": ({"anchor_faces": Path()}, "--anchor-faces: is a folder; pass a text file"),
    "a file for eyelids": (
        {"eyelids": Path(__file__)},
        "--eyelids: is a file; pass the folder with l_eyelid.npy",
    ),
    "no folder for eyelids": (
        {"eyelids": Path("nowhere")},
        "--eyelids: no such folder; pass the folder with",
    ),
    "a folder without eyelids": (
        {"eyelids": Path(__file__).parent},
        "--eyelids: has no l_eyelid.npy and no r_eyelid.npy; pass the folder with both",
    ),
    "no rig but its inputs": (
        {"no_rig": True},
        "gaussian_blendshapes: --body-model and --shape and .*would have no effect beside --no-rig; leave out",
    ),
}


@pytest.mark.parametrize("name", REFUSALS)
def test_refusals_say_what_to_do(blendshapes_golden: BlendshapesGolden, name: str) -> None:
    changes, message = REFUSALS[name]
    with pytest.raises(AvatarError, match=message):
        read(blendshapes_golden.viewer, options(blendshapes_golden, **changes))


DAMAGES: dict[str, tuple[str, Any, str]] = {
    "rows": ("scale.npy", np.zeros((7, 3), np.float32), r"scale: has shape \[7, 3\], expected \[P, 3\]"),
    "expressions": ("rot_t.npy", lambda a: a[..., :9], "rot_t: has shape"),
    "coefficients": ("shs.npy", lambda a: a[:, :15], "shs"),
    "missing": ("W.npy", None, "W.npy"),
    "features": ("pos_t.npy", lambda a: a[:35], "pos_t"),
    "all NaN": ("pos.npy", lambda a: np.full_like(a, np.nan), "every row has a NaN"),
}


@pytest.mark.parametrize("name", DAMAGES)
def test_damaged_dump(blendshapes_golden: BlendshapesGolden, tmp_path: Path, name: str) -> None:
    file, change, message = DAMAGES[name]
    shutil.copytree(blendshapes_golden.viewer, tmp_path / "model")
    path = tmp_path / "model" / "fix_chkpnt40000" / file
    if change is None:
        path.unlink()
    else:
        np.save(path, change(np.load(path)) if callable(change) else change)
    with pytest.raises(AvatarError, match=message):
        read(tmp_path / "model", ReadOptions(no_rig=True))


@pytest.mark.parametrize("field", ["scale", "rot", "opacity", "scale_t", "W", "eyelid", "pos_t"])
def test_a_nan_in_any_field_drops_the_row(
    blendshapes_golden: BlendshapesGolden, tmp_path: Path, field: str
) -> None:
    """The system's own dump looks at position and SH only; the others survive into it."""
    shutil.copytree(blendshapes_golden.viewer, tmp_path / "model")
    path = tmp_path / "model" / "fix_chkpnt40000" / f"{field}.npy"
    array = np.load(path)
    (array[:, 5] if field == "pos_t" else array[5]).reshape(-1)[-1:] = np.nan
    if field == "pos_t":
        array[35, 5, 2] = np.nan
    np.save(path, array)
    avatar = read(tmp_path / "model", ReadOptions(no_rig=True))
    assert avatar.provenance["face_rows_dropped"] == [5]


def test_units(blendshapes_golden: BlendshapesGolden) -> None:
    """A model trained on a body model four times as large comes out the same size in metres."""
    golden = blendshapes_golden
    one = read(golden.viewer, options(golden))
    four = read(golden.viewer, options(golden, body_scale=4.0))
    assert np.allclose(four.gaussians.mean * 4, one.gaussians.mean, rtol=0, atol=1e-7)
    assert np.allclose(four.gaussians.log_scale + np.log(4), one.gaussians.log_scale, rtol=0, atol=1e-6)
    assert np.array_equal(four.gaussians.sh, one.gaussians.sh)
    assert four.raster.near == pytest.approx(0.05)
    assert four.training_per_bundle == 4


def test_the_latest_iteration_is_read(blendshapes_golden: BlendshapesGolden, tmp_path: Path) -> None:
    shutil.copytree(blendshapes_golden.viewer / "fix_chkpnt40000", tmp_path / "fix_chkpnt40000")
    shutil.copytree(blendshapes_golden.viewer / "fix_chkpnt40000", tmp_path / "fix_chkpnt9000")
    opacity = tmp_path / "fix_chkpnt40000" / "opacity.npy"
    np.save(opacity, np.full_like(np.load(opacity), 1.25))
    assert np.all(read(tmp_path, ReadOptions(no_rig=True)).gaussians.opacity_logit == 1.25)


def test_the_background_is_the_trainers(blendshapes_golden: BlendshapesGolden, tmp_path: Path) -> None:
    shutil.copytree(blendshapes_golden.viewer, tmp_path / "model")
    for text, colour in (("white_bkgd=False", 0.0), ("white_bkgd=True", 1.0), ("", 0.0)):
        (tmp_path / "model" / "cfg_args").write_text(f"Namespace(sh_degree=3, {text})")
        assert read(tmp_path / "model", ReadOptions(no_rig=True)).raster.background == (colour,) * 3


def test_assumptions_that_the_bundle_does_not_record(
    blendshapes_golden: BlendshapesGolden, tmp_path: Path
) -> None:
    shutil.copytree(blendshapes_golden.viewer, tmp_path / "model")
    (tmp_path / "model" / "cfg_args").unlink(missing_ok=True)

    def assumed(**options: Any) -> list[tuple[str, object]]:
        given, model = ReadOptions(no_rig=True, **options), tmp_path / "model"
        notes = [note for note in read_with(find(model), model, given)[1] if note.passing]
        return [(one.name, one.value) for note in notes for one in note.values.get("settings", ())]

    unit, colour = ("units", 1.0), ("background", "black")
    assert assumed() == [unit, colour] and assumed(body_scale=4.0) == assumed(body_scale=1.0) == [colour]
    (tmp_path / "model" / "cfg_args").write_text("Namespace(white_bkgd=True)")
    assert assumed() == [unit] and assumed(body_scale=4.0) == []
    rules = {"system": "gaussian_blendshapes", "training_units_per_metre": 4.0, "rules": {}}
    (tmp_path / "model" / "rules.json").write_text(json.dumps(rules))
    assert assumed() == [("units", 4.0)] and assumed(body_scale=4.0) == []
    assert assumed(body_scale=1.0) == [("units", 1.0)]
    for scale, used in ((None, 4.0), (1.0, 1.0)):
        assert (
            read(tmp_path / "model", ReadOptions(no_rig=True, body_scale=scale)).training_per_bundle == used
        )


def test_teeth_of_another_degree_are_refused(blendshapes_golden: BlendshapesGolden, tmp_path: Path) -> None:
    shutil.copytree(blendshapes_golden.viewer, tmp_path / "model")
    path = tmp_path / "model" / "mouth0_chkpnt40000" / "shs.npy"
    np.save(path, np.load(path)[:, :9])
    with pytest.raises(AvatarError, match="has 9 SH coefficients, but the face has 16"):
        read(tmp_path / "model", ReadOptions(no_rig=True))


def test_two_body_models_are_not_guessed_between(
    blendshapes_golden: BlendshapesGolden, tmp_path: Path
) -> None:
    for name in ("a/FLAME_MALE.pkl", "b/FLAME_MALE.pkl"):
        (tmp_path / name).parent.mkdir()
        (tmp_path / name).write_bytes(b"")
    between = re.escape(f"{Path('a/FLAME_MALE.pkl')}, {Path('b/FLAME_MALE.pkl')}; choose one")
    with pytest.raises(AvatarError, match=between):
        read(blendshapes_golden.viewer, ReadOptions(dataset=tmp_path))
