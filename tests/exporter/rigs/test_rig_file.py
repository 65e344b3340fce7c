"""Rigs of .glb files in the forms that exporters give them; any bytes give a rig or an AvatarError."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from avatar_export.clips.poses import clip_poses, rig_avatar
from avatar_export.clips.sources import clips_from
from avatar_export.rigs.rig_driving import expressions_named, rig_driving
from avatar_export.rigs.rig_file import RigFile, read_rig_file
from avatar_runtime.avatar import Rig
from avatar_runtime.io.errors import AvatarError
from avatar_runtime.player import Player
from tests.avatars import full_avatar
from tests.exporter.readers.lam_files import edited
from tests.exporter.readers.test_lam_mangled import HOSTILE, _places, _set
from tests.exporter.rigs import fbx_files, rig_files
from tests.exporter.rigs.rig_files import Part, rig_glb
from tests.hostile import MANGLING, mangled, only_avatar_errors
from tests.rigs import rig_of
from tests.shared_data import shared

METRES = 1e-6


def _written(folder: Path, data: bytes, name: str = "made.glb") -> Path:
    path = folder / name
    path.write_bytes(data)
    return path


def _expect_moves(path: Path, rig: Rig, names: tuple[str, ...], rows: Any) -> None:
    """The clip of the file on its own rig against plain sums; row i of the rig is vertex rows[i]."""
    avatar = rig_avatar(rig, expressions_named(names))
    (clip,) = clips_from(avatar, path)
    assert (clip.name, clip.fps, clip.frames) == ("nod", rig_files.FPS, rig_files.FRAMES)
    player = Player(avatar)
    for frame, pose in enumerate(clip_poses(avatar, clip)):
        share = frame / (rig_files.FRAMES - 1)
        want = rig_files.posed(share * rig_files.ANGLE, share)[rows]
        np.testing.assert_allclose(player.mesh(pose), want, atol=METRES)


FORMS: dict[str, tuple[list[Part], dict[str, Any]]] = {
    "one primitive": (rig_files.whole(), {}),
    "two materials": (rig_files.split(), {}),
    "two meshes on one skin": (rig_files.split(), {"nodes": True}),
    "triangle soup": (rig_files.soup(), {}),
    "lying, in centimetres": (rig_files.split(), {"lying": True}),
}


@pytest.mark.parametrize("form", FORMS)
def test_every_form_moves_alike(tmp_path: Path, form: str) -> None:
    parts, options = FORMS[form]
    path = _written(tmp_path, rig_glb(parts, **options))
    found = read_rig_file(path)
    rows = np.concatenate([part.rows for part in parts])
    np.testing.assert_allclose(found.rig.vertices, rig_files.vertices()[rows], atol=METRES)
    first = np.cumsum([0, *(len(part.rows) for part in parts)])
    triangles = np.concatenate([part.triangles + at for part, at in zip(parts, first, strict=False)])
    np.testing.assert_array_equal(found.rig.triangles, triangles)
    assert found.rig.joint_names == rig_files.JOINTS and found.morph_names == rig_files.MORPHS
    assert found.vertex_ids is None and found.notes == ()
    world = np.linalg.inv(found.rig.inverse_bind_matrix)
    np.testing.assert_allclose(world[:, :3, 3], rig_files.PLACES, atol=METRES)
    _expect_moves(path, found.rig, found.morph_names, rows)


def test_materials_on_the_same_vertices_keep_them_once(tmp_path: Path) -> None:
    everything = np.arange(len(rig_files.vertices()))
    sheet = rig_files.sheet()
    parts = [Part(everything, sheet[:30]), Part(everything, sheet[30:])]
    found = read_rig_file(_written(tmp_path, rig_glb(parts, shared=True)))
    assert len(found.rig.vertices) == len(everything)
    np.testing.assert_array_equal(found.rig.triangles, sheet)


@pytest.mark.parametrize("ids", ["attribute", "uv", "flipped"])
def test_vertex_ids(tmp_path: Path, ids: str) -> None:
    parts = rig_files.split()
    found = read_rig_file(_written(tmp_path, rig_glb(parts, ids=ids)))
    assert found.vertex_ids is not None
    np.testing.assert_array_equal(found.vertex_ids, np.concatenate([part.rows for part in parts]))


@pytest.mark.parametrize("uv", [0.3, 1.0, 2.5, -0.7, np.nan, 1e30])
def test_plain_uv_are_no_ids(tmp_path: Path, uv: float) -> None:
    """An image's coordinates, and repeats of it, in one vertex are enough."""
    parts = rig_files.whole()
    data = bytearray(rig_glb(parts, ids="uv"))
    pairs = np.stack([np.arange(63) % 256, np.full(63, 2)], axis=1).astype("<f4")
    at = bytes(data).index(pairs.tobytes())
    data[at + 4 : at + 8] = np.array([uv], "<f4").tobytes()
    assert read_rig_file(_written(tmp_path, bytes(data))).vertex_ids is None


def test_driving_by_the_names_of_shapes_and_joints(tmp_path: Path) -> None:
    found = read_rig_file(_written(tmp_path, rig_glb()))
    expressions = expressions_named(found.morph_names)
    assert [(e.name, e.aliases) for e in expressions] == [("AK_25_JawOpen", ("jawOpen",)), ("smile", ())]
    driving = rig_driving(found.rig, expressions)
    assert (driving.mode, driving.head_joint, driving.left_eye_joint) == ("names", "head", None)
    assert rig_driving(found.rig, expressions_named(("a", "b"))).mode == "none"


@pytest.mark.parametrize(
    ("names", "head", "eyes"),
    [
        (("root", "neck", "jaw", "leftEye", "rightEye"), "neck", ("leftEye", "rightEye")),
        (("pelvis", "neck", "head"), "head", (None, None)),
        (
            ("mixamorig:Neck", "mixamorig:Head", "mixamorig:LeftEye"),
            "mixamorig:Head",
            ("mixamorig:LeftEye", None),
        ),
        (("Bip01 Head", "Bip01 LEye", "Bip01 REye"), "Bip01 Head", ("Bip01 LEye", "Bip01 REye")),
        (("CC_Base_Head", "CC_Base_L_Eye"), "CC_Base_Head", ("CC_Base_L_Eye", None)),
        (("Headwear", "eye.L", "eye.R"), None, ("eye.L", "eye.R")),
    ],
)
def test_joints_by_common_names(
    names: tuple[str, ...], head: str | None, eyes: tuple[str | None, ...]
) -> None:
    driving = rig_driving(replace(rig_of(full_avatar()), joint_names=names), ())
    assert driving.head_joint == head and (driving.left_eye_joint, driving.right_eye_joint) == eyes


def test_two_skins_are_refused(tmp_path: Path) -> None:
    def second_skin(document: dict[str, Any]) -> None:
        document["skins"].append(document["skins"][0])
        document["nodes"][4]["skin"] = 1

    data = edited(rig_glb(rig_files.split(), nodes=True), second_skin)
    with pytest.raises(AvatarError, match=r"2 nodes have a mesh and a skin \(part0, part1\)"):
        read_rig_file(_written(tmp_path, data))


def test_other_files_are_refused(tmp_path: Path) -> None:
    with pytest.raises(
        AvatarError, match=r"is not a rig that can be read; pass a \.glb or \.fbx or \.npz file"
    ):
        read_rig_file(_written(tmp_path, b"", "rig.obj"))
    with pytest.raises(AvatarError, match=r"made\.glb: is not a GLB file"):
        read_rig_file(_written(tmp_path, fbx_files.fbx()))
    with pytest.raises(AvatarError, match=r"no\.glb: cannot be read"):
        read_rig_file(tmp_path / "no.glb")


def test_an_fbx(tmp_path: Path) -> None:
    found = read_rig_file(_written(tmp_path, fbx_files.fbx(), "made.FBX"))
    assert isinstance(found, RigFile) and found.vertex_ids is None
    np.testing.assert_allclose(found.rig.vertices, fbx_files.posed(0, 0), atol=METRES)


def test_cesium_man_stands() -> None:
    """Bound lying down; its nodes stand it up, 1.5 m tall, left arm at +X, facing +Z."""
    rig = read_rig_file(shared("gltf/CesiumMan.glb")).rig
    low, high = rig.vertices.min(axis=0), rig.vertices.max(axis=0)
    assert low[1] == pytest.approx(0, abs=0.01) and high[1] == pytest.approx(1.507, abs=0.001)
    place = dict(zip(rig.joint_names, np.linalg.inv(rig.inverse_bind_matrix)[:, :3, 3], strict=True))
    assert place["Skeleton_arm_joint_L__2_"][0] > 0.3 and place["Skeleton_arm_joint_R__2_"][0] < -0.3


SOUND = rig_glb(rig_files.split(), ids="attribute", lying=True)


def _read(folder: Path, data: bytes) -> None:
    path = _written(folder, data, "mangled.glb")

    def both() -> None:
        found = read_rig_file(path)
        clips_from(rig_avatar(found.rig, expressions_named(found.morph_names)), path, optional=True)

    only_avatar_errors(both)


@MANGLING
@given(mangled(SOUND))
def test_mangled(tmp_path_factory: Any, data: bytes) -> None:
    _read(tmp_path_factory.getbasetemp(), data)


def _document() -> Any:
    found: list[Any] = []
    edited(SOUND, found.append)
    return found[0]


PLACES = [place for place in _places(_document()) if place]


@MANGLING
@given(st.sampled_from(PLACES), HOSTILE)
def test_any_value_anywhere(tmp_path_factory: Any, place: tuple[Any, ...], value: Any) -> None:
    _read(tmp_path_factory.getbasetemp(), edited(SOUND, _set(place, value)))
