"""Settings from texts, by the types of their fields."""

from __future__ import annotations

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
