"""SplattingAvatar while it is trained: its start, its gradients, what follows a step, density control, its state."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
import torch

from avatar_runtime.avatar import RasterSettings
from avatar_runtime.io.errors import AvatarError
from avatar_trainer.captures.model import Capture
from avatar_trainer.loop import checkpoint
from avatar_trainer.losses import dssim_loss
from avatar_trainer.parameters.densify import Density, DensitySettings
from avatar_trainer.raster.renderer import render
from avatar_trainer.systems.splatting_avatar.settings import PAPER_ITERATIONS, scheduled
from avatar_trainer.systems.splatting_avatar.system import Settings, SplattingAvatar, create
from avatar_trainer.tensors import Rendered
from tests.measured import Measure
from tests.oracles.surface_rule import splatting_avatar as one_gaussian
from tests.trainer.systems.splatting_avatar import scene
from tests.trainer.systems.splatting_avatar.scene import decoded, step, system_of

Array = npt.NDArray[Any]
GENERATOR = 3
STEEP = 1.5e-3  # a gradient that half of the Gaussians reach


def test_it_begins_on_the_first_frames_mesh(capture: Capture) -> None:
    system = system_of(capture)
    splats = system.splats(capture.frames[0].pose)
    on_mesh = np.einsum(
        "nc,ncx->nx",
        system.embedding.barycentric.numpy(),
        (scene.body()["v_template"])[scene.sheet()[system.embedding.triangle.numpy()]],
    )
    np.testing.assert_allclose(splats.mean.detach().numpy(), on_mesh, atol=2e-6)  # frame 0 is at rest
    assert system.training_per_bundle == 4.0  # low as a head
    assert splats.opacity.detach().numpy() == pytest.approx(0.1)
    written = np.array([[float(f"{x:.6f}") for x in row] for row in system.canonical_vertices.astype(float)])
    np.testing.assert_array_equal(system.canonical_vertices, written.astype(np.float32))
    image, mask = decoded(capture.frames[0])
    shown = image[mask > 0.9].mean(0)
    assert torch.allclose(0.5 + 0.2820948 * system.table["sh_dc"][:, 0].mean(0), shown, atol=0.1)


def test_scales_are_those_of_the_nearest_others(capture: Capture) -> None:
    system = system_of(capture)
    point = 4 * system.splats(capture.frames[0].pose).mean.detach().numpy().astype(float)
    apart = np.linalg.norm(point[:, None] - point, axis=2)
    nearest = np.sort(apart, axis=1)[:, 1:4]
    expected = np.sqrt((nearest**2).mean(axis=1))
    np.testing.assert_allclose(system.table["log_scale"][:, 0].detach().exp(), expected, rtol=1e-5)


@pytest.mark.parametrize("paper", [False, True], ids=["released", "paper"])
def test_uv_moves_position_and_rotation_as_differences_say(
    capture: Capture, paper: bool, measured: Measure
) -> None:
    """Gradients of (u, v) and d through position, normal and rotation, against differences of the rule itself."""
    rules = {"position": "interpolated_normal", "rotation": "vertex_quaternion_mean", "scale": "linear_area"}
    system = system_of(capture, gaussians=6, **(rules if paper else {}))
    scene.scatter(system, 1)
    frame = capture.frames[2]
    posed = 4.0 * system.meshes[frame.pose].vertices.double().numpy()
    aim = np.random.default_rng(0).normal(size=(6, 7))

    def by_rule(row: int, uv: Array, d: float) -> float:
        mean, quat, _ = one_gaussian(
            system.canonical_vertices.astype(float), posed, system.triangles, int(system.embedding.triangle[row]),
            np.array([uv[0], uv[1], 1 - uv.sum()]), d, system.table["rotation"][row].detach().double().numpy(),
            np.zeros(3), frozenset(("position", "rotation", "scale")) if paper else frozenset(),
        )  # fmt: skip
        return float(aim[row, :3] @ mean / 4 + aim[row, 3:] @ quat)

    splats = system.splats(frame.pose)
    given = torch.cat([splats.mean, splats.quat_wxyz], dim=1)
    (given * torch.from_numpy(aim.astype(np.float32))).sum().backward()
    uv = system.embedding.barycentric[:, :2].double().numpy()
    displaced = system.table["displacement"].detach().double().numpy()
    size, h = system.embedding.size[system.embedding.triangle].double().numpy(), 1e-5
    worst = 0.0
    for row in range(6):
        differences = [
            (by_rule(row, uv[row] + move, displaced[row]) - by_rule(row, uv[row] - move, displaced[row]))
            / (2 * h)
            for move in (np.array([h, 0]), np.array([0, h]))
        ]
        along = (by_rule(row, uv[row], displaced[row] + h) - by_rule(row, uv[row], displaced[row] - h)) / (
            2 * h
        )
        shift, raised = system.table["shift_uv"].grad, system.table["displacement"].grad
        assert shift is not None and raised is not None
        apart = np.abs(shift[row].double().numpy() * size[row] - differences).max()
        worst = max(worst, apart, abs(float(raised[row]) - along))
    measured("gradient of (u, v, d) against differences", worst, 1e-6)
    assert worst < 1e-6
    assert shift.abs().max() > 1e-3


def test_a_gaussian_in_the_wrong_place_walks_to_the_right_one(tmp_path: Path) -> None:
    """One blob of colour; a Gaussian that begins 5 triangles away goes there, over every edge between."""
    results = {}
    for rule in ("walking", "clamped"):
        capture = scene.blank(tmp_path / rule, frames=2)
        goal = blob(capture, rule, column=5)
        frame = capture.frames[0]
        wanted = drawn(goal, frame).detach()
        system = blob(capture, rule, column=2)
        first = float((drawn(system, frame) - wanted).square().mean().detach())
        for iteration in range(1, 201):
            system.before_step(iteration)
            loss = (drawn(system, frame) - wanted).square().mean()
            system.table.zero_grad()
            loss.backward()
            system.table.step()
            system.after_step(iteration, torch.Generator())
        results[rule] = (system, float(loss.detach()) / first, goal)
    walked, left, goal = results["walking"]
    assert left < 1e-3
    assert walked.crossings >= 5
    apart = walked.splats(frame.pose).mean - goal.splats(frame.pose).mean
    assert float(apart.detach().norm()) < 2e-3
    clamped, left, _ = results["clamped"]
    assert left > 0.3
    assert clamped.crossings == 0


def blob(capture: Capture, rule: str, column: int) -> SplattingAvatar:
    """One large Gaussian in the middle of a triangle; only its place is trained."""
    system = system_of(capture, gaussians=1, embedding=rule, init_colour="grey")
    rates = replace(system.settings.learning_rates, position=2e-2, position_final=2e-3)
    rates = replace(rates, rotation=0.0, log_scale=0.0, opacity_logit=0.0, sh=0.0)
    system = system_of(capture, gaussians=1, embedding=rule, init_colour="grey", learning_rates=rates)
    system.embedding.triangle[0] = 4 * (scene.SIDE - 1) + column
    system.embedding.barycentric[0] = 1 / 3
    with torch.no_grad():
        system.table["log_scale"].fill_(math.log(0.12))
        system.table["opacity_logit"].fill_(2.0)
        system.table["sh_dc"].fill_(1.5)
    return system


def drawn(system: SplattingAvatar, frame: Any) -> torch.Tensor:
    splats = system.splats(frame.pose)
    return render(splats, frame.camera, RasterSettings(near=0.05), 0, torch.zeros(3)).colour


def test_opacities_are_reset_and_sh_degrees_rise_when_due(capture: Capture) -> None:
    density = DensitySettings(densify_from=10**6, densify_until=10**7, opacity_reset_every=3000)
    system = system_of(
        capture, sh_degree=2, sh_degree_every=500, iterations=PAPER_ITERATIONS, density=density
    )
    generator = torch.Generator().manual_seed(GENERATOR)
    step(system, 1, generator)
    system.table["opacity_logit"].data.fill_(3.0)
    system.after_step(2999, generator)
    assert (system.table["opacity_logit"] == 3.0).all()
    assert system.sh_degree == 2
    system.after_step(3000, generator)
    assert torch.allclose(system.table["opacity_logit"].sigmoid(), torch.tensor(0.01))
    for moment in ("exp_avg", "exp_avg_sq"):
        assert not system.table.state()["opacity_logit"][moment].any()
        assert system.table.state()["sh_dc"][moment].any()
    system.after_step(999, generator)
    assert system.sh_degree == 1


def test_the_schedule_shrinks_with_the_run() -> None:
    paper = scheduled(Settings(iterations=PAPER_ITERATIONS))
    assert (paper.densify_from, paper.densify_until, paper.opacity_reset_every) == (600, 15_000, 3000)
    short = scheduled(Settings(iterations=3000))
    assert (short.densify_from, short.densify_until, short.densify_every) == (60, 1500, 100)
    assert short.opacity_reset_every == 1000  # never closer
    fast = Settings(iterations=1000)
    assert fast.rules["embedding"] == "walking"
    with pytest.raises(ValueError, match="subject"):
        Settings(subject="cat")
    with pytest.raises(ValueError, match="sampling"):
        Settings(sampling="even")


def test_the_embeddings_learning_rate_falls_and_others_stay(capture: Capture) -> None:
    system = system_of(capture, iterations=1000)
    first = system.table.learning_rates()
    system.before_step(500)
    half = system.table.learning_rates()
    system.before_step(1000)
    last = system.table.learning_rates()
    assert half["shift_uv"] == pytest.approx(first["shift_uv"] / 10)
    assert last["displacement"] == pytest.approx(first["displacement"] / 100)
    assert {name for name in first if last[name] != first[name]} == {"shift_uv", "displacement"}


def test_it_learns_the_images(capture: Capture) -> None:
    """A hundred steps on three small frames, with splits, clones and walks."""
    density = DensitySettings(densify_from=600, densify_every=20, gradient_threshold=1e-4)
    system = system_of(capture, iterations=120, density=density)
    generator = torch.Generator().manual_seed(GENERATOR)
    psnr = [step(system, iteration, generator) for iteration in range(1, 121)]
    assert np.mean(psnr[-6:]) > np.mean(psnr[:3]) + 6
    assert np.mean(psnr[-6:]) > 24
    assert system.crossings > 0
    assert len(system.density.seen) > 150


@pytest.mark.parametrize("rule", ["walking", "fixed"])
def test_it_goes_on_from_a_checkpoint_bit_by_bit(capture: Capture, rule: str, tmp_path: Path) -> None:
    """Stopped between plans: what was seen before the stop decides the plan after it."""
    density = DensitySettings(densify_from=0, densify_every=4, gradient_threshold=STEEP)

    def fresh() -> SplattingAvatar:
        return system_of(capture, embedding=rule, density=density, iterations=30)

    first, generator = fresh(), torch.Generator().manual_seed(GENERATOR)
    for iteration in range(1, 11):
        step(first, iteration, generator)
    checkpoint.write(tmp_path, 10, {"system": first.state(), "generator": generator.get_state()})
    found = checkpoint.newest(tmp_path, print)
    assert found is not None
    forgotten = {**found.state["system"], "density": Density(len(first.density.seen)).state()}
    ends = []
    for state in (found.state["system"], forgotten):
        system, other = fresh(), torch.Generator()
        system.load_state(state)
        other.set_state(found.state["generator"])
        for iteration in range(11, 14):
            step(system, iteration, other)
        ends.append(system)
    for iteration in range(11, 14):
        step(first, iteration, generator)
    assert len(first.density.seen) != 150
    assert_equal(first.state(), ends[0].state())
    assert len(ends[1].density.seen) != len(first.density.seen)  # the plan of iteration 12 was another


def assert_equal(a: Any, b: Any) -> None:
    assert type(a) is type(b)
    if isinstance(a, dict):
        assert a.keys() == b.keys()
        for key in a:
            assert_equal(a[key], b[key])
    elif isinstance(a, torch.Tensor):
        assert torch.equal(a, b)
    else:
        assert a == b


def test_the_same_seed_begins_the_same(capture: Capture) -> None:
    assert_equal(system_of(capture).state(), system_of(capture).state())
    other = create(capture, scene.settings(), 1)
    assert not torch.equal(other.embedding.triangle, system_of(capture).embedding.triangle)


def test_scaling_term_is_that_of_needles(capture: Capture) -> None:
    system = system_of(capture)
    system.table["log_scale"].data.fill_(math.log(0.001))
    system.table["log_scale"].data[0] = torch.tensor([0.05, 0.004, 0.004]).log()  # long and thin
    system.table["log_scale"].data[1] = torch.tensor([0.05, 0.006, 0.006]).log()  # long, not thin
    system.table["log_scale"].data[2] = torch.tensor([0.007, 0.0001, 0.0001]).log()  # thin, not long
    rendered = type("Rendered", (), {"colour": torch.zeros(12, 12, 3)})()
    terms = system.losses(rendered, torch.zeros(12, 12, 3), torch.zeros(12, 12), 1)
    assert float(terms["scaling"].detach()) == pytest.approx(0.05 / 150)
    assert set(terms) == {"l1", "dssim", "scaling"}


def test_terms_of_the_image_are_weighted(capture: Capture) -> None:
    drawn, wanted = torch.rand(2, 12, 12, 3, generator=torch.Generator().manual_seed(GENERATOR))
    terms = system_of(capture).losses(
        Rendered(drawn, drawn[..., 0], torch.zeros(150, dtype=torch.int32)), wanted, torch.ones(12, 12), 1
    )
    dssim = float(dssim_loss(drawn, wanted))
    assert dssim > 0.5 and float(terms["dssim"]) == pytest.approx(0.2 * dssim)
    assert float(terms["l1"]) == pytest.approx(float((drawn - wanted).abs().mean()))


def test_the_background_is_of_random_colours(capture: Capture) -> None:
    system, generator = system_of(capture), torch.Generator().manual_seed(GENERATOR)
    drawn = torch.stack([system.background(generator) for _ in range(200)])
    assert drawn.shape == (200, 3) and len(drawn.unique()) == 600
    assert drawn.min() >= 0 and drawn.max() <= 1 and (drawn.mean(0) - 0.5).abs().max() < 0.1
    assert torch.equal(drawn[0], system.background(torch.Generator().manual_seed(GENERATOR)))


def test_first_colours_are_not_from_frames_held_out(capture: Capture) -> None:
    assert capture.test
    trained_on = system_of(replace(capture, frames=tuple(capture.train)))
    assert torch.equal(system_of(capture).table["sh_dc"], trained_on.table["sh_dc"])
    assert len(trained_on.table["sh_dc"].unique(dim=0)) > 50  # they are from frames


def test_captures_that_it_cannot_train_on_are_refused(capture: Capture) -> None:
    tests = tuple(replace(frame, split="test") for frame in capture.frames)
    with pytest.raises(AvatarError, match="no training frame"):
        create(replace(capture, frames=tests), scene.settings(), 0)
    pose = replace(capture.frames[0].pose, late_weights=np.ones(1, np.float32))
    lids = replace(
        capture,
        frames=(replace(capture.frames[0], pose=pose), *capture.frames[1:]),
        eyelids=("left",),
    )
    with pytest.raises(AvatarError, match="eyelid"):
        create(lids, scene.settings(), 0)
