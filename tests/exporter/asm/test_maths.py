"""ASM's formulas against an oracle that walks them one by one, and where they are continued beyond the paper."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from avatar_export.asm import maths
from avatar_export.asm.plane import locate
from tests.asm_faces import small_face
from tests.oracles import asm as oracle


@pytest.mark.parametrize("rule", ["normalised", "softplus"])
def test_weights_are_the_paper_s(rule: str) -> None:
    face = small_face(4, components=3, weight_rule=rule)
    b = face.binding
    expected = oracle.weights(face.template.uv.astype(np.float64), b.zeta, b.pi, b.mu, b.covariance, rule)
    found = maths.mixture_weight_rows(face.template, face.binding, slice(None))
    np.testing.assert_allclose(found, expected, rtol=1e-11, atol=1e-300)
    np.testing.assert_allclose(found.sum(axis=1), 1, rtol=1e-14)
    assert ((found > 1e-9).sum(axis=1) > 2).any()  # or nothing was tested


def test_far_from_every_bone_the_slowest_mixture_has_the_weight() -> None:
    """Densities of e^-20000 and e^-5000 are 0 as doubles; the limit of Eq. 6 is not 0 / 0."""
    face = small_face(spread=1e-3)
    covariance = face.binding.covariance.copy()
    covariance[3] *= 16  # nose_tip falls off four times slower
    found = maths.mixture_weight_rows(
        face.template, replace(face.binding, covariance=covariance), slice(None)
    )
    assert np.isfinite(found).all()
    np.testing.assert_allclose(found.sum(axis=1), 1, rtol=1e-14)
    corner = found[0]  # far from all
    assert corner.argmax() == 3 and corner[3] > 0.999


def test_inside_a_triangle_the_weights_are_equation_10_s() -> None:
    face, rng = small_face(), np.random.default_rng(0)
    uv, triangles = face.template.uv.astype(np.float64), face.template.triangles
    shares, wanted = rng.dirichlet([1, 1, 1], 40), rng.integers(0, len(triangles), 40)
    corners = uv[triangles[wanted]]
    points = np.einsum("pc,pcx->px", shares, corners)
    found, weights = locate(points, uv, triangles)
    np.testing.assert_array_equal(found, wanted)
    np.testing.assert_allclose(weights, shares, atol=1e-13)
    for k in range(40):
        assert oracle.holds(points[k], *corners[k])
        np.testing.assert_allclose(weights[k], oracle.barycentric(points[k], *corners[k]), atol=1e-13)


def test_outside_it_is_the_nearest_point_of_the_nearest_triangle() -> None:
    face, rng = small_face(), np.random.default_rng(1)
    uv, triangles = face.template.uv.astype(np.float64), face.template.triangles
    points = np.concatenate([rng.uniform(1.05, 1.5, (9, 2)), [[0.43, -0.2], [-0.3, 0.61], [0.5, 1.7]]])
    found, weights = locate(points, uv, triangles)
    assert (weights >= 0).all() and np.allclose(weights.sum(axis=1), 1)
    place = np.einsum("pc,pcx->px", weights, uv[triangles[found]])
    np.testing.assert_allclose(place, np.clip(points, 0, 1), atol=1e-14)  # the chart is the unit square
