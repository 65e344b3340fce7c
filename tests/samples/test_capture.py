"""The synthetic captures: what they state is what their images show."""

from __future__ import annotations

import hashlib
import sys
from collections.abc import Iterator
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from PIL import Image
from samples.capture import __main__ as command
from samples.capture import head as capture_head
from samples.capture import shots as capture_shots
from samples.capture.body import write_body
from samples.capture.head import weights, write_head
from samples.capture.shots import Noise, splits
from samples.capture.tracking_mesh import load_tracking_head, tracking_body
from samples.subjects.body import load_body
from samples.subjects.body_model import JAW_SHAPES, MESH_ONLY, BodyModel
from samples.subjects.head import DATA, Head, load_head, unit
from samples.subjects.take import posed_vertices

from avatar_runtime.avatar import Rig
from avatar_runtime.pose import PoseArrays
from avatar_runtime.posed import posed_mesh
from avatar_runtime.stages.joints import joints
from avatar_trainer.captures.load import check_pixels, load, pixels
from avatar_trainer.captures.model import Capture, Frame
from tests.measured import Measure

Array = npt.NDArray[Any]

SIZE, FRAMES = 64, 10
FADE = 0.05  # metres above its lower edge from which on the bust is solid


@pytest.fixture(scope="module", autouse=True)
def fewer_rays() -> Iterator[None]:
    """Images of tests need not be as fine as those for training."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(capture_shots, "RAYS", 192)
        yield


@pytest.fixture(scope="module")
def head_capture(tmp_path_factory: pytest.TempPathFactory) -> Capture:
    folder = tmp_path_factory.mktemp("head")
    write_head(folder, SIZE, FRAMES, Noise())
    return load(folder)


@pytest.fixture(scope="module")
def body_capture(tmp_path_factory: pytest.TempPathFactory) -> Capture:
    folder = tmp_path_factory.mktemp("body")
    write_body(folder, SIZE, FRAMES, Noise())
    return load(folder)


def posed(rig: Rig, pose: PoseArrays) -> Array:
    """The rig's mesh as the runtime poses it."""
    return posed_mesh(rig, pose, joints(rig, pose))


def projected(points: Array, frame: Frame) -> Array:
    """Pixel places [N, 2] of points, pixel centres at integers."""
    camera = frame.camera
    seen = points @ camera.camera_from_world[:3, :3].T.astype(float) + camera.camera_from_world[:3, 3]
    ndc = seen[:, :2] / seen[:, 2:] / (camera.tan_half_fov_x, camera.tan_half_fov_y)
    return (ndc + 1) / 2 * (camera.width, camera.height) - 0.5


def test_both_are_sound_captures(head_capture: Capture, body_capture: Capture) -> None:
    for found in (head_capture, body_capture):
        check_pixels(found)
        assert len(found.frames) == FRAMES
        assert [f.split for f in found.frames] == ["train"] * 8 + ["test"] * 2
        assert found.rights["source"].startswith("synthetic")
        assert {"licence", "author", "consent"} <= found.rights.keys()
    assert "Lee Perry-Smith" in head_capture.rights["licence"]
    assert "CC BY 4.0" in body_capture.rights["licence"]
    assert head_capture.eyelids == ("left", "right")
    assert all((f.pose.late_weights == 0).all() for f in head_capture.frames)
    assert (head_capture.folder / "driving.json").is_file()


def test_tracked_mesh_is_the_one_in_the_images(
    head: Head, body: BodyModel, head_capture: Capture, measured: Measure
) -> None:
    """The coarse rig, posed by the runtime from capture.json, stands on the vertices of the full mesh."""
    take = capture_head.perform(body, FRAMES, ())
    _, rows = load_tracking_head(head)
    for k, frame in enumerate(head_capture.frames):
        away = posed(head_capture.rig, frame.pose) - posed_vertices(body, take, k)[rows]
        measured("tracking mesh against full mesh, m", float(np.abs(away).max()))
        assert np.abs(away).max() < 1e-6


def test_masks_show_the_posed_head(body: BodyModel, head_capture: Capture) -> None:
    """Every solid vertex falls on the mask, and the mask ends where the vertices do."""
    take = capture_head.perform(body, FRAMES, ())
    for k, frame in enumerate(head_capture.frames):
        vertices = posed_vertices(body, take, k)
        solid = vertices[:, 1] > body.v_template[:, 1].min() + FADE + 0.05
        place = projected(vertices, frame)
        mask = pixels(frame)[1]
        x, y = np.round(place[solid]).astype(int).T
        near = np.max([mask[y + dy, x + dx] for dx in (-1, 0, 1) for dy in (-1, 0, 1)], axis=0)
        assert (near > 0.1).all()
        drawn = np.zeros((SIZE + 4, SIZE + 4), bool)  # two pixels about every vertex
        column, row = np.round(place).astype(int).T
        for dx, dy in product(range(5), range(5)):
            drawn[row + dy, column + dx] = True
        assert drawn[2:-2, 2:-2][mask > 0.5].all(), "nothing is drawn where no vertex is"
        rows, columns = np.nonzero(mask > 0.01)
        assert abs(rows.min() - place[:, 1].min()) < 1
        assert columns.min() > place[:, 0].min() - 1 and columns.max() < place[:, 0].max() + 1


def test_each_image_is_of_its_own_parameters(head: Head, body: BodyModel, head_capture: Capture) -> None:
    take, model = capture_head.perform(body, FRAMES, ()), capture_head.Model(head, body)
    for k in (3, FRAMES - 1):
        frame = head_capture.frames[k]
        again = [model.image(take, row, frame.camera, 3) for row in (k, k - 1)]
        image, mask = pixels(frame)
        away = [np.abs(p.colour * p.alpha[..., None] - image * mask[..., None]).max() for p in again]
        assert away[0] < 0.01 and away[1] > 0.1


def test_masks_show_the_walking_man(body_capture: Capture) -> None:
    man = load_body()
    for k, frame in enumerate(body_capture.frames):
        mesh = man.posed(k).vertices
        assert np.abs(posed(body_capture.rig, frame.pose) - mesh).max() < 1e-6
        low, high = projected(mesh, frame).min(axis=0), projected(mesh, frame).max(axis=0)
        rows, columns = np.nonzero(pixels(frame)[1] > 0.01)
        assert np.abs(np.array([columns.min(), rows.min()]) - low).max() < 1
        assert np.abs(np.array([columns.max(), rows.max()]) - high).max() < 1


def test_the_mans_rig_has_no_seams(body_capture: Capture) -> None:
    triangles = body_capture.rig.triangles.astype(int)
    edges = np.sort(np.concatenate([triangles[:, [i, (i + 1) % 3]] for i in range(3)]), axis=1)
    assert (np.unique(edges, axis=0, return_counts=True)[1] == 2).all()


def test_the_camera_sees_both_sides_and_a_wider_yaw_in_training_only() -> None:
    def yaw(frame: int, degrees: float) -> float:
        _, rotation, translation = capture_head.camera_at(frame, 300, 256, np.radians(degrees))
        x, _, z = -rotation.T @ translation
        return float(np.degrees(np.arctan2(x, z)))

    for degrees, widest in ((40, 40), (110, 110)):
        train = [yaw(k, degrees) for k in range(240)]
        test = [yaw(k, degrees) for k in range(240, 300)]
        assert min(train) == pytest.approx(-widest, abs=1) and max(train) == pytest.approx(widest, abs=1)
        assert min(test) == pytest.approx(-40, abs=1) and max(test) == pytest.approx(40, abs=1)
    assert np.mean(np.abs([yaw(k, 110) for k in range(300)]) < 45) > 0.8


def test_every_expression_is_seen_in_training() -> None:
    names = load_head().expression_names
    for frames in (120, 300):
        train = weights(names, frames, ())[np.array(splits(frames)) == "train"]
        assert dict(zip(names, train.max(axis=0) > 0.2, strict=True)) == dict.fromkeys(names, True)
        assert train.min() >= 0 and train.max() <= 1


def test_jitter_shows_each_expression_nearly_at_full_from_many_sides(body: BodyModel) -> None:
    names = tuple(sorted(body.expression_names))
    count = 2 * len(names)
    shown = capture_head.jittered(names, count, ("cheekPuff",))
    assert np.array_equal(shown, capture_head.jittered(names, count, ("cheekPuff",)))
    assert shown.min() >= 0 and shown.max() <= 1
    greatest = dict(zip(names, shown.max(axis=0), strict=True))
    assert greatest.pop("cheekPuff") == 0 and min(greatest.values()) >= 0.7
    close, jaw = names.index("mouthClose"), names.index("jawOpen")
    assert (shown[:, jaw] >= shown[:, close]).all()
    seen = capture_head.cameras(load_head(), 120, 64, np.radians(110), count)
    assert len(seen) == count + 120
    sides = [np.degrees(np.arctan2(*(-r.T @ t)[[0, 2]])) for _, r, t in seen[:count]]
    assert min(sides) < -30 and max(sides) > 30
    take = capture_head.perform(body, 120, (), count)
    assert np.array_equal(take.expression[count:], capture_head.perform(body, 120, ()).expression)


def test_held_out_expressions_are_seen_in_testing_only(body: BodyModel) -> None:
    held = ("mouthPucker", "jawOpen")
    take, whole = (capture_head.perform(body, 120, names) for names in (held, ()))
    test = np.array(splits(120)) == "test"
    columns = [body.expression_names.index(name) for name in held]
    assert (take.expression[~test][:, columns] == 0).all()
    assert (take.expression[test][:, columns].max(axis=0) > 0.9).all()
    others = [k for k, n in enumerate(body.expression_names) if n not in (*held, *JAW_SHAPES, MESH_ONLY)]
    assert np.array_equal(take.expression[:, others], whole.expression[:, others])
    with pytest.raises(ValueError, match="mouthPuker is not an expression of the head"):
        capture_head.perform(body, 120, ("mouthPuker",))


def test_noise_is_in_the_parameters_only(tmp_path: Path) -> None:
    truth, noisy, again = (tmp_path / name for name in ("truth", "noisy", "again"))
    write_head(truth, 32, 4, Noise())
    for folder in (noisy, again):
        write_head(folder, 32, 4, Noise(tracking=0.05, calibration=0.01, seed=3))
    for image in sorted((truth / "images").iterdir()):
        assert image.read_bytes() == (noisy / "images" / image.name).read_bytes()
    assert (noisy / "capture.json").read_bytes() == (again / "capture.json").read_bytes()
    a, b = load(truth).frames, load(noisy).frames
    off = np.array([y.pose.expression_weights - x.pose.expression_weights for x, y in zip(a, b, strict=True)])
    assert np.std(off[:, :50]) == pytest.approx(0.05, rel=0.2) and (off[:, 50] == 0).all()
    turns = [y.pose.joint_delta[:, 0, 1] - x.pose.joint_delta[:, 0, 1] for x, y in zip(a, b, strict=True)]
    assert np.std(turns) == pytest.approx(0.05, rel=0.4)
    for x, y in zip(a, b, strict=True):
        assert x.camera.tan_half_fov_x != y.camera.tan_half_fov_x
        assert 0 < np.linalg.norm(x.camera.centre - y.camera.centre) < 0.06


def test_calibration_noise_has_the_deviation_asked_for() -> None:
    k, noise = np.array([[310.0, 0, 127.0], [0, 305.0, 129.0], [0, 0, 1]]), Noise(calibration=0.02, seed=1)
    stated = [noise.calibrated(k, np.eye(3), np.zeros(3)) for _ in range(400)]
    for intrinsics, rotation, _ in stated:
        assert np.array_equal(intrinsics[:, 2], k[:, 2]) and intrinsics[0, 1] == intrinsics[1, 0] == 0
        assert intrinsics[0, 0] / 310 == pytest.approx(intrinsics[1, 1] / 305)
        assert np.abs(rotation @ rotation.T - np.eye(3)).max() < 1e-12
    assert np.std([i[0, 0] / 310 for i, _, _ in stated]) == pytest.approx(0.02, rel=0.15)
    assert np.std([r[[0, 1, 2], [1, 2, 0]] for _, r, _ in stated]) == pytest.approx(0.02, rel=0.15)
    assert np.std([t for _, _, t in stated]) == pytest.approx(0.02, rel=0.15)


def test_tracking_mesh_is_a_sound_coarse_copy(head: Head, body: BodyModel) -> None:
    coarse, rows = load_tracking_head(head)
    assert len(rows) == len(np.unique(rows)) == 6000
    assert np.array_equal(np.unique(coarse.triangles), np.arange(6000))
    edges = np.sort(np.concatenate([coarse.triangles[:, [i, (i + 1) % 3]] for i in range(3)]), axis=1)
    directed = np.concatenate([coarse.triangles[:, [i, (i + 1) % 3]] for i in range(3)])
    assert np.unique(edges, axis=0, return_counts=True)[1].max() == 2
    assert len(np.unique(directed, axis=0)) == len(directed), "neighbours turn alike"
    a, b, c = coarse.vertices[coarse.triangles].transpose(1, 0, 2)
    normal, around = unit(np.cross(b - a, c - a)), head.vertex_normals[rows][coarse.triangles].mean(axis=1)
    skin = coarse.triangles_in("face", "head")
    assert np.mean(np.sum(normal * around, axis=1)[skin] < 0) < 0.002
    for name in head.part_names:
        assert coarse.in_part(name)[head.in_part(name)[rows]].mean() > 0.99, "parts keep their vertices"
    small = tracking_body(head, body)
    # Two sums of float32 products, which every BLAS adds in its own order: a few roundings of the largest joint.
    assert np.abs(small.joints - body.joints).max() <= 4 * np.spacing(np.abs(body.joints).max())
    assert np.abs(small.J_regressor.sum(axis=1) - 1).max() < 1e-5
    back = small.v_template[small.faces[small.back_of_head_faces]]
    assert back[:, :, 2].max() < -0.05 and np.abs(back[:, :, 0]).max() < 0.06


def test_texture_is_the_scans_colour(measured: Measure) -> None:
    """At the vertices of the skin it is the colour that was baked to them from the same scan."""
    head = load_head()
    image = np.asarray(Image.open(DATA / "head_texture.webp").convert("RGB"), float) / 255
    with np.load(DATA / "head_uv.npz", allow_pickle=False) as file:
        uv = file["uv"]
    assert uv.shape == (len(head.triangles), 3, 2) and uv.min() >= 0 and uv.max() <= 1
    front = head.triangles_in("face") & (head.vertices[head.triangles].mean(axis=1)[:, 2] > 0.06)
    x, y = np.moveaxis(np.clip((uv[front] * 1024).astype(int), 0, 1023), -1, 0)
    away = np.abs(image[y, x] - head.colors[head.triangles[front]]).max(axis=-1)
    measured("head texture against vertex colours, median", float(np.median(away)))
    assert np.median(away) < 0.02 and np.quantile(away, 0.9) < 0.08


def test_data_is_small() -> None:
    sizes = {n: (DATA / n).stat().st_size for n in ("head_texture.webp", "head_uv.npz", "tracking_mesh.npz")}
    assert max(sizes.values()) < 400_000


def test_command(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    digests = []
    for name in ("a", "b"):
        argv = ["capture", str(tmp_path / name), "--size", "32", "--frames", "3", "--hold-out", "jawOpen"]
        monkeypatch.setattr(sys, "argv", argv)
        command.main()
        files = sorted(p for p in (tmp_path / name).rglob("*") if p.is_file())
        digests.append([hashlib.sha256(p.read_bytes()).hexdigest() for p in files])
    assert digests[0] == digests[1], "the same bytes every time"
    assert capsys.readouterr().out.splitlines()[0] == str(tmp_path / "a" / "capture.json")
    assert len(load(tmp_path / "a").frames) == 3


def test_too_few_frames_are_refused(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="1 frames"):
        write_head(tmp_path, 32, 1, Noise())
