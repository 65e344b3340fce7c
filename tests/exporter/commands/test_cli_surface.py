"""The command line on avatars that are embedded in a mesh, from a checkpoint to images."""

from __future__ import annotations

import json
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from avatar_export.playing.meshes import read_meshes
from avatar_export.playing.sequences import PoseSequence, clip
from avatar_export.readers.table import expect_bundle, find
from avatar_runtime.avatar import Avatar, Rules
from avatar_runtime.bundle import load
from avatar_runtime.clips import frame_pose
from avatar_runtime.io.errors import AvatarError
from avatar_runtime.player import Player
from tests.avatars import surface_avatar
from tests.commands import Run
from tests.session.rights import as_anybody

PLAIN = ("--no-preview", "--no-engine-files", "--no-reference")


@pytest.fixture(scope="module")
def head(sample_splatting_head: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The bundle of the sample head without a rig."""
    from typer.testing import CliRunner

    from avatar_export.cli import app

    out = tmp_path_factory.mktemp("bundles") / "head"
    source = sample_splatting_head / "run"
    done = CliRunner().invoke(app, ["convert", str(source), "-o", str(out), *PLAIN])
    assert done.exit_code == 0, done.output
    return out


def write_obj(path: Path, vertices: Any, triangles: Any) -> Path:
    lines = [f"v {x:.6f} {y:.6f} {z:.6f}" for x, y, z in vertices]
    path.write_text("\n".join(lines + [f"f {a} {b} {c}" for a, b, c in triangles + 1]) + "\n")
    return path


def images(path: Path) -> list[Any]:
    with Image.open(path) as image:
        frames = []
        for index in range(image.n_frames):
            image.seek(index)
            frames.append(np.asarray(image.convert("RGB")).astype(int))
    return frames


def test_the_rig_comes_from_a_body_model_and_its_poses_are_a_clip(
    run: Run,
    sample_splatting_head: Path,
    tmp_path: Path,
) -> None:
    out, folder = tmp_path / "head", sample_splatting_head
    code, text, notes = run(
        *("convert", folder / "run", "-o", out, "--body-model", folder / "body" / "body_model.npz"),
        *("--poses", folder / "flame_params.json", *PLAIN),
    )
    assert code == 0 and "1 clip," in text
    assert "4 training units a metre" in notes
    assert {p.suffix for p in out.iterdir()} == {".json", ".ply", ".safetensors"}
    code, text, _ = run(
        "render", out, "-o", tmp_path / "talk.webp", "--clip", "flame_params", "--every", "30", "--size", "48"
    )
    assert code == 0
    frames = images(tmp_path / "talk.webp")
    assert len(frames) == -(-load(out).clips[0].frames // 30)
    assert np.abs(frames[0] - frames[1]).max() > 30, "the head moves"
    code, _, error = run("render", out, "-o", tmp_path / "x.webp", "--clip", "flame_param")
    assert code == 2 and "flame_params" in error


def test_a_head_without_a_rig_plays_posed_meshes(run: Run, head: Path, tmp_path: Path) -> None:
    avatar = load(head)
    assert avatar.rig is None and avatar.embedding is not None
    e, u = avatar.embedding, avatar.training_per_bundle
    turn = np.array([[0.0, 0, 1], [0, 1, 0], [-1, 0, 0]])
    posed = np.stack([e.canonical_vertices, e.canonical_vertices @ turn.T])
    np.savez(tmp_path / "training.npz", vertices=posed * u)
    np.savez(tmp_path / "metres.npz", vertices=posed.astype(np.float32))
    objs = [write_obj(tmp_path / f"{i}.obj", v * u, e.triangles.astype(int)) for i, v in enumerate(posed)]
    size = ("--size", "48")
    meshes = {
        "training.webp": ("--meshes", tmp_path / "training.npz"),
        "metres.webp": ("--meshes", tmp_path / "metres.npz", "--mesh-units", "1"),
        "obj.webp": ("--meshes", objs[0], "--meshes", objs[1]),
    }
    drawn = {}
    for name, flags in meshes.items():
        code, text, error = run("render", head, "-o", tmp_path / name, *flags, *size)
        assert code == 0, error
        assert "2 images" in text
        drawn[name] = images(tmp_path / name)
    assert np.abs(drawn["training.webp"][0] - drawn["training.webp"][1]).max() > 60, "it turned"
    for name in ("metres.webp", "obj.webp"):
        for a, b in zip(drawn[name], drawn["training.webp"], strict=True):
            assert np.abs(a - b).max() <= 12
    code, _, error = run("render", head, "-o", tmp_path / "no.webp", "--meshes", tmp_path / "metres.npz")
    assert code == 2 and "0.25 times as large" in error and "--mesh-units" in error
    assert not (tmp_path / "no.webp").exists()


def test_inspect_names_the_mesh(run: Run, head: Path) -> None:
    code, text, _ = run("inspect", head, "--json")
    facts = json.loads(text)
    assert code == 0
    assert facts["rules"]["rotation"] == "vertex_quaternion" and facts["rules"]["scale"] == "log_area"
    assert facts["embedding"]["vertices"] > 1000 and len(facts["embedding"]["topology_hash"]) == 64


BAD_CONVERSIONS = {
    "two rigs": (("--rig", "x.glb", "--body-model", "y.npz"), "pass only one of them"),
    "no such rig": (("--rig", "nowhere.glb"), "no such file"),
    "a rule": (("--sh-direction", "sideways"), "not one of inverse_rotation, world"),
    "a sign": (("--quaternion-sign", "plus"), "not one of w_positive"),
    "influences": (("--influences", "5"), "not one of 4, 8"),
    "poses of no rig": (("--poses", "take.npz"), "--poses needs a rig"),
    "a shape of no rig": (("--shape", "shape.npy"), "--shape needs a rig"),
    "a shape beside a rig": (("--shape", "zero", "--rig", "x.glb"), "--shape needs --body-model"),
    "a scale of no body": (("--body-scale", "7"), "--body-scale cannot be used here"),
    "no rig with a body": (
        ("--no-rig", "--body-model", "b.npz", "--poses", "p.json"),
        "--body-model and --poses would have no effect beside --no-rig; leave out --body-model and --poses",
    ),
    "a folder for a rig": (("--rig", "."), "--rig: is a folder; pass a .glb"),
    "a folder for poses": (
        ("--body-model", __file__, "--poses", "."),
        "--poses: is a folder; pass a flame_params",
    ),
    "no such mesh": (("--mesh", "nowhere.ob"), "nowhere.ob: no such file"),
    "an option of another system": (("--eyelids", "x"), "--eyelids cannot be used here"),
}


@pytest.mark.parametrize("name", BAD_CONVERSIONS)
def test_bad_conversions(run: Run, sample_splatting_head: Path, tmp_path: Path, name: str) -> None:
    flags, message = BAD_CONVERSIONS[name]
    code, _, error = run("convert", sample_splatting_head / "run", "-o", tmp_path / "out", *flags)
    assert code == 2 and message in " ".join(error.replace("│", " ").split())
    assert not (tmp_path / "out").exists()


def test_the_folder_above_an_avatar_names_it(run: Run, sample_splatting_head: Path, tmp_path: Path) -> None:
    code, _, error = run("convert", sample_splatting_head, "-o", tmp_path / "out")
    found = sample_splatting_head / "run"
    assert (code, error.count("\n")) == (2, 1)
    assert f"is not itself an avatar, but holds {found} (splatting_avatar); pass that path" in error


def test_a_folder_that_may_not_be_read(tmp_path: Path) -> None:
    (tmp_path / "run").mkdir(mode=0)
    for open_it in (find, expect_bundle):
        with pytest.raises(AvatarError, match=r"run: cannot be read \(Permission denied\)$"):
            as_anybody(lambda call=open_it: call(tmp_path / "run"))


def test_settings_that_nothing_says_are_a_warning(
    run: Run, sample_splatting_head: Path, tmp_path: Path
) -> None:
    """Without config.yaml a head comes out four times too large; the bundle stores what it always stored."""
    shutil.copytree(sample_splatting_head / "run" / "point_cloud", tmp_path / "run" / "point_cloud")
    plain = ("--no-preview", "--no-engine-files", "--no-reference", "--force", "-o", tmp_path / "out")
    warning = "warning: no file of the checkpoint and no option says"
    error = run("convert", tmp_path / "run", *plain)[2]
    assert error.startswith(f"{warning} 1 training unit a metre and mesh scaling off; wrong values")
    assert warning not in " ".join(load(tmp_path / "out").provenance["notes"])
    error = run("convert", tmp_path / "run", *plain, "--units", "4")[2]
    assert error.startswith(f"{warning} mesh scaling off; wrong")
    assert warning not in run("convert", tmp_path / "run", *plain, "--units", "4", "--mesh-scaling")[2]
    assert warning not in run("convert", sample_splatting_head / "run", *plain)[2]


BAD_MESHES: dict[str, tuple[Any, str]] = {
    "another count": (lambda v, t: (v[:-1], t[(t < len(v) - 1).all(axis=1)]), "19 vertices"),
    "renumbered": (lambda v, t: (v[::-1], t), "0 times|other triangles"),
    "turned triangles": (lambda v, t: (v, t[:, ::-1]), "other triangles"),
}


@pytest.mark.parametrize("name", BAD_MESHES)
def test_meshes_that_are_another(tmp_path: Path, name: str) -> None:
    avatar = surface_avatar()
    assert avatar.embedding is not None
    change, message = BAD_MESHES[name]
    vertices, triangles = avatar.embedding.canonical_vertices * 4, avatar.embedding.triangles.astype(int)
    path = write_obj(tmp_path / "x.obj", *change(vertices, triangles))
    if name == "renumbered":
        triangles = (len(vertices) - 1 - triangles)[::-1]
        path = write_obj(tmp_path / "x.obj", vertices[::-1], triangles)
    with pytest.raises(AvatarError, match=message):
        read_meshes(avatar, [path], None)


def test_triangles_in_another_order_are_the_same_mesh(tmp_path: Path) -> None:
    avatar = surface_avatar()
    assert avatar.embedding is not None
    e = avatar.embedding
    triangles = np.roll(e.triangles.astype(int)[::-1], 1, axis=1)
    sequence = read_meshes(avatar, [write_obj(tmp_path / "x.obj", e.canonical_vertices * 4, triangles)], None)
    np.testing.assert_allclose(sequence[0], e.canonical_vertices, atol=2e-7)


def test_a_folder_of_meshes_is_played_in_the_order_of_names(tmp_path: Path) -> None:
    avatar = surface_avatar()
    assert avatar.embedding is not None
    vertices, triangles = avatar.embedding.canonical_vertices * 4, avatar.embedding.triangles.astype(int)
    for number in (3, 10, 1, 2, 0):  # made in no order
        write_obj(tmp_path / f"{number:02}.obj", vertices + 0.01 * number, triangles)
    (tmp_path / "readme.txt").write_text("no mesh")
    sequence = read_meshes(avatar, [tmp_path], None)
    lift = [float((mesh - avatar.embedding.canonical_vertices).mean()) * 400 for mesh in sequence]
    np.testing.assert_allclose(lift, [0, 1, 2, 3, 10], atol=1e-3)
    (tmp_path / "empty").mkdir()
    with pytest.raises(AvatarError, match=r"has no \.obj"):
        read_meshes(avatar, [tmp_path / "empty"], None)


def test_arrays_that_are_no_meshes(tmp_path: Path) -> None:
    avatar = surface_avatar()
    for name, array, message in (
        ("a", np.zeros((2, 19, 3)), r"expected floats \[frames, 20, 3\]"),
        ("b", np.zeros((2, 20, 3), int), "expected floats"),
        ("c", np.full((20, 3), np.nan), "not finite"),
        ("d", np.zeros((0, 20, 3)), "expected floats"),
        ("e", np.full((2, 20, 3), 1e300), "not finite, or larger than"),
    ):
        np.savez(tmp_path / f"{name}.npz", vertices=array)
        with pytest.raises(AvatarError, match=message):
            read_meshes(avatar, [tmp_path / f"{name}.npz"], None)
    with pytest.raises(AvatarError, match=r"pass one .npz, or only .obj files"):
        read_meshes(avatar, [tmp_path / "a.npz", tmp_path / "b.npz"], None)


def test_meshes_do_not_tell_how_joints_turn(tmp_path: Path) -> None:
    avatar = surface_avatar(rules=Rules("bary_vertex_lbs", position="interpolated_normal"))
    np.savez(tmp_path / "a.npz", vertices=np.zeros((2, 20, 3), np.float32))
    with pytest.raises(AvatarError, match=r"--meshes: rotation bary_vertex_lbs .* by joints"):
        read_meshes(avatar, [tmp_path / "a.npz"], None)


def test_a_clip_of_the_bundle_is_played_as_it_stands(splatting_head_avatar: Avatar) -> None:
    avatar = splatting_head_avatar
    sequence: PoseSequence = clip(avatar, avatar.clips[0].name, None).part(slice(None, None, 2))
    assert sequence.fps == avatar.clips[0].fps / 2
    player = Player(avatar)
    want = player.mesh(frame_pose(avatar, avatar.clips[0], 4))
    np.testing.assert_array_equal(player.mesh(sequence.poses[2]), want)
    part = sequence.part(slice(1, 3))
    np.testing.assert_array_equal(player.mesh(part.poses[1]), want)
