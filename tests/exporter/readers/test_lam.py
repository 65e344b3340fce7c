"""What the LAM reader makes of good and of bad files."""

from __future__ import annotations

import json
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from avatar_export.formats import file_set
from avatar_export.options import ReadOptions
from avatar_export.playing.sequences import recorded
from avatar_export.readers import lam
from avatar_export.readers.table import expect_bundle, find
from avatar_runtime.codec import glb
from avatar_runtime.io.errors import AvatarError
from tests.exporter.readers import lam_files
from tests.exporter.readers.lam_files import COUNT, offset_ply, skin_glb


@pytest.fixture
def made(tmp_path: Path) -> Path:
    return lam_files.write_zip(tmp_path / "made.zip", lam_files.files())


def test_the_avatar_to_the_last_field(made: Path) -> None:
    avatar = lam.read(made, ReadOptions())
    document = glb.decode(skin_glb())
    vertices = glb.accessor(document, 0)
    rows = np.frombuffer(offset_ply().partition(b"end_header\n")[2], "<f4").reshape(COUNT, -1)
    assert avatar.name == "made"
    assert np.array_equal(avatar.gaussians.mean, vertices + rows[:, :3])
    assert np.array_equal(
        avatar.gaussians.sh[:, 0], ((rows[:, 6:9].astype("f8") - 0.5) / 0.28209479177387814).astype("f4")
    )
    assert np.array_equal(avatar.gaussians.opacity_logit, rows[:, 9])
    assert np.array_equal(avatar.gaussians.log_scale, rows[:, 10:13])
    assert np.array_equal(avatar.gaussians.quat_wxyz, rows[:, 13:17])
    assert avatar.expression_names == lam_files.MORPHS
    assert [(g.name, g.first, g.count, g.binding) for g in avatar.groups] == [("body", 0, COUNT, "skin")]
    assert (avatar.rules.rotation, avatar.rules.sh_direction) == ("none", "world")
    assert (avatar.sh_degree, avatar.head_pose_in, avatar.raster.background) == (0, "mesh", "per_view")
    assert (avatar.driving.mode, avatar.driving.head_joint) == ("names", "head")
    assert avatar.skin is avatar.rig.skin
    geometry = avatar.blendshapes.geometry
    assert np.array_equal(geometry.values["mean"], avatar.rig.morphs.values["position"])
    assert not geometry.values["quat_wxyz"].any()
    assert avatar.blendshapes.appearance.entries == 0
    assert avatar.provenance["system"] == "lam" and avatar.provenance["notes"] == []
    assert avatar.clips == ()


@pytest.mark.parametrize("folder", ["", "someone/", "deep/er/"])
def test_zip_and_folder_are_one_avatar(folder: str, made: Path, tmp_path: Path) -> None:
    whole = lam.read_lam(made)
    other = lam_files.write_zip(tmp_path / "other.zip", lam_files.files(animation=None), folder)
    assert lam.detect(other)
    assert np.array_equal(lam.read_lam(other).gaussians.mean, whole.gaussians.mean)
    with zipfile.ZipFile(made) as archive:
        archive.extractall(tmp_path / "unpacked")
    for path in (tmp_path / "unpacked", tmp_path / "unpacked" / "someone"):
        assert lam.detect(path)
        assert lam.read_lam(path).name == path.name
    assert (whole.name, lam.read_lam(other).name) == ("made", "other")


def test_expressions_in_the_zip_are_a_clip(tmp_path: Path) -> None:
    """As LAM_Audio2Expression adds them: the other clips of the zip stay first."""
    names = ["tongueOut", lam_files.MORPHS[1], lam_files.MORPHS[0]]
    frames = [{"weights": [1, k / 4, 0.5], "time": k / 25, "rotation": []} for k in range(4)]
    told = {"names": names, "metadata": {"fps": 25, "frame_count": 4}, "frames": frames}
    contents = lam_files.files(expressions=json.dumps(told).encode())
    path = lam_files.write_zip(tmp_path / "talk.zip", contents, "arkitWithBSData/")
    avatar = lam.read(path, ReadOptions())
    (clip,) = avatar.clips
    assert (avatar.name, clip.name, clip.fps, clip.frames) == ("talk", "bsData", 25, 4)
    np.testing.assert_allclose(clip.expression_weights[:, :2], [[0.5, k / 4] for k in range(4)])
    assert not clip.expression_weights[:, 2:].any()
    with zipfile.ZipFile(path) as archive:
        archive.extractall(tmp_path)
    unpacked = lam.read(tmp_path / "arkitWithBSData", ReadOptions())
    assert np.array_equal(unpacked.clips[0].expression_weights, clip.expression_weights)
    assert "bsData.json" in {entry["path"] for entry in unpacked.provenance["source_files"]}


def test_expressions_in_the_zip_are_a_recording(tmp_path: Path) -> None:
    """`render --drive talk.zip`, or a zip with that file alone; without it a line says what plays the zip."""
    frames = [{"weights": [k / 4], "time": k / 25, "rotation": []} for k in range(4)]
    told = json.dumps(
        {"names": ["jawOpen"], "metadata": {"fps": 25, "frame_count": 4}, "frames": frames}
    ).encode()
    whole = lam_files.write_zip(tmp_path / "talk.zip", lam_files.files(expressions=told))
    avatar = lam.read(whole, ReadOptions())
    alone = lam_files.write_zip(tmp_path / "alone.zip", {"bsData.json": told})
    with zipfile.ZipFile(whole) as archive:
        archive.extractall(tmp_path / "unpacked")
    (tmp_path / "bare.json").write_bytes(told)
    wanted = recorded(avatar, tmp_path / "bare.json")
    for path in (whole, alone, tmp_path / "unpacked"):
        found = recorded(avatar, path)
        assert (found.fps, [pose.expressions for pose in found.poses]) == (
            25,
            [p.expressions for p in wanted.poses],
        )
    assert any(any(pose.expressions.values()) for pose in wanted.poses)
    silent = lam_files.write_zip(tmp_path / "silent.zip", lam_files.files())
    with pytest.raises(
        AvatarError, match=r"silent\.zip: holds no bsData\.json, so no recording; --clip plays"
    ):
        recorded(avatar, silent)


def test_a_truncated_zip_is_called_truncated(made: Path, tmp_path: Path) -> None:
    cut = tmp_path / "cut.zip"
    data = made.read_bytes()
    for length in (len(data) // 2, len(data) - 30):
        cut.write_bytes(data[:length])
        for attempt in (lambda: lam.read_lam(cut), lambda: find(cut), lambda: expect_bundle(cut)):
            with pytest.raises(AvatarError, match="is a truncated zip"):
                attempt()


@pytest.mark.parametrize("rotation", ["none", "polar3", "head_bone"])
def test_rotation_rules(rotation: str, made: Path) -> None:
    rules = lam.read(made, ReadOptions(rotation=rotation)).rules
    assert rules.rotation == rotation
    assert rules.rotation_joint == ("head" if rotation == "head_bone" else None)


def test_what_is_no_lam_avatar_is_not_detected(tmp_path: Path) -> None:
    junk = tmp_path / "junk.zip"
    junk.write_bytes(b"PK\x03\x04" + b"junk" * 20)
    half = lam_files.write_zip(tmp_path / "half.zip", lam_files.files(skin=None))
    litter = _zip_of(BAD_NAMES["litter only"], tmp_path)
    for path in (junk, half, litter, tmp_path, tmp_path / "absent", made_text(tmp_path)):
        assert not lam.detect(path)
        with pytest.raises(AvatarError):
            lam.read(path, ReadOptions())


def made_text(folder: Path) -> Path:
    path = folder / "text.zip"
    path.write_text("no zip")
    return path


def _with(values: np.ndarray, row: int, value: float) -> np.ndarray:
    changed = values.copy()
    changed[row] = value
    return changed


ZEROS = np.zeros(COUNT)
BAD_OFFSETS: dict[str, tuple[dict[str, Any], str]] = {
    **{
        f"nan in {name}": ({name: _with(ZEROS, 7, np.nan)}, f"offset.ply: {name}[7]: is nan")
        for name in (*lam_files.PLY_NAMES[:3], *lam_files.PLY_NAMES[6:])
    },
    "infinite scale": ({"scale_1": _with(ZEROS, 3, np.inf)}, "offset.ply: scale_1[3]: is inf"),
    "no opacity": ({"opacity": None}, "property opacity: is missing"),
    "SH instead of RGB": ({"f_dc_1": _with(ZEROS, 5, -1.7)}, "f_dc_1[5]: is -1.7; LAM stores plain RGB"),
    "a higher degree": ({f"f_rest_{k}": ZEROS for k in range(9)}, "f_rest_*: are present"),
    "eight f_rest": ({f"f_rest_{k}": ZEROS for k in range(8)}, "f_rest_*: 8 properties"),
}


@pytest.mark.parametrize("case", BAD_OFFSETS)
def test_bad_offsets_are_named(case: str, tmp_path: Path) -> None:
    changes, message = BAD_OFFSETS[case]
    path = lam_files.write_zip(tmp_path / "bad.zip", lam_files.files(offset=offset_ply(**changes)))
    with pytest.raises(AvatarError) as caught:
        lam.read_lam(path)
    assert str(caught.value).startswith("lam: offset.ply: ") and message in str(caught.value)


def test_another_row_count_is_refused(tmp_path: Path) -> None:
    rows = {name: np.full(COUNT - 1, 0.5) for name in lam_files.PLY_NAMES}
    path = lam_files.write_zip(tmp_path / "bad.zip", lam_files.files(offset=offset_ply(**rows)))
    with pytest.raises(AvatarError, match=r"has 63 rows, but skin\.glb has 64 vertices"):
        lam.read_lam(path)


def _zip_of(names: list[str], tmp_path: Path) -> Path:
    path = tmp_path / "names.zip"
    contents = lam_files.files()
    with zipfile.ZipFile(path, "w") as archive:
        for name in names:
            archive.writestr(name, contents.get(name.rpartition("/")[2], b"x"))
    return path


BAD_NAMES = {
    "two avatars": ["a/offset.ply", "a/skin.glb", "b/offset.ply", "b/skin.glb"],
    "in different folders": ["a/offset.ply", "b/skin.glb"],
    "leading out": ["a/offset.ply", "a/skin.glb", "../evil"],
    "absolute": ["a/offset.ply", "a/skin.glb", "/etc/evil"],
    "litter only": ["__MACOSX/a/offset.ply", "__MACOSX/a/skin.glb"],
}


@pytest.mark.parametrize("case", BAD_NAMES)
def test_bad_zips_are_refused(case: str, tmp_path: Path) -> None:
    with pytest.raises(AvatarError):
        lam.read_lam(_zip_of(BAD_NAMES[case], tmp_path))


def test_a_file_too_large_is_refused_before_it_is_read(
    made: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(file_set, "MAX_FILE_BYTES", 1000)
    with zipfile.ZipFile(made) as archive:
        archive.extractall(tmp_path / "unpacked")
    for path in (made, tmp_path / "unpacked"):
        with pytest.raises(AvatarError, match=r"offset\.ply: is 4764 bytes long; up to 1000"):
            lam.read_lam(path)


def test_options_without_a_use_are_refused(made: Path) -> None:
    for options, name in (
        (ReadOptions(no_rig=True), "--no-rig"),
        (ReadOptions(body_model=Path("x.npz")), "--body-model"),
        (ReadOptions(rotation="triangle_frame"), "rotation"),
    ):
        with pytest.raises(AvatarError, match=f"lam: {name}"):
            lam.read(made, options)
    assert lam.read(made, ReadOptions(name="other")).name == "other"


def test_no_head_joint(tmp_path: Path) -> None:
    skin = _renamed(skin_glb(), "head", "Bone7")
    path = lam_files.write_zip(tmp_path / "headless.zip", lam_files.files(skin=skin))
    assert lam.read_lam(path).driving.head_joint is None
    with pytest.raises(AvatarError, match="head_bone needs a joint 'head'"):
        lam.read_lam(path, rotation="head_bone")


def _renamed(data: bytes, old: str, new: str) -> bytes:
    def change(document: dict[str, Any]) -> None:
        next(n for n in document["nodes"] if n["name"] == old)["name"] = new

    return lam_files.edited(data, change)


def test_nodes_in_another_pose_are_noted(tmp_path: Path) -> None:
    path = lam_files.write_zip(tmp_path / "posed.zip", lam_files.files(skin=skin_glb(bind_offset=0.2)))
    (note,) = lam.read_lam(path).provenance["notes"]
    assert note.kind == "nodes_off_binding"
