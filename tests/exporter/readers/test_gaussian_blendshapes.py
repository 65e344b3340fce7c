"""Both upstream forms of Gaussian Blendshapes against every step that the released code computed."""

from __future__ import annotations

import json
import re
import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from avatar_export.notes.text import text
from avatar_export.options import ReadOptions
from avatar_export.readers.table import find, read, read_with
from avatar_runtime.avatar import Avatar
from avatar_runtime.player import Player
from avatar_runtime.pose import Pose, resolve
from avatar_runtime.rotation import homogeneous
from avatar_runtime.stages.blend import blend
from avatar_runtime.stages.project import sh_colour
from tests.exporter.refusals import refused
from tests.golden import FRAMES, ON, BlendshapesGolden
from tests.measured import Measure

FORMS = ("dump", "raw")
TEETH = 100
CLOSE, CLOSER = 2e-6, 1e-6
NO_RIG = ReadOptions(no_rig=True)


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


@pytest.fixture
def model(blendshapes_golden: BlendshapesGolden, tmp_path: Path) -> Path:
    """A copy of the dump, to be changed."""
    return Path(shutil.copytree(blendshapes_golden.viewer, tmp_path / "model"))


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
    sixes = {"jaw": frame["jaw_6d"], "leftEye": frame["eyes_6d"][:6], "rightEye": frame["eyes_6d"][6:]}
    lids = dict(zip(("left", "right"), map(float, frame["eyelids"][:2]), strict=True))
    return Pose(weights, {name: rotation_6d(six) for name, six in sixes.items()}, lids)


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
    for name, golden, limit in (
        ("mean", "xyz", CLOSER), ("quat_wxyz", "rotation_raw", CLOSE), ("sh", "sh", CLOSE),
        ("log_scale", "scale_log", CLOSE),
    ):  # fmt: skip
        assert worst(getattr(blended, name)[rows], frame[f"face_1_blended_{golden}"]) <= limit, name
    assert worst(blended.opacity_logit[rows], frame["face_1_blended_opacity_logit"][:, 0]) <= CLOSE
    splats = Player(avatar, backend).animate(pose)
    assert splats.sh_rotation is not None
    face = avatar.groups[0].count
    sets = {"face": rows, "upper": face + np.arange(TEETH), "lower": face + TEETH + np.arange(TEETH)}
    for name, at in sets.items():
        scale = frame[f"{name}_scale"].astype(np.float64)
        assert float((np.abs(splats.scale[at] - scale) / scale).max()) <= CLOSE
        assert worst(splats.opacity[at], frame[f"{name}_opacity"][:, 0]) <= CLOSE
        seen = rotated_sh_error(splats.sh[at], splats.sh_rotation[at], frame[f"{name}_sh"])
        for what, error, limit in (
            ("positions, m", worst(splats.mean[at], frame[f"{name}_xyz"]), CLOSER),
            ("quaternions", worst(splats.quat_wxyz[at], frame[f"{name}_rotation"]), CLOSE),
            ("colour along R^T d against the rotated SH", seen, CLOSE),
        ):
            measured(f"Gaussian Blendshapes{ON[backend]}, {what}", error, limit)
            assert error <= limit, (name, what)
    vertices = Player(avatar, backend).mesh(pose)
    assert worst(vertices[blendshapes_golden.vertex_rows], frame["mesh_vertices"]) <= CLOSER


def rotated_sh_error(sh: Any, rotation: Any, rotated: Any) -> float:
    """Largest difference between sh seen along R^T d and the released code's rotated sh seen along d."""
    directions = np.random.default_rng(0).normal(size=(12, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    largest = 0.0
    for d in directions:
        along = np.broadcast_to(d, (len(sh), 3))
        turned = np.einsum("nji,nj->ni", rotation.astype(np.float64), along)
        ours, theirs = (
            sh_colour(of.astype(np.float64), seen, 3) for of, seen in ((sh, turned), (rotated, along))
        )
        largest = max(largest, worst(ours, theirs))
    return largest


def test_rows_with_a_nan_are_dropped_and_listed(blendshapes_golden: BlendshapesGolden) -> None:
    golden = blendshapes_golden
    avatar = read(source(golden, "raw"), options(golden))
    kept = np.setdiff1d(np.arange(1503), avatar.provenance["face_rows_dropped"])
    assert np.array_equal(kept, golden.static()["raw_row_of_kept"])
    assert avatar.provenance["face_rows_read"] == 1503 and avatar.groups[0].count == 1500


def test_expressions_only(blendshapes_golden: BlendshapesGolden) -> None:
    golden = blendshapes_golden
    avatar, whole = read(golden.viewer, NO_RIG), read(golden.viewer, options(golden))
    assert avatar.rig is None and {g.binding for g in avatar.groups} == {"none"}
    assert len(avatar.expressions) == 50
    weights = resolve(Pose({whole.expression_names[3]: 0.5}), whole).expression_weights
    expected = blend(whole.gaussians, whole.blendshapes, weights)
    assert np.array_equal(Player(avatar).animate(Pose({"exp_003": 0.5})).mean, expected.mean)


HERE, NOWHERE = Path(__file__), Path("nowhere.npz")
REFUSALS: list[tuple[dict[str, Any], str]] = [
    *(({name.replace("-", "_"): None}, f"pass --{name}") for name in ("body-model", "shape", "anchor-faces")),
    ({"body_model": None, "shape": None, "anchor_faces": None},
     "--body-model .* and --shape .* and --anchor-faces .*or --no-rig"),
    ({"body_model": NOWHERE}, "no such file"),
    ({"rotation": "none"}, "--rotation cannot be used here"),
    ({"dataset": HERE}, "--dataset: is not a folder"),
    ({"shape": Path("Zero")}, "--shape: no such file; did you mean `zero`"),
    *(({name.replace("-", "_"): Path()}, f"--{name}: is a folder") for name in ("body-model", "shape", "anchor-faces")),
    ({"eyelids": HERE}, "--eyelids: is a file"),
    ({"eyelids": HERE.parent}, "--eyelids: has no l_eyelid.npy and no r_eyelid.npy"),
    ({"no_rig": True}, "gaussian_blendshapes: --body-model and --shape and .* --no-rig"),
]  # fmt: skip


@pytest.mark.parametrize(("changes", "message"), REFUSALS, ids=[message for _, message in REFUSALS])
def test_bad_options(blendshapes_golden: BlendshapesGolden, changes: dict[str, Any], message: str) -> None:
    refused(message, read, blendshapes_golden.viewer, options(blendshapes_golden, **changes))


@pytest.mark.parametrize(
    ("file", "change", "message"),
    [
        ("fix_chkpnt40000/scale", lambda a: np.zeros((7, 3), "f4"), r"scale: has shape \[7, 3\], expected \[P, 3\]"),
        ("fix_chkpnt40000/rot_t", lambda a: a[..., :9], "rot_t: has shape"),
        ("fix_chkpnt40000/W", None, "W.npy"),
        ("fix_chkpnt40000/pos", lambda a: np.full_like(a, np.nan), "every row has a NaN"),
        ("mouth0_chkpnt40000/shs", lambda a: a[:, :9], "has 9 SH coefficients, but the face has 16"),
    ],
)  # fmt: skip
def test_damaged_dumps(model: Path, file: str, change: Any, message: str) -> None:
    path = model / f"{file}.npy"
    array = np.load(path)
    path.unlink()
    if change is not None:
        np.save(path, change(array))
    refused(message, read, model, NO_RIG)


@pytest.mark.parametrize("field", ["scale", "rot", "opacity", "scale_t", "W", "eyelid", "pos_t"])
def test_a_nan_in_any_field_drops_the_row(model: Path, field: str) -> None:
    path = model / "fix_chkpnt40000" / f"{field}.npy"
    array = np.load(path)
    array[(35, 5, 2) if field == "pos_t" else (5, *(-1,) * (array.ndim - 1))] = np.nan
    np.save(path, array)
    assert read(model, NO_RIG).provenance["face_rows_dropped"] == [5]


def test_what_nothing_states_is_noted(model: Path) -> None:
    (model / "cfg_args").unlink(missing_ok=True)

    def noted(**options: Any) -> str:
        return str([text(note) for note in read_with(find(model), model, replace(NO_RIG, **options))[1]])

    assert "--body-scale" in noted() and "black" in noted() and "--body-scale" not in noted(body_scale=4.0)
    (model / "cfg_args").write_text("Namespace(white_bkgd=True)")
    assert "black" not in noted() and read(model, NO_RIG).raster.background == (1.0,) * 3
    rules = {"system": "gaussian_blendshapes", "training_units_per_metre": 4.0, "rules": {}}
    (model / "rules.json").write_text(json.dumps(rules))
    assert "rules.json says 4" in noted(body_scale=1.0)
    for scale, used in ((None, 4.0), (1.0, 1.0)):
        assert read(model, replace(NO_RIG, body_scale=scale)).training_per_bundle == used


def test_two_body_models(blendshapes_golden: BlendshapesGolden, tmp_path: Path) -> None:
    for name in ("a/FLAME_MALE.pkl", "b/FLAME_MALE.pkl"):
        (tmp_path / name).parent.mkdir()
        (tmp_path / name).write_bytes(b"")
    between = re.escape(f"{Path('a/FLAME_MALE.pkl')}, {Path('b/FLAME_MALE.pkl')}; choose one")
    refused(between, read, blendshapes_golden.viewer, ReadOptions(dataset=tmp_path))
