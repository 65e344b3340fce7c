"""PSAvatar while it is trained: where it begins, its formulas and gradients, its two stages, its state."""

from __future__ import annotations

import copy
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch

from avatar_runtime.io.errors import AvatarError
from avatar_trainer.captures.model import Capture
from avatar_trainer.evaluation.evaluate import evaluate
from avatar_trainer.systems.drawing import draw
from avatar_trainer.systems.psavatar.initial import REGIONS
from avatar_trainer.systems.psavatar.system import create
from avatar_trainer.tensors import Splats
from tests.measured import Measure
from tests.oracles import joint_turns as oracle
from tests.trainer.systems.psavatar import scene
from tests.trainer.systems.splatting_avatar import scene as sheet
from tests.trainer.tensors import same


@pytest.fixture(scope="module")
def capture(tmp_path_factory: pytest.TempPathFactory) -> Capture:
    return sheet.taught(tmp_path_factory.mktemp("sheet"))


@pytest.mark.parametrize("order", ["mesh_first", "as_printed"])
def test_gaussians_are_carried_as_the_paper_says(capture: Capture, order: str, measured: Measure) -> None:
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
    assert same(other.system.state(), kept["system"])
    scene.run(other, stop + 1, 12)
    assert same(whole.system.state(), other.system.state())


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


def test_without_a_point_left_it_says_so(capture: Capture) -> None:
    system = scene.system_of(capture)
    with pytest.raises(AvatarError, match="lower least_visibility"):
        system.remove(torch.ones(90, dtype=torch.bool))


def test_points_are_no_checkpoint(capture: Capture, tmp_path: Path) -> None:
    with pytest.raises(AvatarError, match="until iteration 6"):
        scene.system_of(capture).save(tmp_path, 3)
    with pytest.raises(AvatarError, match="as_printed"):
        scene.as_gaussians(capture, order="as_printed").save(tmp_path, 3)


@pytest.mark.parametrize("which", ["off_mesh", "all"])
def test_whose_offset_is_trained(capture: Capture, which: str) -> None:
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
