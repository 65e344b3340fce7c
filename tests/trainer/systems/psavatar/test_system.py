"""PSAvatar while it is trained: where it begins, its formulas and gradients, its two stages, its state."""

from __future__ import annotations

import copy
from dataclasses import replace
from pathlib import Path
from typing import Any

import numba
import numpy as np
import pytest
import torch

from avatar_runtime.backends.cpu.threads import using
from avatar_runtime.io.errors import AvatarError
from avatar_trainer.captures.model import Capture
from avatar_trainer.evaluation.evaluate import evaluate
from avatar_trainer.systems.drawing import draw
from avatar_trainer.systems.psavatar.initial import REGIONS, sample_points
from avatar_trainer.systems.psavatar.settings import LearningRates
from avatar_trainer.systems.psavatar.system import create
from avatar_trainer.tensors import Points, Splats
from tests.measured import Measure
from tests.oracles import joint_turns as oracle
from tests.trainer.systems.psavatar import scene
from tests.trainer.systems.splatting_avatar import scene as sheet


@pytest.fixture(scope="module")
def capture(tmp_path_factory: pytest.TempPathFactory) -> Capture:
    return sheet.taught(tmp_path_factory.mktemp("sheet"))


def test_points_begin_on_the_mesh_by_area_and_off_it_along_the_normal(capture: Capture) -> None:
    wide = capture.rig.vertices * (
        1 + 9 * capture.rig.vertices[:, :1].clip(0, None)
    )  # larger triangles to one side
    rig = replace(capture.rig, vertices=wide)
    found = sample_points(
        rig,
        "all",
        40_000,
        0.25,
        0.03,
        np.ones(len(rig.triangles)),
        np.ones(len(rig.triangles)),
        np.random.default_rng(0),
    )
    assert found.off_mesh.sum() == 10_000 and (found.displacement[~found.off_mesh] == 0).all()
    r = np.sort(found.displacement[found.off_mesh])
    assert np.abs(r - 0.03 * (np.arange(10_000) + 0.5) / 10_000).max() < 0.03 * 0.025  # U[0, r_max]
    corner = rig.vertices.astype(float)[rig.triangles]
    area = np.linalg.norm(np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]), axis=1)
    expected = 40_000 * area / area.sum()
    counted = np.bincount(found.triangle, minlength=len(area))
    assert area.max() > 1.4 * area.min()
    assert np.abs(counted - expected).max() < 5 * np.sqrt(expected.max())
    assert (found.barycentric >= 0).all() and found.barycentric.sum(1) == pytest.approx(1, abs=1e-6)
    assert np.abs(found.barycentric.mean(0) - 1 / 3).max() < 0.01


def test_it_begins_as_points_at_rest(capture: Capture) -> None:
    system = scene.system_of(capture, off_mesh=0.4, displacement="off_mesh")
    points = system.splats(capture.frames[0].pose)  # frame 0 is at rest
    assert isinstance(points, Points)
    triangles = sheet.sheet()
    for i in range(len(points.mean)):
        height = float(system.table["displacement"][i].detach())
        assert (height > 0) == bool(system.off_mesh[i])
        place = oracle.point(
            capture.rig.vertices, triangles, int(system.triangle[i]), system.barycentric[i].numpy(), height,
            scene.FLOOR,
        )  # fmt: skip
        assert np.abs(points.mean[i].detach().numpy() - place).max() < 1e-6
    assert points.opacity.detach()[system.off_mesh].numpy() == pytest.approx(0.1)
    assert points.opacity.detach()[~system.off_mesh].numpy() == pytest.approx(0.5)
    # Discs of the points on the mesh overlap: they cover more than the area together.
    radius = points.radius.detach()[~system.off_mesh]
    assert float((radius**2).sum()) * np.pi > 2 * 0.24**2


@pytest.mark.parametrize("which", ["off_mesh", "all"])
def test_whose_offset_is_trained(capture: Capture, which: str) -> None:
    """Under rule displacement off_mesh what was sampled on the mesh stays there, and has no gradient."""
    system = scene.system_of(capture, off_mesh=0.4, displacement=which)
    pose = capture.frames[0].pose
    before = system.splats(pose).mean.detach()
    with torch.no_grad():
        system.table["displacement"].add_(0.01)
    after = system.splats(pose).mean
    moved = (after.detach() - before).norm(dim=1)
    trained = system.off_mesh if which == "off_mesh" else torch.ones_like(system.off_mesh)
    assert (moved[trained] > 0.005).all() and (moved[~trained] == 0).all()
    after.sum().backward()
    gradient = system.table["displacement"].grad
    assert gradient is not None and ((gradient != 0) == trained).all()


@pytest.mark.parametrize("order", ["mesh_first", "as_printed"])
def test_gaussians_are_carried_as_the_paper_says(capture: Capture, order: str, measured: Measure) -> None:
    """Eqs. 4 to 11 for every Gaussian of every frame; the mesh's joints see nothing of the learned bases."""
    system = scene.as_gaussians(capture, order=order)
    weights, triangles = sheet.body()["weights"], sheet.sheet()
    bases = scene.dense_bases(system)
    far = turned = 0.0
    for frame in capture.frames:
        splats = system.splats(frame.pose)
        assert isinstance(splats, Splats) and splats.sh_rotation is not None
        vertices, joints = scene.mesh(frame.pose, *bases), scene.joint_turns(frame.pose)
        for i in range(len(splats.mean)):
            at, b = int(system.triangle[i]), system.barycentric[i].double().numpy()
            height = float(system.table["displacement"][i].detach())
            place = oracle.point(vertices, triangles, at, b, height, scene.FLOOR)
            far = max(far, np.abs(splats.mean[i].detach().numpy() - place).max())
            under = oracle.rotation_under(weights, joints, triangles[at], b)
            own = oracle.rotation_of(system.table["rotation"][i].detach().numpy())
            wanted = under @ own if order == "mesh_first" else own @ under
            given = oracle.rotation_of(splats.quat_wxyz[i].detach().numpy())
            turned = max(
                turned, np.abs(given - wanted).max(), np.abs(splats.sh_rotation[i].numpy() - under).max()
            )
    measured(f"PSAvatar's positions by the paper, {order}, metres", far, 5e-7)
    measured(f"PSAvatar's rotations by the paper, {order}", turned, 2e-6)
    assert far < 5e-7 and turned < 2e-6


def test_gradients_reach_bases_and_offsets_as_differences_say(capture: Capture, measured: Measure) -> None:
    """Through the foot and through the normal, against differences of the paper's formulas in float64."""
    system = scene.as_gaussians(capture, gaussians=12)
    frame, triangles = capture.frames[2], sheet.sheet()
    pose_basis, expression_basis = scene.dense_bases(system)
    aim = np.random.default_rng(0).normal(size=(12, 3))
    height = system.table["displacement"].detach().double().numpy()

    def value(pose_move: Any = 0.0, expression_move: Any = 0.0, rise: Any = 0.0) -> float:
        vertices = scene.mesh(frame.pose, pose_basis + pose_move, expression_basis + expression_move)
        raised = height + rise
        return sum(
            float(aim[i] @ oracle.point(vertices, triangles, int(system.triangle[i]),
                                        system.barycentric[i].double().numpy(), raised[i], scene.FLOOR))
            for i in range(12)
        )  # fmt: skip

    (system.splats(frame.pose).mean * torch.from_numpy(aim.astype(np.float32))).sum().backward()
    grad_bases, grad_height = system.table["bases"].grad, system.table["displacement"].grad
    assert grad_bases is not None and grad_height is not None
    h, worst = 1e-6, 0.0
    for i in range(12):
        rise = np.eye(12)[i] * h
        worst = max(worst, abs(float(grad_height[i]) - (value(rise=rise) - value(rise=-rise)) / (2 * h)))
    steepest = grad_bases.abs().reshape(len(grad_bases), -1).argmax(1)
    checked = 0
    for row, coefficient in enumerate(system.used.tolist()):
        vertex, axis = divmod(int(steepest[row]), 3)
        pose_move, expression_move = np.zeros_like(pose_basis), np.zeros_like(expression_basis)
        if coefficient < scene.TURNS:
            pose_move[vertex, axis, coefficient] = h
        else:
            expression_move[vertex, axis, coefficient - scene.TURNS] = h
        by_differences = (value(pose_move, expression_move) - value(-pose_move, -expression_move)) / (2 * h)
        worst = max(worst, abs(float(grad_bases[row, vertex, axis]) - by_differences))
        checked += abs(by_differences) > 1e-3
    measured("gradient of PSAvatar's bases and offsets against differences", worst)
    assert checked >= 5 and worst < 2e-5


def test_what_no_image_shows_is_removed_and_the_rest_become_gaussians(capture: Capture) -> None:
    system = scene.system_of(capture, off_mesh=0.4, least_visibility=0.05, sh_degree=0)
    trainer = scene.trainer_of(system)
    scene.run(trainer, 1, 2)
    assert system.observed == 2 and (system.visibility > 0.05).any() and system.draws_points
    hidden = 5
    system.visibility[hidden] = 0.0
    kept = len(system.triangle)
    with torch.no_grad():
        system.table["displacement"][hidden] = 3.0  # behind the camera: no image will show it
    marks = system.barycentric[hidden].clone()
    scene.run(trainer, 3, 3)
    assert len(system.triangle) < kept and system.observed == 0 and system.acquiring
    scene.run(trainer, 4, 6)
    assert not system.acquiring
    assert not (system.barycentric == marks).all(1).any()
    assert set(system.table) == {
        "bases", "displacement", "opacity_logit", "sh_dc", "log_scale", "rotation",
    }  # fmt: skip
    splats = system.splats(capture.frames[0].pose)
    assert isinstance(splats, Splats) and len(splats.mean) == len(system.triangle)
    steps = system.table.state()
    assert steps["bases"]["step"] == steps["sh_dc"]["step"] == 6 and steps["rotation"]["step"] == 0
    scene.run(trainer, 7, 12)


def test_the_scale_term_by_hand(capture: Capture) -> None:
    """Eq. 14 in training units, 4 to the metre; a point counts as the Gaussian that takes its place."""
    points = scene.system_of(capture, scale=0.7)
    with torch.no_grad():
        log_radius = points.table["log_radius"]
        log_radius.add_(torch.linspace(-1, 1, len(log_radius)))
        radius = log_radius.exp().double().numpy()
    of_points = scene.trainer_of(points).step(1, scene.read(capture.train[0])).terms["scale"]
    assert float(of_points) == pytest.approx(0.7 * 4 * radius.mean() / np.sqrt(2), rel=1e-5)
    gaussians = scene.as_gaussians(capture, scale=0.7)
    scale = gaussians.table["log_scale"].detach().double().exp().numpy()
    of_gaussians = scene.trainer_of(gaussians).step(1, scene.read(capture.train[0])).terms["scale"]
    wanted = 0.7 * 4 * np.sqrt((scale**2).sum(axis=1)).mean()
    assert float(of_gaussians) == pytest.approx(wanted, rel=1e-5)


def test_a_gaussian_takes_the_place_of_its_point(capture: Capture) -> None:
    """The change of stage hardly changes the image: same centres, opacities, colours, and variance."""
    system = scene.system_of(capture, off_mesh=0.0, gaussians=600, removals=0)
    trainer = scene.trainer_of(system)
    scene.run(trainer, 1, 5)
    before = draw(system, capture.frames[1]).colour
    means = system.splats(capture.frames[1].pose).mean.detach()
    system._become_gaussians()
    after = draw(system, capture.frames[1]).colour
    assert torch.equal(system.splats(capture.frames[1].pose).mean.detach(), means)
    assert float((before - after).abs().mean()) < 0.03
    assert float((before - after).mean().abs()) < 0.015


def test_gaussians_can_acquire_the_shape(capture: Capture) -> None:
    plain = scene.settings()
    system = create(capture, replace(plain, rules={**plain.rules, "acquisition": "gaussians"}), 0)
    assert isinstance(system.splats(capture.frames[0].pose), Splats) and system.acquiring
    trainer = scene.trainer_of(system)
    scene.run(trainer, 1, 6)
    assert not system.acquiring and system.sh_degree == 0
    rate = system.table.learning_rates()["sh_dc"]
    assert rate == system.settings.learning_rates.sh
    scene.run(trainer, 7, 9)
    assert system.sh_degree == 1


@pytest.mark.parametrize("stop", [4, 6, 9], ids=["while acquiring", "at the change", "as Gaussians"])
@pytest.mark.parametrize("enhancer", [False, True])
def test_it_goes_on_bit_by_bit(capture: Capture, stop: int, enhancer: bool) -> None:
    whole = scene.trainer_of(scene.system_of(capture, enhancer=enhancer, enhancing=0.4))
    scene.run(whole, 1, stop)
    kept = copy.deepcopy(whole.state())
    scene.run(whole, stop + 1, 12)
    other = scene.trainer_of(scene.system_of(capture, enhancer=enhancer, enhancing=0.4))
    other.load_state(kept)
    assert_same(other.system.state(), kept["system"])
    scene.run(other, stop + 1, 12)
    assert_same(whole.system.state(), other.system.state())


def test_the_number_of_threads_changes_no_bit(capture: Capture) -> None:
    states = []
    for threads in (1, numba.config.NUMBA_NUM_THREADS):
        with using(threads):
            trainer = scene.trainer_of(scene.system_of(capture))
            scene.run(trainer, 1, 9)
        states.append(trainer.system.state())
    assert_same(*states)


def assert_same(a: Any, b: Any) -> None:
    assert type(a) is type(b)
    if isinstance(a, dict):
        assert a.keys() == b.keys()
        for key in a:
            assert_same(a[key], b[key])
    elif isinstance(a, torch.Tensor):
        assert torch.equal(a, b)
    else:
        assert a == b


def test_training_gets_better(capture: Capture) -> None:
    system = scene.system_of(capture, iterations=60, gaussians=400, off_mesh=0.2, acquiring=0.3, r_max=0.02)
    trainer = scene.trainer_of(system)
    first = evaluate(system, capture)["splits"]["train"]["psnr_db"]
    scene.run(trainer, 1, 60)
    last = evaluate(system, capture)["splits"]["train"]["psnr_db"]
    assert last > first + 3


def test_the_enhancer_is_trained_last_and_measured(capture: Capture, tmp_path: Path) -> None:
    system = scene.system_of(capture, enhancer=True, enhancing=0.25)
    trainer = scene.trainer_of(system)
    scene.run(trainer, 1, 9)
    image = draw(system, capture.frames[3]).colour
    assert system.enhanced(image) is None
    assert "psnr_enhanced_db" not in evaluate(system, capture)["splits"]["test"]
    terms = trainer.step(10, scene.read(trainer.frame(10))).terms
    assert {"l1_enhanced", "dssim_enhanced"} <= terms.keys()
    scene.run(trainer, 11, 12)
    image = draw(system, capture.frames[3]).colour
    better = system.enhanced(image)
    assert better is not None and not torch.equal(better, image)
    result = evaluate(system, capture)
    assert result["splits"]["test"]["psnr_enhanced_db"] == pytest.approx(
        result["frames"][0]["psnr_enhanced_db"]
    )
    system.save(tmp_path, 12)
    assert (tmp_path / "point_cloud" / "iteration_12" / "enhancer.onnx").is_file()


def test_regions_are_those_of_the_body_model(capture: Capture) -> None:
    rig = capture.rig
    upper = rig.vertices[:, 1] > 0.05
    weight = rig.skin.values["weight"].copy()
    column = rig.skin.column.copy()
    row = np.repeat(np.arange(rig.skin.rows), np.diff(rig.skin.row_ptr.astype(int)))
    weight[upper[row]] = 0
    first = np.unique(row, return_index=True)[1]
    weight[first[upper]], column[first[upper]] = 1, 0  # the root carries the upper part
    bound = replace(rig, skin=replace(rig.skin, column=column, values={"weight": weight}))
    assert REGIONS["all"](bound).all()
    head = REGIONS["head"](bound)
    assert (head == ~upper[rig.triangles].any(axis=1)).all() and 0 < head.sum() < len(head)
    listed = replace(bound, anchor_vertices=rig.triangles[:20].reshape(-1))
    face = REGIONS["face"](listed)
    assert not face[:20].any() and face.sum() < head.sum() and (face <= head).all()
    with pytest.raises(AvatarError, match="back of the head"):
        REGIONS["face"](bound)
    found = sample_points(
        bound,
        "head",
        500,
        0.0,
        0.1,
        np.ones(len(bound.triangles)),
        np.ones(len(bound.triangles)),
        np.random.default_rng(1),
    )
    assert head[found.triangle].all()


def test_a_subject_that_never_moves_has_nothing_to_learn_of_it(tmp_path: Path) -> None:
    whole = sheet.blank(tmp_path)
    capture = replace(whole, frames=whole.frames[:1])  # at rest
    system = scene.system_of(capture)
    assert system.table["bases"].shape == (0, len(capture.rig.vertices), 3)
    scene.run(scene.trainer_of(system), 1, 12)
    system.save(tmp_path / "run", 12)


@pytest.mark.parametrize(
    ("values", "what"),
    [
        ({"region": "nose"}, "region is 'nose'"),
        ({"vgg": 0.1}, "vgg needs vgg_weights"),
        ({"off_mesh": 1.5}, "off_mesh is 1.5"),
        ({"acquiring": 1.0}, "acquiring is 1.0"),
        ({"r_max": 1.1}, "r_max is 1.1; at least 0, at most 1"),
        ({"scale": 1e7}, "scale is 1"),
        ({"dssim": 1e300}, "dssim is 1e"),
    ],
)
def test_impossible_settings_are_refused(values: dict[str, Any], what: str) -> None:
    with pytest.raises(ValueError, match=what):
        scene.settings(**values)


def test_impossible_learning_rates_are_refused() -> None:
    with pytest.raises(ValueError, match="opacity_logit is 2000"):
        LearningRates(opacity_logit=2000.0)


def test_without_a_point_left_it_says_so(capture: Capture) -> None:
    system = scene.system_of(capture)
    with pytest.raises(AvatarError, match="lower least_visibility"):
        system.remove(torch.ones(90, dtype=torch.bool))


def test_points_are_no_checkpoint(capture: Capture, tmp_path: Path) -> None:
    with pytest.raises(AvatarError, match="until iteration 6"):
        scene.system_of(capture).save(tmp_path, 3)
    with pytest.raises(AvatarError, match="as_printed"):
        scene.as_gaussians(capture, order="as_printed").save(tmp_path, 3)
