"""ASM faces as avatars: posed as the paper's formulas say, ridden by other systems' Gaussians, refused in one line."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from avatar_export.asm import maths
from avatar_export.asm.bake import with_half_scales
from avatar_export.asm.files import save, save_person
from avatar_export.asm.model import AsmFace
from avatar_export.clips.poses import clip_poses
from avatar_export.notes.text import stored
from avatar_export.options import ReadOptions
from avatar_export.readers.table import find, read
from avatar_export.rigs.rig_file import read_rig_file
from avatar_runtime.avatar import Avatar
from avatar_runtime.player import Player
from avatar_runtime.pose import Pose
from tests.asm_faces import small_face
from tests.exporter.asm.test_unofficial import write_folder
from tests.exporter.readers import splatting_files
from tests.exporter.readers.splatting_files import write_splatting_run
from tests.exporter.refusals import refused
from tests.measured import Measure
from tests.oracles import asm as oracle

HEIGHT = 0.25  # metres
AGREE = 1e-5  # of the height
A = splatting_files.arrays(degree=1)


@pytest.fixture(scope="module")
def faces() -> dict[str, AsmFace]:
    return {
        "plain": small_face(turned=False),
        "turned": small_face(1, components=4),
        "stretched": small_face(2, stretched=True),
        "softplus": small_face(3, weight_rule="softplus", coloured=False),
    }


def avatar_of(face: AsmFace, folder: Path) -> Avatar:
    save(face, folder / "face.npz")
    return read(folder / "face.npz")


@pytest.mark.parametrize("name", ["plain", "turned", "stretched", "softplus"])
def test_rest_is_the_neutral_and_clips_are_the_takes(
    faces: dict[str, AsmFace], name: str, tmp_path: Path, measured: Measure
) -> None:
    face = faces[name]
    avatar = avatar_of(face, tmp_path)
    player = Player(avatar, "reference")
    neutral = oracle.posed_face(face, face.takes[0], 0)
    off = float(np.abs(player.mesh(Pose()) - neutral).max()) / HEIGHT
    measured("an ASM face at rest against the paper's formulas, of height", off, AGREE)
    assert off <= AGREE
    assert np.abs(neutral - face.template.vertices).max() > 0.02 * HEIGHT  # or nothing was tested
    assert [clip.name for clip in avatar.clips] == ["smile", "talk", "neutral"]
    clips = "clips of an ASM face against the paper's formulas, scales as half floats, of height"
    for take, clip in zip((*face.takes[1:], face.takes[0]), avatar.clips, strict=True):
        stored = take if take.name == "neutral" else with_half_scales(take)
        assert (clip.frames, clip.fps) == (len(take.scale), take.fps)
        for frame in {0, clip.frames - 1}:
            posed = player.mesh(clip_poses(avatar, clip)[frame])
            off = float(np.abs(posed - oracle.posed_face(face, stored, frame)).max()) / HEIGHT
            measured(clips, off, AGREE)
            assert off <= AGREE
            assert np.abs(posed - oracle.posed_face(face, take, frame)).max() < 3e-4  # metres, by half floats


def test_a_person_s_file_takes_its_template_from_a_face(faces: dict[str, AsmFace], tmp_path: Path) -> None:
    face = faces["turned"]
    save(small_face(1, components=2), tmp_path / "template.npz")  # the same template, another person
    save(faces["plain"], tmp_path / "other.npz")
    person = save_person(face, tmp_path / "person.npz") or tmp_path / "person.npz"
    assert find(person).system == "asm"
    found, whole = read(person, ReadOptions(mesh=tmp_path / "template.npz")), avatar_of(face, tmp_path)
    np.testing.assert_array_equal(Player(found).mesh(Pose()), Player(whole).mesh(Pose()))
    assert [f["path"] for f in found.provenance["source_files"]] == ["mesh/template.npz", "person.npz"]
    flat = replace(face.template, triangles=np.zeros_like(face.template.triangles))
    save(replace(face, template=flat), tmp_path / "flat.npz")
    data = bytearray((tmp_path / "face.npz").read_bytes())
    data[400:420] = b"\xff" * 20
    (tmp_path / "bad.npz").write_bytes(data)
    template, other = tmp_path / "template.npz", tmp_path / "other.npz"
    for name, options, says in (
        ("person", {}, r"asm: .*person\.npz: .*--mesh"),
        ("person", {"mesh": other}, "another template"),
        ("face", {"mesh": template}, "--mesh: is only for the small file of a person"),
        ("face", {"units": 100.0}, "--units: cannot be used with an ASM .npz"),
        ("face", {"rig": Path("x.glb")}, "--rig cannot be used here"),
        ("flat", {}, r"asm: .*flat\.npz: triangles: no triangle of the mesh has an area"),
        ("bad", {}, r"bad\.npz"),
    ):
        refused(says, read, tmp_path / f"{name}.npz", ReadOptions(**options))


def test_the_unofficial_code_s_folder(tmp_path: Path) -> None:
    write_folder(tmp_path / "repo" / "data")
    assert find(tmp_path / "repo").system == "asm"
    avatar = read(tmp_path / "repo", ReadOptions(name="Mu"))
    assert avatar.name == "Mu" and avatar.rig is not None and [c.name for c in avatar.clips] == ["neutral"]
    np.testing.assert_allclose(Player(avatar).mesh(Pose()), avatar.rig.vertices, atol=1e-6)
    assert len(avatar.provenance["source_files"]) == 3


def test_splatting_avatar_rides_on_it(faces: dict[str, AsmFace], tmp_path: Path, measured: Measure) -> None:
    face = faces["turned"]
    save(face, tmp_path / "face.npz")
    neutral = maths.posed(face, face.takes[0])
    run = tmp_path / "run"
    obj = splatting_files.obj_text(np.round(neutral.astype(np.float64), 7), face.template.triangles)
    write_splatting_run(run, A, obj=obj)
    avatar = read(run, ReadOptions(rig=tmp_path / "face.npz", units=1.0))
    assert avatar.rig is not None and avatar.rig.joint_names == face.template.bone_names
    assert [c.name for c in avatar.clips] == ["smile", "talk", "neutral"]
    assert "the same numbering" in str(avatar.provenance["notes"])
    player = Player(avatar, "reference")
    pose = clip_poses(avatar, avatar.clips[1])[3]
    vertices = maths.posed(face, with_half_scales(face.takes[2]), 3)
    by_bones = player.animate(pose)
    by_mesh = player.animate(Pose(), posed_vertices=vertices.astype(np.float32))
    off = float(np.abs(by_bones.mean - by_mesh.mean).max()) / HEIGHT
    measured("SplattingAvatar's Gaussians on ASM bones against the posed mesh, of height", off, AGREE)
    assert off <= AGREE
    assert np.abs(by_bones.mean - player.animate(Pose()).mean).max() > 0.01 * HEIGHT


def test_a_rig_file_says_what_it_is(faces: dict[str, AsmFace], tmp_path: Path) -> None:
    save(faces["plain"], tmp_path / "face.npz")
    found = read_rig_file(tmp_path / "face.npz")
    assert found.morph_names == () and "neutral" in str(stored(found.notes))
    np.savez(tmp_path / "x.npz", vertices=np.zeros((3, 3)))
    refused(r"x\.npz: has no array asm_version, so it is not an ASM face", read_rig_file, tmp_path / "x.npz")
