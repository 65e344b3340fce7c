"""Rigs of .glb files in the forms that exporters give them; any bytes give a rig or an AvatarError."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from avatar_export.clips.poses import clip_poses, rig_avatar
from avatar_export.clips.sources import clips_from
from avatar_export.rigs.rig_driving import expressions_named, rig_driving
from avatar_export.rigs.rig_file import RigFile, read_rig_file
from avatar_runtime.avatar import Rig
from avatar_runtime.player import Player
from tests.avatars import full_avatar
from tests.exporter.refusals import refused
from tests.exporter.rigs import fbx_files, rig_files
from tests.exporter.rigs.rig_files import Part, rig_glb
from tests.rigs import rig_of

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


@pytest.mark.parametrize(
    ("names", "head", "eyes"),
    [
        (("root", "neck", "jaw", "leftEye", "rightEye"), "neck", ("leftEye", "rightEye")),
        (("pelvis", "neck", "head"), "head", (None, None)),
        (("mixamorig:Neck", "mixamorig:Head", "mixamorig:LeftEye"), "mixamorig:Head", ("mixamorig:LeftEye", None)),
        (("Bip01 Head", "Bip01 LEye", "Bip01 REye"), "Bip01 Head", ("Bip01 LEye", "Bip01 REye")),
        (("CC_Base_Head", "CC_Base_L_Eye"), "CC_Base_Head", ("CC_Base_L_Eye", None)),
        (("Headwear", "eye.L", "eye.R"), None, ("eye.L", "eye.R")),
    ],
)  # fmt: skip
def test_common_names(names: tuple[str, ...], head: str | None, eyes: tuple[str | None, ...]) -> None:
    driving = rig_driving(replace(rig_of(full_avatar()), joint_names=names), ())
    assert driving.head_joint == head and (driving.left_eye_joint, driving.right_eye_joint) == eyes


def test_files_of_each_kind(tmp_path: Path) -> None:
    found = read_rig_file(_written(tmp_path, fbx_files.fbx(), "made.FBX"))
    assert isinstance(found, RigFile) and found.vertex_ids is None
    np.testing.assert_allclose(found.rig.vertices, fbx_files.posed(0, 0), atol=METRES)
    refused(r"pass a \.glb or \.fbx or \.npz file", read_rig_file, _written(tmp_path, b"", "rig.obj"))
    refused(r"made\.glb: is not a GLB file", read_rig_file, _written(tmp_path, fbx_files.fbx()))
    refused(r"no\.glb: cannot be read", read_rig_file, tmp_path / "no.glb")
