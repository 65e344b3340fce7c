"""Rounding by what is seen and what it costs, against rounding each number to the nearest."""

from __future__ import annotations

import numpy as np
import pytest

from avatar_export.packing import seen as seen_module
from avatar_export.packing.rates import rounded
from avatar_export.packing.seen import seen
from tests.avatars import full_avatar

RNG = np.random.default_rng(5)
COUNT, TERMS = 3000, 9
VALUES = RNG.normal(0, 1.2, (COUNT, TERMS, 3)).astype(np.float32)
FEW = RNG.normal(size=(4, TERMS))  # directions that matter; the others hardly do
METRIC = FEW.T @ FEW + 0.02 * np.eye(TERMS)
METRIC /= METRIC.trace() / TERMS
EVEN = np.ones(COUNT)


def seen_error(codes: np.ndarray, weight: np.ndarray = EVEN) -> float:
    """Mean of e^T M e, times the weights."""
    e = VALUES.astype(np.float64) - codes
    return float((weight * np.einsum("itc,tk,ikc->i", e, METRIC, e)).mean())


def bits(codes: np.ndarray) -> float:
    """Entropy of the numbers, each term by itself, bits a number."""
    found = []
    for term in range(codes.shape[1]):
        share = np.unique(codes[:, term], return_counts=True)[1] / codes[:, term].size
        found.append(-(share * np.log2(share)).sum())
    return float(np.mean(found))


def test_less_error_that_is_seen_in_fewer_bits() -> None:
    codes, nearest = rounded(VALUES, EVEN, METRIC, 127), np.rint(VALUES)
    assert seen_error(codes) < 0.7 * seen_error(nearest)
    assert bits(codes) < bits(nearest)


def test_entries_that_nobody_sees_become_0() -> None:
    weight = np.where(np.arange(COUNT) % 2, 1.0, 1e-6)
    codes = rounded(VALUES, weight, METRIC, 127)
    assert not codes[::2].any() and codes[1::2].any()


def test_a_term_that_hardly_pays_is_0_throughout() -> None:
    values = VALUES.copy()
    values[:, 4] *= 0.2
    codes = rounded(values, EVEN, np.eye(TERMS), 127)
    assert not codes[:, 4].any()
    assert all(codes[:, term].any() for term in range(TERMS) if term != 4)


@pytest.mark.parametrize("half", [127, 32767])
def test_numbers_stay_within_the_range(half: int) -> None:
    codes = rounded(VALUES * 1000 * half / 127, EVEN, METRIC, half)
    assert np.abs(codes).max() == half


def test_few_steps_round_nearly_to_the_nearest() -> None:
    codes = rounded(VALUES * 40, EVEN, np.eye(TERMS), 127)
    assert np.abs(codes - np.clip(VALUES * 40, -127, 127)).max() <= 1.5


def test_no_entries() -> None:
    assert rounded(VALUES[:0], EVEN[:0], METRIC, 127).shape == (0, TERMS, 3)


def test_what_is_seen_of_an_avatar() -> None:
    avatar = full_avatar()
    found = seen(avatar)
    terms = avatar.gaussians.sh.shape[1]
    assert found.weight.shape == (avatar.gaussians.count,)
    assert found.weight.min() >= seen_module.LEAST and found.weight.max() > 1
    assert found.directions.trace() == pytest.approx(terms)
    assert np.linalg.eigvalsh(found.directions).min() > 0
    assert seen(avatar) is found
