"""Dask imports this in each worker of a test: the toy is a system there, too."""

from __future__ import annotations

from avatar_trainer.systems.table import SYSTEMS
from tests.trainer import toy

SYSTEMS["toy"] = toy.__name__
