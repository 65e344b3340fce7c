"""The systems that can be trained, by the name that the exporter's reader gives them."""

from __future__ import annotations

import importlib
from collections.abc import Callable, Mapping
from typing import Any, Protocol, cast

from avatar_trainer.captures.model import Capture
from avatar_trainer.settings import Rule
from avatar_trainer.systems.protocol import System

SYSTEMS = {
    "gaussian_blendshapes": "avatar_trainer.systems.gaussian_blendshapes.system",
    "psavatar": "avatar_trainer.systems.psavatar.system",
    "splatting_avatar": "avatar_trainer.systems.splatting_avatar.system",
}


class SystemModule(Protocol):
    """What a module of a system has.

    `Settings` is a frozen dataclass with defaults and at least `iterations: int` (of the whole run: schedules are
    made for it), `gaussians: int` (at the start), `sh_degree: int` (the highest) and `rules: Mapping[str, str]`
    (every rule's value); `RULES` says which rules there are.
    """

    Settings: type[Any]
    RULES: Mapping[str, Rule]
    create: Callable[[Capture, Any, int], System]  # capture, Settings, seed


def system_module(name: str) -> SystemModule:
    """The module of a system of `SYSTEMS`."""
    return cast(SystemModule, importlib.import_module(SYSTEMS[name]))
