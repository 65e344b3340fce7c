"""ASM faces as avatars: posed as the paper's formulas say, ridden by other systems' Gaussians, refused in one line."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from avatar_export.asm import maths
from avatar_export.asm.bake import LEAST_WEIGHT, with_half_scales
from avatar_export.asm.files import save, save_person
from avatar_export.asm.model import AsmFace
from avatar_export.checks.bundle import validate
from avatar_export.clips.poses import clip_poses
from avatar_export.clips.sources import clips_from
from avatar_export.options import ReadOptions
from avatar_export.readers.table import find, read
from avatar_export.rigs.rig_file import read_rig_file
from avatar_runtime.avatar import Avatar
from avatar_runtime.io.errors import AvatarError
from avatar_runtime.player import Player
from avatar_runtime.pose import Pose
from tests.asm_faces import small_face
from tests.commands import Run, run
from tests.exporter.asm.unofficial_files import write_folder
from tests.exporter.readers import splatting_files
from tests.exporter.readers.splatting_files import write_gaussian_run, write_splatting_run
from tests.measured import Measure
from tests.oracles import asm as oracle

__all__ = ["run"]
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
    for take, clip in zip((*face.takes[1:], face.takes[0]), avatar.clips, strict=True):
        stored = take if take.name == "neutral" else with_half_scales(take)
        assert (clip.frames, clip.fps) == (len(take.scale), take.fps)
        for frame in {0, clip.frames - 1}:
            posed = player.mesh(clip_poses(avatar, clip)[frame])
            off = float(np.abs(posed - oracle.posed_face(face, stored, frame)).max()) / HEIGHT
            measured(
                "clips of an ASM face against the paper's formulas, scales as half floats, of height",
                off,
                AGREE,
            )
            assert off <= AGREE
            lost = 1e3 * float(np.abs(posed - oracle.posed_face(face, take, frame)).max())
            measured("half floats for scales of takes, mm", lost, 0.3)
            assert lost < 0.3


def test_half_scales_are_half_floats() -> None:
    face = small_face()
    scale = with_half_scales(face.takes[2]).scale
    np.testing.assert_array_equal(scale, scale.astype(np.float16))
    assert 0 < np.abs(scale / face.takes[2].scale - 1).max() <= 2**-11
    odd = replace(face.takes[1], scale=np.full_like(face.takes[1].scale, 1e30))
    np.testing.assert_array_equal(with_half_scales(odd).scale, odd.scale)


def test_the_rig_to_the_last_field(faces: dict[str, AsmFace], tmp_path: Path) -> None:
    face = faces["turned"]
    avatar = avatar_of(face, tmp_path)
    rig, t = avatar.rig, face.template
    assert rig is not None
    np.testing.assert_array_equal(rig.vertices, t.vertices)
    assert rig.joint_names == t.bone_names and rig.parents.tolist() == t.parents.tolist()
    np.testing.assert_allclose(
        rig.inverse_bind_matrix, np.linalg.inv(maths.bind_matrices(t, face.binding)), atol=1e-6
    )
    weights = np.zeros((len(t.vertices), len(t.bone_names)))
    row = np.repeat(np.arange(rig.skin.rows), np.diff(rig.skin.row_ptr.astype(int)))
    weights[row, rig.skin.column] = rig.skin.values["weight"]
    true = maths.mixture_weights(t, face.binding)
    assert ((weights == 0) == (true < LEAST_WEIGHT)).all()
    np.testing.assert_allclose(weights, true, atol=LEAST_WEIGHT * len(t.bone_names))
    np.testing.assert_allclose(weights.sum(axis=1), 1, atol=1e-6)
    assert not rig.morphs.entries and not avatar.expressions and not len(rig.corrective_joints)
    head = maths.bind_matrices(t, face.binding)[1]
    turned = maths.skin_matrices(face, face.takes[0])[0, 1] @ head
    np.testing.assert_allclose(avatar.driving.head_pivot, turned[:3, 3], atol=1e-6)
    assert avatar.driving.head_joint is None
    assert [f["path"] for f in avatar.provenance["source_files"]] == ["face.npz"]
    assert avatar.provenance["notes"][0] == "4 Gaussians a bone, weights by rule normalised"
    assert "lies within" in avatar.provenance["notes"][1] and "half floats" in avatar.provenance["notes"][2]


def test_a_person_s_file_takes_its_template_from_a_face(faces: dict[str, AsmFace], tmp_path: Path) -> None:
    face = faces["turned"]
    save(small_face(1, components=2), tmp_path / "template.npz")  # the same template, another person
    save_person(face, tmp_path / "person.npz")
    assert find(tmp_path / "person.npz").system == "asm"
    with pytest.raises(
        AvatarError, match=r"asm: .*person\.npz: holds a person without the template; .*--mesh"
    ):
        read(tmp_path / "person.npz")
    found = read(tmp_path / "person.npz", ReadOptions(mesh=tmp_path / "template.npz"))
    whole = avatar_of(face, tmp_path)
    np.testing.assert_array_equal(Player(found).mesh(Pose()), Player(whole).mesh(Pose()))
    assert [f["path"] for f in found.provenance["source_files"]] == ["mesh/template.npz", "person.npz"]
    with pytest.raises(AvatarError, match="--mesh: is only for the small file of a person"):
        read(tmp_path / "face.npz", ReadOptions(mesh=tmp_path / "template.npz"))
    save(faces["plain"], tmp_path / "other.npz")
    with pytest.raises(AvatarError, match="fitted with another template"):
        read(tmp_path / "person.npz", ReadOptions(mesh=tmp_path / "other.npz"))


def test_the_unofficial_code_s_folder(tmp_path: Path) -> None:
    write_folder(tmp_path / "repo" / "data")
    assert find(tmp_path / "repo").system == "asm"
    avatar = read(tmp_path / "repo", ReadOptions(name="Mu"))
    assert avatar.name == "Mu" and avatar.rig is not None and [c.name for c in avatar.clips] == ["neutral"]
    np.testing.assert_allclose(Player(avatar).mesh(Pose()), avatar.rig.vertices, atol=1e-6)
    assert len(avatar.provenance["source_files"]) == 3


def obj_of(vertices: Any, triangles: Any) -> str:
    return splatting_files.obj_text(np.round(vertices.astype(np.float64), 7), triangles)


def test_splatting_avatar_rides_on_a_face(
    faces: dict[str, AsmFace], tmp_path: Path, measured: Measure
) -> None:
    """Trained on the neutral's mesh; a frame of a take carries its Gaussians as posed vertices would."""
    face = faces["turned"]
    save(face, tmp_path / "face.npz")
    neutral = maths.posed(face, face.takes[0])
    run = tmp_path / "run"
    write_splatting_run(run, A, obj=obj_of(neutral, face.template.triangles))
    avatar = read(run, ReadOptions(rig=tmp_path / "face.npz", units=1.0))
    assert avatar.rig is not None and avatar.rig.joint_names == face.template.bone_names
    assert [c.name for c in avatar.clips] == ["smile", "talk", "neutral"]
    notes = avatar.provenance["notes"]
    assert any("vertices of face.npz found by the same numbering" in note for note in notes)
    assert any("the rig at rest is the mesh to within 0.00" in note for note in notes)
    player = Player(avatar, "reference")
    pose = clip_poses(avatar, avatar.clips[1])[3]
    vertices = maths.posed(face, with_half_scales(face.takes[2]), 3)
    by_bones, by_mesh = (
        player.animate(pose),
        player.animate(Pose(), posed_vertices=vertices.astype(np.float32)),
    )
    off = float(np.abs(by_bones.mean - by_mesh.mean).max()) / HEIGHT
    measured("SplattingAvatar's Gaussians on ASM bones against the posed mesh, of height", off, AGREE)
    assert off <= AGREE
    assert np.abs(by_bones.mean - player.animate(Pose()).mean).max() > 0.01 * HEIGHT


def test_a_face_of_another_mesh_is_refused(faces: dict[str, AsmFace], tmp_path: Path) -> None:
    save(faces["plain"], tmp_path / "face.npz")
    write_splatting_run(tmp_path / "run", A)
    with pytest.raises(
        AvatarError, match=r"face\.npz: the mesh has 6 vertices in 8 triangles .* the rig has 143"
    ):
        read(tmp_path / "run", ReadOptions(rig=tmp_path / "face.npz"))


def test_gaussian_avatars_sit_on_the_neutral(faces: dict[str, AsmFace], tmp_path: Path) -> None:
    face = faces["turned"]
    save(face, tmp_path / "face.npz")
    write_gaussian_run(tmp_path / "run", A, vertices=None)
    avatar = read(tmp_path / "run", ReadOptions(rig=tmp_path / "face.npz"))
    assert avatar.embedding is not None
    np.testing.assert_allclose(
        avatar.embedding.canonical_vertices, maths.posed(face, face.takes[0]), atol=1e-6
    )


def test_the_takes_of_another_face_play_on_the_bones_of_the_same_names(
    faces: dict[str, AsmFace], tmp_path: Path
) -> None:
    face, other = faces["plain"], faces["softplus"]
    save(other, tmp_path / "other.npz")
    avatar = avatar_of(face, tmp_path)
    found = {clip.name: clip for clip in clips_from(avatar, tmp_path / "other.npz")}
    assert set(found) == {"smile_2", "talk_2", "neutral_2"}
    np.testing.assert_array_equal(
        found["talk_2"].joint_delta, avatar_of(other, tmp_path).clips[1].joint_delta
    )
    one = found["smile_2"]
    renamed = replace(other.template, bone_names=(*(f"x{k}" for k in range(11)), "nose_tip"))
    save(replace(other, template=renamed), tmp_path / "renamed.npz")
    moved = clips_from(avatar, tmp_path / "renamed.npz")[0].joint_delta
    assert (moved[:, [k for k in range(12) if k != 3]] == np.eye(4)).all()
    np.testing.assert_array_equal(moved[:, 3], one.joint_delta[:, 11])


def test_a_rig_file_says_what_it_is(faces: dict[str, AsmFace], tmp_path: Path) -> None:
    save(faces["plain"], tmp_path / "face.npz")
    found = read_rig_file(tmp_path / "face.npz")
    assert found.morph_names == () and [note.kind for note in found.notes] == ["asm_neutral"]
    np.savez(tmp_path / "x.npz", vertices=np.zeros((3, 3)))
    with pytest.raises(AvatarError, match=r"x\.npz: has no array asm_version, so it is not an ASM face"):
        read_rig_file(tmp_path / "x.npz")


def test_the_commands(run: Run, faces: dict[str, AsmFace], tmp_path: Path) -> None:
    save(faces["turned"], tmp_path / "face.npz")
    out = tmp_path / "out"
    code, _, error = run("convert", tmp_path / "face.npz", "-o", out, "--no-preview", "--no-reference")
    assert code == 0, error
    assert validate(out) == []
    code, text, _ = run("inspect", out)
    assert code == 0 and "asm" in text and "nose" not in error
    image = tmp_path / "a.png"
    code, _, error = run("render", out, "-o", image, "--clip", "talk", "--frames", "2:3", "--size", "64")
    assert code == 0, error
    assert image.stat().st_size > 500


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (("--units", "100"), "--units: cannot be used with an ASM .npz"),
        (
            ("--rig", "x.glb"),
            "--rig cannot be used here: the face contains its mesh, rig and clips",
        ),
        (("--mesh", "nowhere.npz"), "--mesh: is only for the small file of a person"),
    ],
)
def test_bad_options(run: Run, tmp_path: Path, options: tuple[str, ...], message: str) -> None:
    save(small_face(), tmp_path / "face.npz")
    code, out, error = run("convert", tmp_path / "face.npz", "-o", tmp_path / "out", *options)
    assert code == 2 and message in error and error.count("\n") == 1 and not out
    assert not (tmp_path / "out").exists()


def test_a_face_without_area_is_named(tmp_path: Path) -> None:
    face = small_face()
    flat = replace(face.template, triangles=np.zeros_like(face.template.triangles))
    save(replace(face, template=flat), tmp_path / "flat.npz")
    with pytest.raises(
        AvatarError, match=r"asm: .*flat\.npz: triangles: no triangle of the mesh has an area"
    ):
        read(tmp_path / "flat.npz")


def test_a_damaged_face_is_one_line_and_2(run: Run, tmp_path: Path) -> None:
    save(small_face(), tmp_path / "face.npz")
    data = bytearray((tmp_path / "face.npz").read_bytes())
    data[400:420] = b"\xff" * 20
    (tmp_path / "bad.npz").write_bytes(data)
    code, _, error = run("convert", tmp_path / "bad.npz", "-o", tmp_path / "out")
    assert code == 2 and error.count("\n") == 1 and "bad.npz" in error
