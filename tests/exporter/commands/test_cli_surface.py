"""The command line on avatars that are embedded in a mesh, from a checkpoint to images."""

from __future__ import annotations

import json
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image, ImageSequence

from avatar_export.conversion import convert
from avatar_export.convert_options import ConvertOptions
from avatar_export.playing.meshes import read_meshes
from avatar_export.readers.table import expect_bundle, find
from avatar_runtime.avatar import Rules
from avatar_runtime.bundle import load
from avatar_runtime.camera import Camera
from avatar_runtime.io.errors import AvatarError
from avatar_runtime.player import Player
from avatar_runtime.pose import Pose
from tests.avatars import surface_avatar
from tests.commands import PLAIN, Refused, Run
from tests.session.rights import as_anybody


@pytest.fixture(scope="module")
def head(sample_splatting_head: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("bundles") / "head"
    options = ConvertOptions(preview=False, engine_files=False, reference=False)
    convert(sample_splatting_head / "run", out, options)
    return out


def write_obj(path: Path, vertices: Any, triangles: Any) -> Path:
    lines = [f"v {x:.6f} {y:.6f} {z:.6f}" for x, y, z in vertices]
    path.write_text("\n".join(lines + [f"f {a} {b} {c}" for a, b, c in triangles + 1]) + "\n")
    return path


def images(path: Path) -> list[Any]:
    with Image.open(path) as image:
        return [np.asarray(frame.convert("RGB")).astype(int) for frame in ImageSequence.Iterator(image)]


def test_the_rig_comes_from_a_body_model_and_its_poses_are_a_clip(
    run: Run, sample_splatting_head: Path, tmp_path: Path
) -> None:
    out, folder = tmp_path / "head", sample_splatting_head
    code, text, notes = run(
        *("convert", folder / "run", "-o", out, "--body-model", folder / "body" / "body_model.npz"),
        *("--poses", folder / "flame_params.json", *PLAIN),
    )
    assert code == 0 and "1 clip," in text and "4" in notes
    assert {p.suffix for p in out.iterdir()} == {".json", ".ply", ".safetensors"}
    flags = ("--clip", "flame_params", "--every", "30", "--size", "48")
    assert run("render", out, "-o", tmp_path / "talk.webp", *flags)[0] == 0
    frames = images(tmp_path / "talk.webp")
    assert len(frames) == -(-load(out).clips[0].frames // 30)
    assert np.abs(frames[0] - frames[1]).max() > 30, "the head moves"
    code, _, error = run("render", out, "-o", tmp_path / "x.webp", "--clip", "flame_param")
    assert code == 2 and "flame_params" in error


def test_a_head_without_a_rig_plays_posed_meshes(run: Run, head: Path, tmp_path: Path) -> None:
    avatar, facts = load(head), json.loads(run("inspect", head, "--json")[1])
    assert facts["embedding"]["vertices"] > 1000 and len(facts["embedding"]["topology_hash"]) == 64
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
    assert code == 2 and "0.25 times" in error and "--mesh-units" in error
    assert not (tmp_path / "no.webp").exists()


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
        "leave out --body-model and --poses",
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


def test_the_folder_above_an_avatar_names_it(
    refused: Refused, sample_splatting_head: Path, tmp_path: Path
) -> None:
    error = refused("convert", sample_splatting_head, "-o", tmp_path / "out")
    assert f"{sample_splatting_head / 'run'} (splatting_avatar); pass that path" in error


def test_a_folder_that_may_not_be_read(tmp_path: Path) -> None:
    (tmp_path / "run").mkdir(mode=0)
    for open_it in (find, expect_bundle):
        with pytest.raises(AvatarError, match=r"run: cannot be read \(Permission denied\)$"):
            as_anybody(lambda call=open_it: call(tmp_path / "run"))


def test_settings_that_nothing_says_are_a_warning(
    run: Run, sample_splatting_head: Path, tmp_path: Path
) -> None:
    """Without config.yaml a head comes out four times too large; the bundle stores what it always stored."""
    head = sample_splatting_head / "run"
    shutil.copytree(head / "point_cloud", tmp_path / "run" / "point_cloud")
    plain = (*PLAIN, "--force", "-o", tmp_path / "out")
    error = run("convert", tmp_path / "run", *plain)[2]
    assert error.startswith("warning: ") and "units" in error and "mesh scaling" in error
    assert not any("warning: " in note for note in map(str, load(tmp_path / "out").provenance["notes"]))
    error = run("convert", tmp_path / "run", *plain, "--units", "4")[2]
    assert error.startswith("warning: ") and "units" not in error.partition("mesh scaling")[0]
    assert "warning: " not in run("convert", tmp_path / "run", *plain, "--units", "4", "--mesh-scaling")[2]
    assert "warning: " not in run("convert", head, *plain)[2]


def test_a_folder_of_meshes_is_played_in_the_order_of_names(tmp_path: Path) -> None:
    """However its triangles are ordered."""
    avatar = surface_avatar()
    assert avatar.embedding is not None
    vertices, triangles = avatar.embedding.canonical_vertices * 4, avatar.embedding.triangles.astype(int)
    for number in (3, 10, 1, 2, 0):  # made in no order
        turned = np.roll(np.roll(triangles, number, axis=0), 1, axis=1)
        write_obj(tmp_path / f"{number:02}.obj", vertices + 0.01 * number, turned)
    (tmp_path / "readme.txt").write_text("no mesh")
    lift = [
        np.subtract(mesh, avatar.embedding.canonical_vertices) * 400
        for mesh in read_meshes(avatar, [tmp_path], None)
    ]
    np.testing.assert_allclose(
        lift, np.tile(np.reshape([0, 1, 2, 3, 10], (5, 1, 1)), (1, len(vertices), 3)), atol=1e-3
    )
    (tmp_path / "empty").mkdir()
    kept = triangles[(triangles < 19).all(axis=1)]
    renumbered = (19 - triangles)[::-1]
    for path, message in (
        (tmp_path / "empty", r"has no \.obj"),
        (write_obj(tmp_path / "a.obj", vertices[:-1], kept), "19 vertices"),
        (write_obj(tmp_path / "b.obj", vertices[::-1], renumbered), "0 times|other triangles"),
        (write_obj(tmp_path / "c.obj", vertices, triangles[:, ::-1]), "other triangles"),
    ):
        with pytest.raises(AvatarError, match=message):
            read_meshes(avatar, [path], None)


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


BUNDLE = Path(__file__).parents[3] / "samples" / "trained" / "head_blendshapes"
WIDTH, HEIGHT = 24, 18
K = np.array([[60.0, 0, 13], [0, 60, 8], [0, 0, 1]])


def view(t: int) -> tuple[np.ndarray, np.ndarray]:
    turn = 0.3 * t
    rotation = np.array([[np.cos(turn), 0, -np.sin(turn)], [0, -1, 0], [-np.sin(turn), 0, -np.cos(turn)]])
    return rotation, np.array([0.01, 0.02, 0.8])


@pytest.fixture
def take(tmp_path: Path) -> Path:
    cameras = [{"K": K.tolist(), "R": view(t)[0].tolist(), "t": view(t)[1].tolist()} for t in range(3)]
    document = {"width": WIDTH, "height": HEIGHT, "frames": [{"camera": camera} for camera in cameras]}
    (tmp_path / "take").mkdir()
    (tmp_path / "take" / "capture.json").write_text(json.dumps(document))
    return tmp_path / "take"


def test_a_pose_is_seen_by_each_camera(take: Path, tmp_path: Path, run: Run) -> None:
    out = tmp_path / "seen"
    code, said, err = run(
        "render", BUNDLE, "-o", out, "--camera", take, "--camera-frames", "1:", "-e", "jawOpen=0.5"
    )
    assert code == 0, err
    assert f"2 images of {WIDTH}x{HEIGHT}" in said
    player = Player(load(BUNDLE))
    for index, t in enumerate((1, 2)):
        camera = Camera.from_opencv(*view(t), K, WIDTH, HEIGHT)
        wanted = player.frame(Pose({"jawOpen": 0.5}), camera).rgb8()
        with Image.open(out / f"frame_{index:05d}.png") as drawn:
            assert np.array_equal(np.asarray(drawn), wanted)
        assert wanted.std() > 5, "there is something to see"


def test_sizes_and_counts(take: Path, tmp_path: Path, run: Run) -> None:
    camera = ("--camera", take / "capture.json")
    one = ("render", BUNDLE, "-o", tmp_path / "a.png", *camera, "--camera-frames", "0:1", "--size", "48")
    assert "1 image of 48x36" in run(*one)[1]
    for arguments, message in (
        ((*camera, "--size", "24x24x"), "is not N or WxH"),
        ((*camera, "--size", "48x24"), "24x18"),
        ((*camera, "--camera-frames", "7:"), "holds no camera"),
        ((*camera, "--clip", "held_out", "--frames", "0:2"), "3 cameras for 2 poses"),
        ((*camera, "--yaw", "3"), "cannot be used together"),
        (("--camera-frames", "1:"), "needs --camera"),
    ):
        code, _, err = run("render", BUNDLE, "-o", tmp_path / "b", *arguments)
        assert code == 2 and message in err and not (tmp_path / "b").exists(), err
