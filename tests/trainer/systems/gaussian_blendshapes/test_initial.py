"""What Gaussian Blendshapes begins with: the released code's numbers, samples, masks, the mouth, colours."""

from __future__ import annotations

import shutil
from dataclasses import replace
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
import torch

from avatar_runtime.avatar import Rig
from avatar_runtime.rotation import matrix_from_rotvec
from avatar_trainer.captures.load import load
from avatar_trainer.captures.model import Capture
from avatar_trainer.captures.own import Shot, write
from avatar_trainer.settings import rule_defaults
from avatar_trainer.systems.common.poisson import poisson_disk
from avatar_trainer.systems.gaussian_blendshapes.frames import seen_triangles
from avatar_trainer.systems.gaussian_blendshapes.initial import Start, dense, start
from avatar_trainer.systems.gaussian_blendshapes.mesh import (
    Expressions,
    mask_of,
    quaternion_shift,
    triangle_motion,
)
from avatar_trainer.systems.gaussian_blendshapes.mouth import mouth_interior
from avatar_trainer.systems.gaussian_blendshapes.sh import turn_matrices
from avatar_trainer.systems.gaussian_blendshapes.system import RULES, Settings, create
from tests.golden import BlendshapesGolden
from tests.measured import Measure
from tests.oracles import rotation_sh

Array = npt.NDArray[Any]
K = 50


def test_init_terms_are_the_released_codes(
    expressions: Expressions, released: dict[str, Array], measured: Measure
) -> None:
    corners = expressions.triangles[released["triangle"]]
    before = expressions.vertices[corners]
    position = np.einsum("nc,ncx->nx", released["barycentric"], before)
    known = released["point_known"]
    for column in range(K):
        after = before + expressions.offsets[column][corners]
        shift, turn = triangle_motion(before, after, position, "affine")
        far = np.nanmax(np.abs(shift - released["init_xyz"][:, :, column])[known])
        turned = np.nanmax(np.abs(quaternion_shift(turn) - released["init_rot"][:, :, column]))
        measured("gaussian_blendshapes init position against the released code, m", float(far))
        measured("gaussian_blendshapes init quaternion against the released code", float(turned))
        assert far < 2e-7 and turned < 1e-5
    assert known.sum() > 1000 and np.abs(released["init_xyz"]).max() > 5e-3


def test_fields_are_the_released_codes(rig: Rig, released: dict[str, Array]) -> None:
    corner = rig.triangles[released["triangle"]]
    pose = dense(rig.correctives, "position")[corner].sum(axis=1)
    lids = dense(rig.late_morphs, "position")[corner].mean(axis=1)
    assert np.abs(np.moveaxis(pose, 1, 0) - released["pose_blendshape"]).max() < 1e-7
    assert np.abs(np.moveaxis(lids, 1, -1) - released["eye_blendshape"]).max() < 1e-7


def test_masks_are_the_released_codes_but_for_its_grid(
    blendshapes_golden: BlendshapesGolden, rig: Rig, expressions: Expressions, released: dict[str, Array]
) -> None:
    """The released code looks its masks up in a grid of 256^3 over the nearest triangle's, and blurs them so."""
    neck = np.array((blendshapes_golden.body / "neck_exclude_vertex.txt").read_text().split(), np.int64)
    anchors = np.unique(rig.anchor_vertices.astype(np.int64))
    theirs = released["expr_mask_tensor"]
    assert theirs.max() > 7  # no upper limit
    errors, unaligned = [], []
    for column in range(K):
        own = mask_of(expressions.displacement(column, anchors, neck), "fixed")[released["triangle"]]
        errors.append(np.abs(own - theirs[:, column]))
        still = expressions.displacement(column, anchors[:0], neck)
        unaligned.append(np.abs(mask_of(still, "fixed")[released["triangle"]] - theirs[:, column]))
    assert np.mean(errors) < 0.004 and np.median(errors) < 1e-4
    assert np.mean(unaligned) > 10 * np.mean(errors)


def nearest_triangle(points: Array, corners: Array) -> Array:
    """Row of the triangle nearest to each point, by points sampled densely on every one of them."""
    steps = [(i / 6, j / 6) for i in range(7) for j in range(7 - i)]
    on = np.stack(
        [
            corners[:, 0] + u * (corners[:, 1] - corners[:, 0]) + v * (corners[:, 2] - corners[:, 0])
            for u, v in steps
        ]
    )
    best = np.full(len(points), np.inf)
    found = np.zeros(len(points), np.int64)
    for sample in on:
        far = ((points**2).sum(1)[:, None] - 2 * points @ sample.T) + (sample**2).sum(1)
        row = far.argmin(axis=1)
        closer = far[np.arange(len(points)), row] < best
        best = np.where(closer, far[np.arange(len(points)), row], best)
        found = np.where(closer, row, found)
    return found


def test_nearest_triangles_agree_with_a_grid_of_them(rig: Rig, expressions: Expressions) -> None:
    """Section 3.4 looks masks up in a grid, blending eight nodes; a sample's own triangle is that without the blur."""
    generator = np.random.default_rng(2)
    face = np.flatnonzero(~mouth_interior(rig))
    samples = poisson_disk(expressions.vertices, expressions.triangles, face, 24, generator)
    column = int(np.argmax(np.abs(expressions.offsets).sum(axis=(1, 2))))
    mask = mask_of(
        expressions.displacement(column, np.unique(rig.anchor_vertices.astype(np.int64)), face[:0]), "fixed"
    )
    corners = expressions.vertices[expressions.triangles]
    errors = []
    for cell in (0.004, 0.001):
        low = np.floor(samples.position / cell) * cell
        share = (samples.position - low) / cell
        looked_up = np.zeros(len(low))
        for corner in np.ndindex(2, 2, 2):
            node = low + np.array(corner) * cell
            weight = np.prod(np.where(np.array(corner) == 1, share, 1 - share), axis=1)
            looked_up += weight * mask[nearest_triangle(node, corners)]
        errors.append(np.median(np.abs(looked_up - mask[samples.triangle])))
    assert mask[samples.triangle].max() > 0.5 and errors[1] < errors[0] < 0.05 and errors[1] < 0.02


def test_mask_rules() -> None:
    displacement = np.array([0.0, 1e-5, 2.3e-5, 0.004, 0.005703532602638, 0.02])
    fixed, own = mask_of(displacement, "fixed"), mask_of(displacement, "per_blendshape")
    assert fixed[:3].tolist() == [0, 0, 0] and fixed[4] == 1 and fixed[5] > 3.5
    assert own[:2].tolist() == [0, 0] and own[-1] == 1 and own[2] > 0
    assert own[3] == pytest.approx((0.004 - 1e-5) / (0.02 - 1e-5))
    assert (mask_of(np.full(4, 9e-6), "per_blendshape") == 0).all()


@pytest.mark.parametrize("rule", ["affine", "rotation"])
def test_a_triangle_that_only_turns_carries_its_points_rigidly(rule: str) -> None:
    generator = np.random.default_rng(1)
    before = generator.normal(size=(20, 3, 3))
    turn = matrix_from_rotvec(generator.normal(0, 0.5, (20, 3)))
    shift = generator.normal(size=(20, 3))
    after = np.einsum("nij,ncj->nci", turn, before) + shift[:, None]
    point = before.mean(axis=1) + generator.normal(0, 0.1, (20, 3))
    moved, rotation = triangle_motion(before, after, point, rule)
    assert np.abs(point + moved - (np.einsum("nij,nj->ni", turn, point) + shift)).max() < 1e-9
    assert np.abs(rotation - turn).max() < 1e-9


def test_the_papers_rotation_leaves_out_the_stretch() -> None:
    before = np.array([[[0.0, 0, 0], [1, 0, 0], [0, 1, 0]]])
    after = before * np.array([1.2, 1, 1])
    point = np.array([[1.0, 0, 0]])
    assert triangle_motion(before, after, point, "affine")[0] == pytest.approx(np.array([[0.2, 0, 0]]))
    centre_moves = np.array([[0.2 / 3, 0, 0]])
    assert triangle_motion(before, after, point, "rotation")[0] == pytest.approx(centre_moves, abs=1e-6)


def test_a_collapsing_triangle_gives_numbers() -> None:
    before = np.array([[[0.0, 0, 0], [1, 0, 0], [0, 1, 0]]])
    for rule in ("affine", "rotation"):
        shift, rotation = triangle_motion(before, np.zeros((1, 3, 3)), np.array([[0.2, 0.3, 0]]), rule)
        assert np.isfinite(shift).all() and np.isfinite(rotation).all()


def begun(rig: Rig, face: int, mouth: int, **changed: Any) -> Start:
    """Where training of that many Gaussians begins, by the default rules."""
    density = np.where(rig.vertices[rig.triangles].mean(axis=1)[:, 2] > 0, 1.0, 0.1)
    fields: dict[str, Any] = {
        "sh_degree": 2,
        "least_mask": 0.01,
        "neck": np.zeros(0, np.int64),
        "density": density,
    }
    return start(rig, K, face, mouth, rule_defaults(RULES), np.random.default_rng(0), **(fields | changed))


def test_first_values(rig: Rig) -> None:
    made = begun(rig, 500, 40)
    g, rows = made.gaussians, made.rows
    assert g.sh.shape == (580, 9, 3) and rows.group.bincount().tolist() == [500, 40, 40]
    assert torch.equal(g.quat_wxyz, torch.tensor([1.0, 0, 0, 0]).expand(580, 4))
    assert torch.allclose(g.opacity_logit.sigmoid(), torch.tensor(0.1))
    assert torch.equal(g.log_scale[:, 0], g.log_scale[:, 2])
    assert 0.003 < float(g.log_scale[:500].exp().median()) < 0.03
    assert not mouth_interior(rig)[made.triangle.numpy()].any()
    assert (g.mean[:500, 2] > 0).sum() > 400  # a tenth as dense behind


def test_without_a_mouth_all_begin_on_the_face(rig: Rig) -> None:
    made = begun(rig, 500, 0, density=np.ones(len(rig.triangles)))
    assert made.rows.count == 500 and made.cylinder is None
    assert not mouth_interior(rig)[made.triangle.numpy()].any()
    assert abs(int((made.gaussians.mean[:, 2] > 0).sum()) / 500 - 0.6) < 0.15


def test_what_a_gaussian_has_of_its_triangle(rig: Rig) -> None:
    """Weights and places by barycentric weights, correctives by the sum over the corners, eyelids by their mean."""
    made = begun(rig, 300, 20)
    rows, corner = made.rows, rig.triangles[made.triangle.numpy()].astype(np.int64)
    share = made.barycentric.double().numpy()
    expected = {
        "mean": np.einsum("nc,ncx->nx", share, rig.vertices[corner]),
        "skin_weights": np.einsum("nc,ncj->nj", share, dense(rig.skin, "weight")[corner]),
        "corrective": dense(rig.correctives, "position")[corner].sum(axis=1).transpose(1, 0, 2),
        "late": dense(rig.late_morphs, "position")[corner].mean(axis=1).transpose(1, 0, 2),
    }
    found = {
        "mean": made.gaussians.mean[:300],
        "skin_weights": rows.skin_weights[:300],
        "corrective": rows.corrective[:, :300],
        "late": rows.late[:, :300],
    }
    for name, value in expected.items():
        assert np.abs(found[name].numpy() - value).max() < 1e-6 and np.abs(value).max() > 1e-4, name
    assert (
        not rows.skin_weights[300:].any()
        and not rows.corrective[:, 300:].any()
        and not rows.late[:, 300:].any()
    )


def test_entries_by_row_and_column(rig: Rig, expressions: Expressions) -> None:
    made = begun(rig, 300, 20)
    rows, position = made.rows, made.gaussians.mean[:300].double().numpy()
    corner = expressions.triangles[made.triangle.numpy()]
    anchors = np.unique(rig.anchor_vertices.astype(np.int64))
    for entries in (rows.init, rows.learned):
        key = entries.row() * K + entries.column
        assert len(entries.row_ptr) == 341 and (key.diff() > 0).all() and int(entries.row().max()) < 300
    for column in (3, 17, 40):
        own = torch.nonzero(rows.init.column == column)[:, 0]
        row = rows.init.row()[own].numpy()
        moves = (expressions.offsets[column][corner] != 0).any(axis=(1, 2))
        assert np.array_equal(row, np.flatnonzero(moves))
        before = expressions.vertices[corner[row]]
        shift, turn = triangle_motion(
            before, before + expressions.offsets[column][corner[row]], position[row], "affine"
        )
        assert np.abs(rows.init_values[own, :3].numpy() - shift).max(initial=0) < 1e-6
        assert np.abs(rows.init_values[own, 3:].numpy() - quaternion_shift(turn)).max(initial=0) < 1e-6
        mask = mask_of(expressions.displacement(column, anchors, anchors[:0]), "fixed")[made.triangle.numpy()]
        own = torch.nonzero(rows.learned.column == column)[:, 0]
        assert np.array_equal(rows.learned.row()[own].numpy(), np.flatnonzero(mask > 0.01))
        assert np.abs(rows.mask[own].numpy() - mask[mask > 0.01]).max(initial=0) < 1e-6
    assert rows.learned.count < rows.init.count


COLOUR = np.array([200, 100, 50])


@pytest.fixture(scope="module")
def seen_from_the_front(
    blendshapes_golden: BlendshapesGolden, tmp_path_factory: pytest.TempPathFactory
) -> Capture:
    """A capture whose one frame shows the neutral head from the front, all of it of one colour."""
    folder = tmp_path_factory.mktemp("front") / "capture"
    shutil.copytree(blendshapes_golden.body, folder / "body")
    np.save(folder / "body" / "shape.npy", blendshapes_golden.frame(0)["shape"])
    shot = Shot(
        image=np.broadcast_to(COLOUR, (96, 96, 3)).astype(np.uint8),
        mask=np.full((96, 96), 255, np.uint8),
        intrinsics=np.array([[220.0, 0, 48], [0, 220, 48], [0, 0, 1]]),
        rotation=np.diag([1.0, -1, -1]),
        translation=np.array([0, 0, 0.9]),
        expression=np.zeros(1, np.float32),
        joints={},
        eyelids=np.zeros(2, np.float32),
    )
    body = {
        "kind": "body_model",
        "model": "body/body_model.npz",
        "shape": "body/shape.npy",
        "eyelids": "body",
    }
    write(
        folder,
        name="front",
        fps=30,
        head_pose_in="camera",
        expressions=("jawOpen",),
        eyelids=("left", "right"),
        body=body | {"anchor_faces": "body/back_of_head.txt"},
        frames=[("000", shot), ("001", replace(shot, image=255 - shot.image))],
        source="synthetic", license="CC0", author="nobody", consent="none is needed",
    )  # fmt: skip
    found = load(folder)
    return replace(
        found, frames=(replace(found.frames[0], split="train"), replace(found.frames[1], split="test"))
    )


def test_what_the_frames_show(seen_from_the_front: Capture) -> None:
    """What training frames show has their colour, what lies behind has none; held-out frames say nothing."""
    given = seen_from_the_front
    corner = given.rig.vertices[given.rig.triangles]
    normal = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    facing = normal[:, 2] / np.linalg.norm(normal, axis=1)
    in_sight = (facing > 0.8) & (corner[..., 2].min(axis=1) > 0.112)
    behind = (facing < -0.5) & (corner[..., 2].max(axis=1) < -0.05)
    seen = seen_triangles(given)
    assert in_sight.sum() > 100 and seen[in_sight].all() and seen[behind].mean() < 0.05
    assert behind.mean() > 0.02 and 0.2 < seen.mean() < 0.7
    system = create(given, Settings(gaussians=800, mouth_gaussians=50), 0)
    colour = 0.5 + 0.28209479177387814 * system.table["sh_dc"].detach()[:, 0].numpy()
    shown = np.abs(colour - COLOUR / 255).max(axis=1) < 1e-5
    grey = np.abs(colour - 0.5).max(axis=1) < 1e-5
    triangle = system.first.triangle.numpy()
    assert (shown | grey).all()
    assert in_sight[triangle].any() and shown[:800][in_sight[triangle]].all()
    assert behind[triangle].any() and grey[:800][behind[triangle]].mean() > 0.9


def test_turned_sh_are_those_of_the_turned_function() -> None:
    generator = np.random.default_rng(4)
    rotation = matrix_from_rotvec(generator.normal(size=(6, 3)))
    for degree in (0, 1, 2, 3):
        sh = generator.normal(size=(6, (degree + 1) ** 2, 3))
        turns = turn_matrices(torch.from_numpy(rotation), degree).double()
        assert (
            np.abs((turns @ torch.from_numpy(sh)).numpy() - rotation_sh.rotate(sh, rotation, degree)).max()
            < 1e-5
        )
