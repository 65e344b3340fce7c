"""ASM's formulas against an oracle that walks them one by one, and where they are continued beyond the paper."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from avatar_export.asm import maths
from avatar_export.asm.model import AsmFace
from avatar_export.asm.plane import locate
from tests.asm_faces import small_face
from tests.measured import Measure
from tests.oracles import asm as oracle

HEIGHT = 0.25  # metres, of the small face


def faces() -> dict[str, AsmFace]:
    return {
        "plain": small_face(turned=False),
        "turned": small_face(1, components=5),
        "stretched": small_face(2, stretched=True, components=1),
        "softplus": small_face(3, weight_rule="softplus"),
    }


@pytest.mark.parametrize("name", faces())
def test_posed_is_the_paper_s(name: str, measured: Measure) -> None:
    face = faces()[name]
    for take in face.takes:
        for frame in {0, len(take.scale) - 1}:
            off = np.abs(maths.posed(face, take, frame) - oracle.posed_face(face, take, frame)).max()
            measured("ASM by its formulas against the oracle, of height", float(off) / HEIGHT)
            assert off <= 1e-14


@pytest.mark.parametrize("rule", ["normalised", "softplus"])
def test_weights_are_the_paper_s(rule: str) -> None:
    face = small_face(4, components=3, weight_rule=rule)
    b = face.binding
    expected = oracle.weights(face.template.uv.astype(np.float64), b.zeta, b.pi, b.mu, b.covariance, rule)
    found = maths.mixture_weights(face.template, face.binding)
    np.testing.assert_allclose(found, expected, rtol=1e-11, atol=1e-300)
    np.testing.assert_allclose(found.sum(axis=1), 1, rtol=1e-14)
    assert ((found > 1e-9).sum(axis=1) > 2).any()  # or nothing was tested


def test_blocks_of_vertices_change_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    face = small_face(4)
    whole = maths.mixture_weights(face.template, face.binding)
    posed = maths.posed(face, face.takes[1])
    monkeypatch.setattr(maths, "ROWS", 7)
    np.testing.assert_array_equal(maths.mixture_weights(face.template, face.binding), whole)
    np.testing.assert_allclose(maths.posed(face, face.takes[1]), posed, rtol=0, atol=1e-16)


def test_far_from_every_bone_the_slowest_mixture_has_the_weight() -> None:
    """Densities of e^-20000 and e^-5000 are 0 as doubles; the limit of Eq. 6 is not 0 / 0."""
    face = small_face(spread=1e-3)
    covariance = face.binding.covariance.copy()
    covariance[3] *= 16  # nose_tip falls off four times slower
    found = maths.mixture_weights(face.template, replace(face.binding, covariance=covariance))
    assert np.isfinite(found).all()
    np.testing.assert_allclose(found.sum(axis=1), 1, rtol=1e-14)
    corner = found[0]  # far from all
    assert corner.argmax() == 3 and corner[3] > 0.999


def test_a_mixture_weight_of_0_is_no_gaussian() -> None:
    face = small_face(components=2)
    pi = np.tile([1.0, 0.0], (len(face.binding.pi), 1))
    one = replace(
        face.binding,
        pi=np.ones((len(pi), 1)),
        mu=face.binding.mu[:, :1],
        covariance=face.binding.covariance[:, :1],
    )
    np.testing.assert_allclose(
        maths.mixture_weights(face.template, replace(face.binding, pi=pi)),
        maths.mixture_weights(face.template, one),
        rtol=1e-14,
    )


def test_softplus_of_huge_densities_is_a_number() -> None:
    face = small_face(weight_rule="softplus")
    b = replace(face.binding, zeta=face.template.uv[face.template.anchor_vertex].astype(np.float64))
    b = replace(b, mu=np.zeros_like(b.mu), covariance=np.tile([1e-150, 0, 1e-150], (*b.pi.shape, 1)))
    found = maths.mixture_weights(face.template, b)
    np.testing.assert_allclose(found.sum(axis=1), 1, rtol=1e-12)


def test_zeta_at_its_anchor_leaves_the_bone_where_it_was_placed() -> None:
    face = small_face()
    at_anchor = replace(face.binding, zeta=face.template.uv[face.template.anchor_vertex].astype(np.float64))
    np.testing.assert_allclose(
        maths.bone_positions(face.template, at_anchor), face.template.rest_position, rtol=0, atol=1e-15
    )


def corners(uv: Any, triangles: Any, triangle: int) -> Any:
    return uv[triangles[triangle]].astype(np.float64)


def test_inside_a_triangle_the_weights_are_equation_10_s() -> None:
    face, rng = small_face(), np.random.default_rng(0)
    uv, triangles = face.template.uv, face.template.triangles
    shares = rng.dirichlet([1, 1, 1], 40)
    wanted = rng.integers(0, len(triangles), 40)
    points = np.einsum("pc,pcx->px", shares, uv.astype(np.float64)[triangles[wanted]])
    found, weights = locate(points, uv.astype(np.float64), triangles)
    np.testing.assert_array_equal(found, wanted)
    np.testing.assert_allclose(weights, shares, atol=1e-13)
    for k in range(40):
        assert oracle.holds(points[k], *corners(uv, triangles, wanted[k]))
        np.testing.assert_allclose(
            weights[k], oracle.barycentric(points[k], *corners(uv, triangles, wanted[k])), atol=1e-13
        )


def test_outside_it_is_the_nearest_point_of_the_nearest_triangle() -> None:
    face, rng = small_face(), np.random.default_rng(1)
    uv, triangles = face.template.uv.astype(np.float64), face.template.triangles
    points = np.concatenate([rng.uniform(1.05, 1.5, (9, 2)), [[0.43, -0.2], [-0.3, 0.61], [0.5, 1.7]]])
    found, weights = locate(points, uv, triangles)
    assert (weights >= 0).all() and np.allclose(weights.sum(axis=1), 1)
    place = np.einsum("pc,pcx->px", weights, uv[triangles[found]])
    np.testing.assert_allclose(place, np.clip(points, 0, 1), atol=1e-14)  # the chart is the unit square


def test_of_triangles_as_near_it_is_the_first_and_slivers_are_lines() -> None:
    uv = np.array([[0, 0], [1, 0], [0, 1], [1, 1], [2, 0], [3, 0]], np.float64)
    triangles = np.array([[0, 1, 4], [0, 1, 2], [1, 3, 2], [5, 5, 5]], np.uint32)
    points = np.array([[0.5, 0.5], [0.5, 0.0], [2.9, 0.3], [0.2, 0.3]])
    found, weights = locate(points, uv, triangles)
    assert found.tolist() == [1, 0, 3, 1]  # a shared edge; a line's own point; a point's; inside
    place = np.einsum("pc,pcx->px", weights, uv[triangles[found]])
    np.testing.assert_allclose(place, [[0.5, 0.5], [0.5, 0], [3, 0], [0.2, 0.3]], atol=1e-15)
    assert np.isfinite(weights).all()


def test_frames_are_counted_as_in_lists() -> None:
    face = small_face()
    talk = face.takes[2]
    np.testing.assert_array_equal(maths.posed(face, talk, -1), maths.posed(face, talk, 4))
    for frame in (5, -6):
        with pytest.raises(IndexError):
            maths.posed(face, talk, frame)
