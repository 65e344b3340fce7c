"""Settings from texts, by the types of their fields."""

from __future__ import annotations

from dataclasses import dataclass

import pytest

from avatar_runtime.io.errors import AvatarError
from avatar_trainer.parameters.densify import DensitySettings
from avatar_trainer.settings import TrainSettings, with_values


def test_settings_are_read_by_the_types_of_their_fields() -> None:
    settings = with_values(DensitySettings(), [("gradient_threshold", "1e-3")])
    assert settings.gradient_threshold == 1e-3
    assert with_values(TrainSettings(), [("cache_megabytes", "7")]).cache_megabytes == 7
    for text in ("7.5", "1e3", "9" * 30, "", "inf"):
        with pytest.raises(AvatarError, match="whole number"):
            with_values(TrainSettings(), [("cache_megabytes", text)])
    with pytest.raises(ValueError, match="seed is -1"):
        TrainSettings(seed=-1)


@dataclass(frozen=True)
class Pair:
    low: int = 1
    high: int = 2
    at: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        if self.low > self.high:
            raise ValueError("low is above high")


def test_settings_that_hang_together_are_set_together() -> None:
    pair = with_values(Pair(), [("low", "5"), ("high", "6"), ("at", "1,2.5")])
    assert pair == Pair(5, 6, (1.0, 2.5))
    assert with_values(pair, [("at", "")]).at == ()
    with pytest.raises(AvatarError, match="low is above high"):
        with_values(Pair(), [("low", "5")])
