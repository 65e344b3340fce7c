"""Gaussian Blendshapes as a system: gradients, density control, state, and that training lowers its loss."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch
from torch import Tensor

from avatar_runtime import F32, F64
from avatar_runtime.io.errors import AvatarError
from avatar_trainer.captures.mesh_raster import intrinsics
from avatar_trainer.captures.targets import read
from avatar_trainer.parameters.densify import DensitySettings, Plan
from avatar_trainer.systems.gaussian_blendshapes.density import grow
from avatar_trainer.systems.gaussian_blendshapes.frames import frame_colours
from avatar_trainer.systems.gaussian_blendshapes.rows import FACE, LOWER, UPPER
from avatar_trainer.systems.gaussian_blendshapes.system import GaussianBlendshapes, create
from avatar_trainer.tensors import Splats
from tests.trainer.systems.gaussian_blendshapes.subjects import DENSITY, capture, settings, subject
from tests.trainer.systems.runs import expect_to_go_on, run, trainer_of

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


def test_training_lowers_the_loss_of_one_frame(tmp_path: Path) -> None:
    still = DensitySettings(densify_until=0)
    given = capture(tmp_path)
    one = replace(given, frames=given.frames[:1])
    losses = run(trainer_of(create(one, settings(iterations=60, density=still), 0), 60), 1, 60)
    assert losses[-1] < 0.6 * losses[0]


def test_what_a_frame_hardly_shows_learns_nothing_of_it(tmp_path: Path) -> None:
    given, still = capture(tmp_path), DensitySettings(densify_until=0)
    free, held = (create(given, settings(hidden=share, density=still), 0) for share in (0.0, 0.5))
    before = {name: held.table[name].detach().clone() for name in held.table}
    for system in (free, held):
        run(trainer_of(system), 1, 1)
    gradient = free.table["sh_dc"].grad
    assert gradient is not None
    shown = gradient.abs().sum(dim=(1, 2))
    hidden = shown < 0.5 * shown[shown > 0].mean()
    assert 0 < hidden.sum() < len(hidden)
    of = {"gaussian": hidden, "delta": hidden[held.rows.learned.row()]}
    for name in held.table:
        stays = of[held.table.rows(name)]
        assert torch.equal(held.table[name][stays], before[name][stays])
        assert torch.equal(held.table[name][~stays], free.table[name][~stays])


def test_what_no_frame_shows_begins_as_what_is_beside_it(tmp_path: Path) -> None:
    given = capture(tmp_path)
    one = replace(given, frames=given.train[:1])
    camera, target = one.frames[0].camera, read(one.frames[0])
    y, x = torch.nonzero(target.mask > 0.9)[0].tolist()
    k, view = intrinsics(camera), camera.camera_from_world
    ray = np.array([(x + 0.5 - k[0, 2]) / k[0, 0], (y + 0.5 - k[1, 2]) / k[1, 1], 1.0])
    shown, behind = ((depth * ray - view[:3, 3]) @ view[:3, :3] for depth in (2.0, -2.0))

    def colours(*points: F64) -> F32:
        mean = torch.from_numpy(np.array(points, np.float32))
        rest = [torch.zeros(len(points), *shape) for shape in ((3,), (4,), (), (1, 3))]
        return frame_colours(one, lambda _: Splats(mean, *rest))

    assert np.abs(colours(behind, shown, 2 * behind) - target.image[y, x].numpy()).max() < 1e-6
    assert (colours(behind, 2 * behind) == 0.5).all()


def test_it_goes_on_bit_by_bit(tmp_path: Path) -> None:
    given = capture(tmp_path)
    chosen = settings(density=replace(DENSITY, densify_every=4, gradient_threshold=STEEP))
    ended = expect_to_go_on(lambda: create(given, chosen, 0), stop=6, last=9)
    assert len(ended.state()["rows"]["group"]) > 74


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
