"""Some iterations of a system, and that it goes on from a state as if it had never stopped."""

from __future__ import annotations

import copy
from collections.abc import Callable

from avatar_trainer.captures.targets import read
from avatar_trainer.loop.iterate import Trainer
from avatar_trainer.settings import TrainSettings
from avatar_trainer.systems.protocol import System
from tests.trainer.tensors import same


def trainer_of(system: System, iterations: int = 12) -> Trainer:
    return Trainer(system, system.capture, TrainSettings(iterations=iterations, seed=3))


def run(trainer: Trainer, first: int, last: int) -> list[float]:
    """The loss of each iteration, `first` to `last`."""
    steps = (trainer.step(iteration, read(trainer.frame(iteration))) for iteration in range(first, last + 1))
    return [sum(step.terms.values()) for step in steps]


def expect_to_go_on(fresh: Callable[[], System], stop: int, last: int) -> System:
    """A system after the iteration `last`; one that stopped after `stop` ends in the same bits."""
    whole, other = trainer_of(fresh()), trainer_of(fresh())
    run(whole, 1, stop)
    kept = copy.deepcopy(whole.state())
    run(whole, stop + 1, last)
    other.load_state(kept)
    assert same(other.system.state(), kept["system"])
    run(other, stop + 1, last)
    assert same(whole.system.state(), other.system.state())
    return whole.system
