"""What Gaussian Blendshapes begins with: the released code's numbers, samples, masks, the mouth, colours."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from avatar_runtime.avatar import Rig
from avatar_trainer.systems.gaussian_blendshapes.initial import dense
from avatar_trainer.systems.gaussian_blendshapes.mesh import (
    Expressions,
    mask_of,
    quaternion_shift,
    triangle_motion,
)
from tests.golden import BlendshapesGolden
from tests.measured import Measure

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


def test_mask_rules() -> None:
    displacement = np.array([0.0, 1e-5, 2.3e-5, 0.004, 0.005703532602638, 0.02])
    fixed, own = mask_of(displacement, "fixed"), mask_of(displacement, "per_blendshape")
    assert fixed[:3].tolist() == [0, 0, 0] and fixed[4] == 1 and fixed[5] > 3.5
    assert own[:2].tolist() == [0, 0] and own[-1] == 1 and own[2] > 0
    assert own[3] == pytest.approx((0.004 - 1e-5) / (0.02 - 1e-5))
    assert (mask_of(np.full(4, 9e-6), "per_blendshape") == 0).all()
