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
    with pytest.raises(ValueError, match="'light' is"):
        made.set("light", torch.zeros(7))
    assert list(made) == ["place", "weight", "light"] and made.rows("light") == "lights" and "x" not in made
