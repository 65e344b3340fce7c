"""Gaussian Blendshapes as a system: gradients, density control, state, and that training lowers its loss."""

from __future__ import annotations

import copy
import math
from dataclasses import replace
from pathlib import Path

import numba
import numpy as np
import pytest
import torch
from torch import Tensor

from avatar_runtime.io.errors import AvatarError
from avatar_runtime.rotation import matrix_from_quat
from avatar_trainer.captures.targets import Targets
from avatar_trainer.loop.train import Trainer
from avatar_trainer.losses import dssim_loss
from avatar_trainer.parameters.densify import Density, DensitySettings, Plan
from avatar_trainer.settings import TrainSettings
from avatar_trainer.systems.gaussian_blendshapes.density import grow
from avatar_trainer.systems.gaussian_blendshapes.rows import FACE, LOWER, UPPER
from avatar_trainer.systems.gaussian_blendshapes.settings import Rates
from avatar_trainer.systems.gaussian_blendshapes.system import (
    GaussianBlendshapes,
    create,
)
from avatar_trainer.tensors import Rendered, Splats
from tests.oracles import rotation_sh
from tests.trainer.systems.gaussian_blendshapes.subjects import (
    DENSITY,
    capture,
    of_one_frame,
    settings,
    shaken,
    subject,
)

STEEP = 0.015  # a gradient that half of the Gaussians reach
FIELDS = ("mean", "scale", "quat_wxyz", "opacity", "sh")


@pytest.fixture
def system(tmp_path: Path) -> GaussianBlendshapes:
    return subject(tmp_path)


def probe(splats: Splats, seed: int = 1) -> Tensor:
    """A number that depends on every value of the splats."""
    generator = torch.Generator().manual_seed(seed)
    fields = (getattr(splats, name) for name in FIELDS)
    return torch.stack([(f * torch.randn(f.shape, generator=generator)).sum() for f in fields]).sum()


def steps(system: GaussianBlendshapes, first: int, last: int) -> list[float]:
    """The loss of each iteration from first to last."""
    trainer = Trainer(system, system.capture, TrainSettings(iterations=last, threads=1))
    generator = trainer.generator
    losses = []
    with Targets(64) as targets:
        for iteration in range(first, last + 1):
            generator.manual_seed(iteration)
            step = trainer.step(iteration, targets(trainer.frame(iteration)))
            losses.append(sum(step.terms.values()))
    return losses


def test_every_tensor_gets_a_gradient(system: GaussianBlendshapes) -> None:
    for frame in system.capture.frames:
        probe(system.splats(frame.pose)).backward()
    expected = {"mean", "log_scale", "quat_wxyz", "opacity_logit", "sh_dc", "sh_rest"}
    expected |= {f"delta_{name}" for name in ("mean", "log_scale", "quat_wxyz", "opacity_logit", "sh")}
    assert set(system.table) == expected
    driven = system.rows.learned.column != 1  # exp_001 is 0 in every frame
    for name in system.table:
        gradient = system.table[name].grad
        assert gradient is not None and gradient.isfinite().all()
        reached = (gradient.reshape(len(gradient), -1) != 0).any(dim=1)
        assert torch.equal(reached, driven if name.startswith("delta") else torch.ones_like(reached)), name


@pytest.mark.parametrize("name", ["mean", "quat_wxyz", "delta_mean", "delta_sh", "delta_opacity_logit"])
@pytest.mark.parametrize("rules", [{}, {"consistency": "position"}, {"init_sh": "rotated"}])
def test_gradients_are_the_slope(tmp_path: Path, name: str, rules: dict[str, str]) -> None:
    system = subject(tmp_path, rules)
    pose = system.capture.frames[2].pose
    probe(system.splats(pose)).backward()
    parameter = system.table[name]
    assert parameter.grad is not None
    direction = torch.randn(parameter.shape, generator=torch.Generator().manual_seed(5))
    step, values = 1e-3, []
    with torch.no_grad():
        for sign in (1, -2):
            parameter += sign * step * direction
            values.append(float(probe(system.splats(pose)).double()))
    slope = float((parameter.grad * direction).sum())
    assert slope == pytest.approx((values[0] - values[1]) / (2 * step), rel=5e-2, abs=5e-2)


def test_an_expression_moves_by_its_init_term_and_its_masked_difference(system: GaussianBlendshapes) -> None:
    """Eq. 1 and 2, entry by entry."""
    weights, rows = torch.tensor([0.7, 0.0, -0.4]), system.rows
    base, now = system.base(), system.blended(weights)
    mean, sh = base.mean.detach().double(), base.sh.detach().double()
    for row in range(rows.count):
        for entry in range(*rows.init.row_ptr[row : row + 2].tolist()):
            mean[row] += weights[rows.init.column[entry]] * rows.init_values[entry, :3]
        for entry in range(*rows.learned.row_ptr[row : row + 2].tolist()):
            factor = weights[rows.learned.column[entry]] * rows.mask[entry]
            mean[row] += factor * system.table["delta_mean"].detach()[entry]
            sh[row] += factor * system.table["delta_sh"].detach()[entry]
    assert torch.allclose(now.mean.double(), mean, atol=1e-6)
    assert torch.allclose(now.sh.double(), sh, atol=1e-6)
    assert rows.learned.row_ptr[rows.of(UPPER).start :].eq(rows.learned.count).all()  # none in the mouth


def test_an_expression_turns_the_sh_with_the_triangle(tmp_path: Path) -> None:
    """Rule init_sh = rotated, against the rotation of spherical harmonics by quadrature."""
    system = subject(tmp_path, {"init_sh": "rotated", "deltas": "fixed"})
    sh, init = system.base().sh.detach().numpy(), system.rows.init
    now = system.blended(torch.tensor([0.0, 0.5, 0.0])).sh.detach().numpy()
    own = torch.nonzero(init.column == 1)[:, 0]
    row = init.row()[own].numpy()
    turn = matrix_from_quat(system.rows.init_values[own, 3:].double().numpy() + np.array([1.0, 0, 0, 0]))
    turned = rotation_sh.rotate(sh[row], turn, 1)
    assert np.abs(now[row] - (sh[row] + 0.5 * (turned - sh[row]))).max() < 1e-5
    assert np.abs(turned - sh[row]).max() > 0.03


def test_consistency_says_what_the_mask_scales(tmp_path: Path) -> None:
    scaled: dict[str, set[str]] = {}
    for rule in ("all", "position", "none"):
        system = subject(tmp_path / rule, {"consistency": rule}, supported=0.0)
        own = system.rows.mask
        assert len(own) == (180 if rule != "all" else int((own > 0.01).sum()))
        values, mask = system.learned()
        scaled[rule] = set()
        for name, value in values.items():
            product = value.detach() * mask.reshape(-1, *[1] * (value.dim() - 1))
            factor = own.reshape(-1, *[1] * (value.dim() - 1))
            trained = system.table[f"delta_{name}"].detach()
            assert torch.equal(product, trained * factor) or torch.equal(product, trained)
            scaled[rule] |= {name} if torch.equal(product, trained * factor) else set()
    attributes = {"mean", "log_scale", "quat_wxyz", "opacity_logit", "sh"}
    assert scaled == {"all": attributes, "position": {"mean"}, "none": set()}


def test_fixed_differences_leave_the_init_terms(tmp_path: Path) -> None:
    system = subject(tmp_path, {"deltas": "fixed"})
    assert not [name for name in system.table if name.startswith("delta")]
    base, now = system.base(), system.blended(torch.tensor([1.0, 0.0, 0.0]))
    assert (now.mean != base.mean).any() and torch.equal(now.sh, base.sh)


def test_masks_are_smaller_where_training_shows_little_of_an_expression(tmp_path: Path) -> None:
    plain, scaled = (subject(tmp_path / str(enough), supported=enough) for enough in (0.0, 0.9))
    weights = np.stack([frame.pose.expression_weights for frame in plain.capture.train])
    share = np.minimum(1, np.sqrt((weights.astype(float) ** 2).mean(0)) / 0.9)
    column = plain.rows.learned.column
    assert share.min() < 0.9 and torch.equal(column, scaled.rows.learned.column)
    wanted = plain.rows.mask.numpy() * share[column.numpy()]
    assert scaled.rows.mask.numpy() == pytest.approx(wanted, rel=1e-6, abs=1e-9)


def test_differences_decay_every_tenth_iteration(tmp_path: Path) -> None:
    system = subject(tmp_path, decay=0.01)
    before = {name: system.table[name].detach().clone() for name in system.table}
    generator = torch.Generator()
    for iteration in (1, 7, 9):  # none of them has a plan
        system.after_step(iteration, generator)
    assert all(torch.equal(system.table[name], before[name]) for name in before)
    system.density_settings = DensitySettings(densify_until=0)
    system.after_step(10, generator)
    for name, values in before.items():
        factor = 0.9 if name.startswith("delta_") else 1.0
        assert torch.equal(system.table[name].detach(), values * factor), name


def planned(system: GaussianBlendshapes, clone: list[int], split: list[int], prune: list[int]) -> Plan:
    gone = torch.zeros(system.rows.count, dtype=torch.bool)
    gone[prune] = True
    return Plan(torch.tensor(clone, dtype=torch.int64), torch.tensor(split, dtype=torch.int64), gone)


def splat_rows(system: GaussianBlendshapes, frame: int) -> Tensor:
    splats = system.splats(system.capture.frames[frame].pose)
    return torch.cat([getattr(splats, name).detach().reshape(len(splats.mean), -1) for name in FIELDS], dim=1)


def test_clones_look_like_their_gaussian_in_every_pose(system: GaussianBlendshapes) -> None:
    before = [splat_rows(system, frame) for frame in range(6)]
    clone, prune = [0, 5, 31, 62, 70], [1, 33, 61, 73]
    grown = grow(planned(system, clone, [], prune), system.rows, system.table, torch.Generator())
    system.rows = grown
    face, upper, lower = ([i for i in range(*r) if i not in prune] for r in ((0, 60), (60, 67), (67, 74)))
    came_from = torch.tensor([*face, 0, 5, 31, *upper, 62, *lower, 70])
    assert torch.equal(grown.group, torch.tensor([FACE] * 61 + [UPPER] * 7 + [LOWER] * 7))
    for frame in range(6):
        assert torch.equal(splat_rows(system, frame), before[frame][came_from])
    assert len(system.table["delta_sh"]) == grown.learned.count == int(grown.learned.row_ptr[-1])


def test_new_gaussians_begin_without_moments(system: GaussianBlendshapes) -> None:
    probe(system.splats(system.capture.frames[0].pose)).backward()
    system.table.step()
    before = system.table.state()["delta_mean"]["exp_avg"].clone()
    last = system.rows.learned.row_ptr[60]
    grown = grow(planned(system, [3], [], []), system.rows, system.table, torch.Generator())
    after = system.table.state()["delta_mean"]["exp_avg"]
    assert torch.equal(after[:last], before[:last]) and (before[:last] != 0).any()
    assert grown.learned.row_ptr[61] > last and (after[last : grown.learned.row_ptr[61]] == 0).all()


def test_parts_of_a_split_gaussian_share_its_place_and_size(system: GaussianBlendshapes) -> None:
    scale, turned = torch.tensor([0.03, 0.01, 0.002]), torch.tensor([1.0, 2.0, -0.5, 0.7])  # not a unit one
    with torch.no_grad():
        system.table["log_scale"][4], system.table["quat_wxyz"][4] = scale.log(), turned
    mean, rows = system.table["mean"].detach()[4].clone(), system.rows
    state = copy.deepcopy(system.table.state())
    own = int(rows.learned.row_ptr[5] - rows.learned.row_ptr[4])
    generator, offsets = torch.Generator().manual_seed(0), []
    for _ in range(200):
        system.table.load_state(state)
        grown = grow(planned(system, [], [4], []), rows, system.table, generator)
        offsets.append(system.table["mean"].detach()[59:61] - mean)
    assert torch.allclose(system.table["log_scale"].detach()[59:61].exp(), scale / 1.6)
    assert grown.count == rows.count + 1 and grown.learned.count == rows.learned.count + own
    axes = matrix_from_quat((turned / turned.norm()).double().numpy())
    spread = torch.cat(offsets).double().numpy() @ axes / scale.numpy()
    assert np.abs(np.cov(spread.T) - np.eye(3)).max() < 0.2 and np.abs(spread.mean(0)).max() < 0.2


def test_training_lowers_the_loss_of_one_frame(tmp_path: Path) -> None:
    still = DensitySettings(densify_until=0)
    system = create(of_one_frame(capture(tmp_path)), settings(iterations=60, density=still), 0)
    losses = steps(system, 1, 60)
    assert losses[-1] < 0.6 * losses[0]


def test_density_control_in_the_loop(tmp_path: Path) -> None:
    system = create(capture(tmp_path), settings(), 0)
    before = system.rows.count
    steps(system, 1, 9)
    assert system.rows.count > before
    assert len(system.density.seen) == system.rows.count == len(system.table["mean"])
    assert system.density.seen.any() and system.density.gradient_sum.any()
    steps(system, 10, 10)  # ends with a plan
    for statistic in system.density.state().values():
        assert len(statistic) == system.rows.count and not statistic.any()


@pytest.mark.parametrize("resets", [True, False])
def test_large_gaussians_go_after_the_first_opacity_reset(tmp_path: Path, resets: bool) -> None:
    density = replace(DENSITY, opacity_reset_every=5, gradient_threshold=1e9, max_screen_radius=6)
    system = create(capture(tmp_path), settings(opacity_resets=resets, density=density, extent=2.0), 0)
    with torch.no_grad():
        system.table["log_scale"][:] = math.log(0.19)  # of 0.1 extents
        system.table["log_scale"][3, 0] = math.log(0.21)
    left = []
    for iteration in (4, 6):
        system.density.largest_radius[:] = 6
        system.density.largest_radius[9] = 7
        system.after_step(iteration, torch.Generator())
        left.append(system.rows.count)
    assert left == [74, 72 if resets else 74]
    if resets:
        assert float(system.table["log_scale"].detach().exp().max()) == pytest.approx(0.19)


def test_a_plan_that_leaves_none_is_refused(system: GaussianBlendshapes) -> None:
    plan = planned(system, [], [], list(range(system.rows.count)))
    with pytest.raises(AvatarError, match=r"no Gaussian is left: .*lower density\.min_opacity"):
        grow(plan, system.rows, system.table, torch.Generator())


def test_a_mouth_of_which_none_is_left_has_no_term(system: GaussianBlendshapes) -> None:
    plan = planned(system, [], [], list(range(60, 74)))
    system.rows = grow(plan, system.rows, system.table, torch.Generator())
    drawn = Rendered(torch.zeros(12, 12, 3), torch.zeros(12, 12), torch.zeros(60, dtype=torch.int32))
    terms = system.losses(drawn, drawn.colour, drawn.alpha, 1)
    assert set(terms) == {"l1", "dssim", "alpha"} and all(term.isfinite() for term in terms.values())


def test_going_on_from_a_state_is_bit_for_bit(tmp_path: Path) -> None:
    """Stopped between plans: what was seen before the stop decides the plan after it."""
    given, chosen = (
        capture(tmp_path),
        settings(density=replace(DENSITY, densify_every=4, gradient_threshold=STEEP)),
    )
    whole, first = create(given, chosen, 0), create(given, chosen, 0)
    steps(whole, 1, 9)
    steps(first, 1, 6)
    torch.save(first.state(), tmp_path / "state.pt")
    state = torch.load(tmp_path / "state.pt", weights_only=True)
    ends = []
    for density in (state["density"], Density(first.rows.count).state()):
        ends.append(create(given, chosen, 0))
        ends[-1].load_state({**state, "density": density})
        steps(ends[-1], 7, 9)
    other, forgotten = ends
    assert torch.equal(splat_rows(other, 1), splat_rows(whole, 1))
    for name in whole.table:
        assert torch.equal(other.table[name], whole.table[name])
    assert other.sh_degree == whole.sh_degree
    assert (
        first.rows.count > 74 and forgotten.rows.count != whole.rows.count
    )  # the plan of iteration 8 was another


def test_same_seed_same_bits_whatever_the_threads(tmp_path: Path) -> None:
    given = capture(tmp_path)
    threads, found = numba.get_num_threads(), []
    try:
        for count in (1, threads):
            numba.set_num_threads(count)
            found.append(create(given, settings(colours="frames", unseen=0.5), 4))
    finally:
        numba.set_num_threads(threads)
    found.append(create(given, settings(colours="frames", unseen=0.5), 5))
    a, b, c = (splat_rows(shaken(system), 0) for system in found)
    assert torch.equal(a, b) and not torch.equal(a, c)


def test_positions_slow_down(tmp_path: Path) -> None:
    system = create(capture(tmp_path), settings(rates=Rates(mean=1e-3, mean_final=1e-5), extent=2.0), 0)
    rates = []
    for iteration in (1, 10, 20):
        system.before_step(iteration)
        rates.append(system.table.learning_rates()["mean"])
    assert rates == pytest.approx([2e-3 * 10 ** (-2 / 20), 2e-4, 2e-5])
    found = system.table.learning_rates()
    assert found["delta_mean"] == pytest.approx(2 * Rates().delta_mean)
    assert found["delta_log_scale"] == Rates().delta_log_scale


def test_opacities_are_reset_and_degrees_come_one_by_one(tmp_path: Path) -> None:
    density = DensitySettings(densify_until=100, opacity_reset_every=7)
    system = create(capture(tmp_path), settings(opacity_resets=True, density=density), 0)
    probe(system.splats(system.capture.frames[0].pose)).backward()
    system.table.step()
    with torch.no_grad():
        system.table["opacity_logit"][0] = -9
    degrees = []
    for iteration in range(1, 8):
        system.after_step(iteration, torch.Generator())
        degrees.append(system.sh_degree)
    opacity = system.table["opacity_logit"].detach().sigmoid()
    assert float(opacity.max()) == pytest.approx(0.01) and float(opacity[0]) < 1e-3
    assert degrees == [0, 0, 1, 1, 1, 1, 1]
    for moment in ("exp_avg", "exp_avg_sq"):
        assert not system.table.state()["opacity_logit"][moment].any()
        assert system.table.state()["mean"][moment].any()


def test_loss_terms(system: GaussianBlendshapes) -> None:
    """Against the formulas, on an image of one colour."""
    drawn = Rendered(
        torch.full((16, 16, 3), 0.5), torch.full((16, 16), 0.75), torch.zeros(74, dtype=torch.int32)
    )
    with torch.no_grad():
        terms = system.losses(drawn, torch.full((16, 16, 3), 0.25), torch.ones(16, 16), 1)
    assert float(terms["l1"]) == pytest.approx(0.8 * 0.25)
    assert float(terms["alpha"]) == pytest.approx(10 * 0.25**2)
    dssim = float(dssim_loss(drawn.colour, torch.full((16, 16, 3), 0.25)))
    assert dssim > 0.15 and float(terms["dssim"]) == pytest.approx(0.2 * dssim)
    for x, y, expected in ((0.1 + 0.2 + 0.03, -0.05, 100 * 0.03**2), (0.1, -0.05 + 0.1 - 0.001, 0.0)):
        with torch.no_grad():
            system.table["mean"][60:] = torch.tensor([x, y, 0.02])
            same = system.losses(drawn, drawn.colour, drawn.alpha, 1)
        assert float(same["mouth"]) == pytest.approx(expected, rel=1e-3)
        assert float(same["l1"]) == float(same["alpha"]) == 0 and float(same["dssim"]) < 1e-6


def test_without_a_mouth(tmp_path: Path) -> None:
    system = subject(tmp_path, {"mouth": "off"})
    assert system.rows.count == 60 and (system.rows.group == FACE).all()
    drawn = Rendered(torch.zeros(12, 12, 3), torch.zeros(12, 12), torch.zeros(60, dtype=torch.int32))
    assert "mouth" not in system.losses(drawn, drawn.colour, drawn.alpha, 1)


def test_body_models_of_other_systems_are_refused(tmp_path: Path) -> None:
    given = capture(tmp_path)
    rig = given.rig
    other = type(rig)(**{**vars(rig), "joint_names": ("a", "b", "c", "d", "e")})
    with pytest.raises(AvatarError, match=r"joints a, b, c.*root, neck, jaw"):
        create(type(given)(**{**vars(given), "rig": other}), settings(), 0)
    bare = type(rig)(**{**vars(rig), "anchor_vertices": np.zeros(0, np.uint32)})
    with pytest.raises(AvatarError, match="anchor faces"):
        create(type(given)(**{**vars(given), "rig": bare}), settings(), 0)
    assert create(type(given)(**{**vars(given), "rig": bare}), settings({"mouth": "off"}), 0).rows.count == 60
