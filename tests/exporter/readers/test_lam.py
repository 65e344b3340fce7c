"""What the LAM reader makes of good and of bad files."""

from __future__ import annotations

import json
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from avatar_export.formats import file_set
from avatar_export.notes.text import text
from avatar_export.options import ReadOptions
from avatar_export.playing.sequences import recorded
from avatar_export.readers import lam
from avatar_export.readers.lam import read_lam
from avatar_export.readers.table import expect_bundle, find
from avatar_runtime.avatar import Avatar
from avatar_runtime.codec import glb
from avatar_runtime.player import Player
from avatar_runtime.pose import Pose, joint_rotation
from tests.exporter.glb_files import edited
from tests.exporter.readers import lam_files
from tests.exporter.readers.lam_files import COUNT, offset_ply, skin_glb, write_zip
from tests.exporter.refusals import refused
from tests.golden import ON
from tests.measured import Measure
from tests.oracles.lam_trainer import LamTrainer
from tests.shared_data import shared


@pytest.fixture
def made(tmp_path: Path) -> Path:
    return write_zip(tmp_path / "made.zip", lam_files.files())


def unpacked(path: Path) -> Path:
    with zipfile.ZipFile(path) as archive:
        archive.extractall(path.parent / "unpacked")
    return path.parent / "unpacked"


def test_the_avatar_to_the_last_field(made: Path) -> None:
    avatar = lam.read(made, ReadOptions())
    vertices = glb.accessor(glb.decode(skin_glb()), 0)
    rows = np.frombuffer(offset_ply().partition(b"end_header\n")[2], "<f4").reshape(COUNT, -1)
    g, geometry = avatar.gaussians, avatar.blendshapes.geometry
    assert np.array_equal(g.mean, vertices + rows[:, :3])
    assert np.array_equal(g.sh[:, 0], ((rows[:, 6:9].astype("f8") - 0.5) / 0.28209479177387814).astype("f4"))
    assert np.array_equal(g.opacity_logit, rows[:, 9]) and np.array_equal(g.log_scale, rows[:, 10:13])
    assert np.array_equal(g.quat_wxyz, rows[:, 13:17])
    assert (avatar.name, avatar.expression_names, avatar.clips) == ("made", lam_files.MORPHS, ())
    assert [(x.name, x.first, x.count, x.binding) for x in avatar.groups] == [("body", 0, COUNT, "skin")]
    assert (avatar.rules.rotation, avatar.rules.sh_direction) == ("none", "world")
    assert (avatar.sh_degree, avatar.head_pose_in, avatar.raster.background) == (0, "mesh", "per_view")
    assert (avatar.driving.mode, avatar.driving.head_joint) == ("names", "head")
    assert avatar.skin is avatar.rig.skin
    assert np.array_equal(geometry.values["mean"], avatar.rig.morphs.values["position"])
    assert not geometry.values["quat_wxyz"].any() and avatar.blendshapes.appearance.entries == 0
    assert avatar.provenance["system"] == "lam" and avatar.provenance["notes"] == []
    assert lam.read(made, ReadOptions(name="other")).name == "other"


@pytest.mark.parametrize("folder", ["", "someone/", "deep/er/"])
def test_zip_and_folder_are_one_avatar(folder: str, made: Path, tmp_path: Path) -> None:
    whole = lam.read_lam(made)
    other = write_zip(tmp_path / "other.zip", lam_files.files(animation=None), folder)
    at = unpacked(made)
    for path in (other, at, at / "someone"):
        assert lam.detect(path)
        assert lam.read_lam(path).name == path.stem
        assert np.array_equal(lam.read_lam(path).gaussians.mean, whole.gaussians.mean)


def talk(frames: int = 4) -> bytes:
    """Expressions as LAM_Audio2Expression adds them."""
    names = ["tongueOut", lam_files.MORPHS[1], lam_files.MORPHS[0]]
    rows = [{"weights": [1, k / 4, 0.5], "time": k / 25, "rotation": []} for k in range(frames)]
    told = {"names": names, "metadata": {"fps": 25, "frame_count": frames}, "frames": rows}
    return json.dumps(told).encode()


def test_expressions_in_the_zip_are_a_clip_and_a_recording(tmp_path: Path) -> None:
    path = write_zip(tmp_path / "talk.zip", lam_files.files(expressions=talk()), "arkitWithBSData/")
    alone = write_zip(tmp_path / "alone.zip", {"bsData.json": talk()})
    (tmp_path / "bare.json").write_bytes(talk())
    folder = unpacked(path) / "arkitWithBSData"
    for source in (path, folder):
        avatar = lam.read(source, ReadOptions())
        (clip,) = avatar.clips
        assert (avatar.name, clip.name, clip.fps, clip.frames) == (source.stem, "bsData", 25, 4)
        np.testing.assert_allclose(clip.expression_weights[:, :2], [[0.5, k / 4] for k in range(4)])
        assert not clip.expression_weights[:, 2:].any()
    assert "bsData.json" in {entry["path"] for entry in avatar.provenance["source_files"]}
    wanted = [pose.expressions for pose in recorded(avatar, tmp_path / "bare.json").poses]
    assert any(any(weights.values()) for weights in wanted)
    for source in (path, alone, folder):
        found = recorded(avatar, source)
        assert (found.fps, [pose.expressions for pose in found.poses]) == (25, wanted)
    silent = write_zip(tmp_path / "silent.zip", lam_files.files())
    refused(r"silent\.zip: holds no bsData\.json.*--clip", recorded, avatar, silent)


def test_a_truncated_zip_is_called_truncated(made: Path, tmp_path: Path) -> None:
    data = made.read_bytes()
    for length in (len(data) // 2, len(data) - 30):
        (tmp_path / "cut.zip").write_bytes(data[:length])
        for reader in (lam.read_lam, find, expect_bundle):
            refused("is a truncated zip", reader, tmp_path / "cut.zip")


def _with(row: int, value: float) -> np.ndarray:
    changed = np.zeros(COUNT)
    changed[row] = value
    return changed


BAD_OFFSETS: list[tuple[dict[str, Any], str]] = [
    *(({name: _with(7, np.nan)}, rf"{name}\[7\]: is nan") for name in lam_files.PLY_NAMES if name[0] != "n"),
    ({"scale_1": _with(3, np.inf)}, r"scale_1\[3\]: is inf"),
    ({"opacity": None}, "property opacity: is missing"),
    ({"f_dc_1": _with(5, -1.7)}, r"f_dc_1\[5\]: is -1.7; LAM stores plain RGB"),
    ({f"f_rest_{k}": np.zeros(COUNT) for k in range(9)}, r"f_rest_\*: are present"),
    ({f"f_rest_{k}": np.zeros(COUNT) for k in range(8)}, r"f_rest_\*: 8 properties"),
    ({name: np.full(COUNT - 1, 0.5) for name in lam_files.PLY_NAMES}, "has 63 rows, .* 64 vertices"),
]


@pytest.mark.parametrize(("changes", "message"), BAD_OFFSETS, ids=[message for _, message in BAD_OFFSETS])
def test_bad_offsets(changes: dict[str, Any], message: str, tmp_path: Path) -> None:
    path = write_zip(tmp_path / "bad.zip", lam_files.files(offset=offset_ply(**changes)))
    refused(f"^lam: offset.ply: .*{message}", lam.read_lam, path)


def test_bad_zips(made: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    contents = lam_files.files()
    both = ("a/offset.ply", "a/skin.glb")
    for names, says in (
        ((*both, "b/offset.ply", "b/skin.glb"), "has 2 folders with offset.ply and skin.glb"),
        (("a/offset.ply", "b/skin.glb"), "has no folder with"),
        ((*both, "../evil"), "leads out"),
        ((*both, "/etc/evil"), "absolute"),
        (tuple(f"__MACOSX/{name}" for name in both), "has no folder with"),
    ):
        with zipfile.ZipFile(tmp_path / "names.zip", "w") as archive:
            for name in names:
                archive.writestr(name, contents.get(name.rpartition("/")[2], b"x"))
        refused(says, lam.read_lam, tmp_path / "names.zip")
    half = write_zip(tmp_path / "half.zip", lam_files.files(skin=None))
    (tmp_path / "junk.zip").write_bytes(b"PK\x03\x04" + b"junk" * 20)
    (tmp_path / "text.zip").write_text("no zip")
    for path in (*(tmp_path / f"{name}.zip" for name in ("names", "junk", "text", "absent")), half, tmp_path):
        assert not lam.detect(path)
        refused(".", lam.read, path, ReadOptions())
    monkeypatch.setattr(file_set, "MAX_FILE_BYTES", 1000)
    for path in (made, unpacked(made)):
        refused(r"offset\.ply: is 4764 bytes long; up to 1000", lam.read_lam, path)


def test_no_head_joint(tmp_path: Path) -> None:
    def renamed(document: dict[str, Any]) -> None:
        next(node for node in document["nodes"] if node["name"] == "head")["name"] = "Bone7"

    skin = edited(skin_glb(), renamed)
    path = write_zip(tmp_path / "headless.zip", lam_files.files(skin=skin))
    assert lam.read_lam(path).driving.head_joint is None
    refused("head_bone needs a joint 'head'", lam.read_lam, path, rotation="head_bone")


def test_nodes_in_another_pose_are_noted(tmp_path: Path) -> None:
    path = write_zip(tmp_path / "posed.zip", lam_files.files(skin=skin_glb(bind_offset=0.2)))
    (note,) = lam.read_lam(path).provenance["notes"]
    assert "binding pose" in text(note)


METRES = 1e-6
POSES = 4


@pytest.fixture(params=["made", "sample", "real"])
def lam_zip(request: pytest.FixtureRequest, tmp_path: Path) -> Path:
    """The small one, the conformance sample, and a trained one where it is present."""
    if request.param == "made":
        return lam_files.write_zip(tmp_path / "made.zip", lam_files.files())
    if request.param == "sample":
        sample: Path = request.getfixturevalue("sample_lam")
        return sample
    return shared("lam/p2-1.zip")


def _member(path: Path, name: str) -> bytes:
    with zipfile.ZipFile(path) as archive:
        inner = next(n for n in archive.namelist() if n.endswith(f"/{name}") and "__MACOSX" not in n)
        return archive.read(inner)


def _pose(avatar: Avatar, seed: int) -> Pose:
    """Seed 0: neutral; else every third expression, and turns of joints with weight (or of the first few)."""
    if seed == 0:
        return Pose()
    rng = np.random.default_rng(seed)
    names = avatar.expression_names[seed % 3 :: 3]
    joints = [avatar.rig.joint_names[j] for j in np.unique(avatar.skin.column)] if avatar.rig else []
    return Pose(
        {name: float(np.float32(rng.uniform(0, 1))) for name in names},
        {joint: joint_rotation(rng.normal(0, 0.2, 3)) for joint in joints},
    )


@pytest.mark.parametrize("seed", range(POSES))
def test_positions_are_the_trainers(lam_zip: Path, seed: int, backend: str, measured: Measure) -> None:
    avatar = read_lam(lam_zip)
    oracle = LamTrainer(_member(lam_zip, "offset.ply"), _member(lam_zip, "skin.glb"))
    pose = _pose(avatar, seed)
    # A large avatar's rows are shared out among the poses: the oracle walks them one by one.
    step = POSES if avatar.gaussians.count > 1000 else 1
    rows = range(seed % step, avatar.gaussians.count, step)
    want = oracle.positions(pose.expressions, pose.joints, rows)
    got = Player(avatar, backend).animate(pose).mean[rows.start :: step]
    away = float(np.linalg.norm(got - want, axis=1).max())
    measured(f"LAM{ON[backend]}, positions, m", away, METRES)
    assert away <= METRES
    if seed:
        moved = np.linalg.norm(want - avatar.gaussians.mean[rows.start :: step], axis=1)
        assert np.median(moved) > 1e-3, "a pose that moves nothing tests nothing"
