"""The table of parameters, against torch's Adam on plain tensors and an Adam written out in float64."""

from __future__ import annotations

import numpy as np
import pytest
import torch
from torch import Tensor

from avatar_trainer.parameters.table import Table

BETA = (0.9, 0.999)


def table(rows: int = 5) -> Table:
    g = torch.Generator().manual_seed(1)
    made = Table()
    made.add("place", torch.randn(rows, 3, generator=g), 0.1, "cloud")
    made.add("weight", torch.randn(rows, generator=g), 0.01, "cloud")
    made.add("light", torch.randn(2, generator=g), 0.2, "lights")
    return made


def pull(made: Table, target: float = 3.0) -> None:
    """One step towards `target`, each tensor with a gradient of its own size."""
    made.zero_grad()
    loss = sum((((made[name] - target) ** 2).sum() * (k + 1) for k, name in enumerate(made)), torch.zeros(()))
    loss.backward()
    made.step()


def adam(start: Tensor, rate: float, slope: float, steps: int) -> np.ndarray:
    """Kingma and Ba 2015, Algorithm 1, for the loss slope * sum (x - 3)^2, in float64."""
    x = start.detach().numpy().astype(np.float64)
    m, v = np.zeros_like(x), np.zeros_like(x)
    for t in range(1, steps + 1):
        gradient = 2 * slope * (x - 3)
        m = BETA[0] * m + (1 - BETA[0]) * gradient
        v = BETA[1] * v + (1 - BETA[1]) * gradient**2
        x = x - rate * (m / (1 - BETA[0] ** t)) / (np.sqrt(v / (1 - BETA[1] ** t)) + 1e-15)
    return x


def test_steps_are_those_of_adam() -> None:
    made = table()
    start = {name: made[name].detach().clone() for name in made}
    for _ in range(20):
        pull(made)
    rates = made.learning_rates()
    for k, name in enumerate(made):
        expected = adam(start[name], rates[name], k + 1, 20)
        assert np.abs(made[name].detach().numpy() - expected).max() < 5e-6


def test_a_learning_rate_is_its_tensors_alone() -> None:
    made, other = table(), table()
    made.learning_rate("weight", 0.0)
    pull(made)
    pull(other)
    assert torch.equal(made["weight"], table()["weight"])
    assert torch.equal(made["place"], other["place"])
    assert made.learning_rates() == {"place": 0.1, "weight": 0.0, "light": 0.2}


def test_take_moves_values_and_moments_of_one_row_set() -> None:
    made = table()
    pull(made)
    before = {name: {k: v.clone() for k, v in made.state()[name].items() if k in KINDS} for name in made}
    index = torch.tensor([4, 0, 0, 2, 3, 3, 1])
    fresh = torch.tensor([False, False, True, False, False, True, False])
    made.take("cloud", index, fresh)
    after = made.state()
    assert made.count("cloud") == 7 and made.count("lights") == 2
    for name in ("place", "weight"):
        assert torch.equal(after[name]["value"], before[name]["value"][index])
        for moment in KINDS[1:]:
            expected = before[name][moment][index]
            expected[fresh] = 0
            assert expected[~fresh].abs().min() > 0
            assert torch.equal(after[name][moment], expected)
        assert after[name]["step"] == 1
    assert torch.equal(after["light"]["value"], before["light"]["value"])
    assert torch.equal(after["light"]["exp_avg"], before["light"]["exp_avg"])


KINDS = ("value", "exp_avg", "exp_avg_sq")


def test_rows_that_were_taken_go_on_as_if_nothing_had_happened() -> None:
    made, whole = table(), table()
    pull(made)
    pull(whole)
    index = torch.tensor([3, 1])
    made.take("cloud", index, torch.zeros(2, dtype=torch.bool))
    for _ in range(3):
        pull(made)
        pull(whole)
    for name in ("place", "weight"):
        assert torch.equal(made[name], whole[name][index])


def test_take_of_no_rows_and_then_none_left() -> None:
    made = table()
    pull(made)
    nothing = torch.zeros(0, dtype=torch.int64)
    made.take("cloud", nothing, nothing.bool())
    pull(made)
    assert made["place"].shape == (0, 3) and made["weight"].shape == (0,)


def test_set_replaces_values_and_forgets_moments() -> None:
    made = table()
    pull(made)
    parameter = made["weight"]
    made.set("weight", torch.arange(5.0))
    assert made["weight"] is parameter and torch.equal(made["weight"], torch.arange(5.0))
    assert not any(made.state()["weight"][moment].any() for moment in KINDS[1:])
    assert made.state()["place"]["exp_avg"].all()
    with pytest.raises(ValueError, match="'weight'"):
        made.set("weight", torch.zeros(4))


@pytest.mark.parametrize("index", [torch.tensor([1, 3]), torch.tensor([False, True, False, True, False])])
def test_reset_forgets_moments_of_some_rows(index: Tensor) -> None:
    made = table()
    pull(made)
    made.reset("place", index)
    for moment in KINDS[1:]:
        assert (made.state()["place"][moment].abs().sum(1) > 0).tolist() == [True, False, True, False, True]
        assert made.state()["weight"][moment].all()


def test_a_state_goes_on_bit_by_bit_whatever_the_row_count() -> None:
    made = table()
    for _ in range(3):
        pull(made)
    made.take("cloud", torch.tensor([0, 1, 1]), torch.tensor([False, False, True]))
    made.learning_rate("light", 0.05)
    state = {
        k: {f: v.clone() if isinstance(v, Tensor) else v for f, v in e.items()}
        for k, e in made.state().items()
    }
    other = table()
    pull(other)
    other.load_state(state)
    for _ in range(3):
        pull(made)
        pull(other)
    assert other.learning_rates() == made.learning_rates()
    for name in made:
        assert torch.equal(made[name], other[name])
        for kind in KINDS:
            assert torch.equal(made.state()[name][kind], other.state()[name][kind])


def test_what_is_loaded_is_a_copy() -> None:
    made, other = table(), table()
    other.load_state(made.state())
    kept = made["place"].detach().clone()
    pull(other)
    assert torch.equal(made["place"], kept) and not made.state()["place"]["exp_avg"].any()


@pytest.mark.parametrize(
    "wrong",
    [
        {"place": torch.zeros(4, 2)},
        {"place": torch.zeros(4, 3, dtype=torch.float64)},
        {"place": torch.zeros(4, 3)},  # weight has 5 rows
    ],
)
def test_a_state_of_another_table_is_refused(wrong: dict[str, Tensor]) -> None:
    made = table()
    state = made.state()
    for name, tensor in wrong.items():
        state[name] = {**state[name], "value": tensor, "exp_avg": tensor, "exp_avg_sq": tensor}
    with pytest.raises(ValueError, match=r"of (place|weight) is torch\.float"):
        made.load_state(state)
    with pytest.raises(ValueError, match="cannot go on"):
        made.load_state({"place": state["place"]})


def test_rows_and_names_are_checked() -> None:
    made = table()
    with pytest.raises(ValueError, match="already"):
        made.add("light", torch.zeros(2), 0.1, "lights")
    with pytest.raises(ValueError, match="4 rows, 'cloud' has 5"):
        made.add("colour", torch.zeros(4), 0.1, "cloud")
    with pytest.raises(KeyError):
        made.take("clouds", torch.zeros(1, dtype=torch.int64), torch.zeros(1, dtype=torch.bool))
    with pytest.raises(ValueError, match="empty"):
        Table().step()
    assert list(made) == ["place", "weight", "light"] and made.rows("light") == "lights" and "x" not in made


def test_added_tensors_are_copies() -> None:
    tensor, made = torch.zeros(2), Table()
    made.add("x", tensor, 0.1, "x")
    pull(made)
    assert not tensor.any()
