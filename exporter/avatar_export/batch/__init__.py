"""Many avatars in one go, on this machine or on a Dask cluster. Needs the extra [batch].

For users: `run`, `read_list`, `Job`, `Result`. The modules are for other kinds of batch. Nothing heavy is loaded before
one of these names is used.
"""

from __future__ import annotations

from importlib import import_module
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any

from avatar_runtime.io.errors import AvatarError
from avatar_schema.extras import how_to_install

if TYPE_CHECKING:
    from avatar_export.batch.job import Job
    from avatar_export.batch.jobs import read_list
    from avatar_export.batch.result import Result
    from avatar_export.batch.running import run

# fmt: off
__all__ = [
    "Job", "Result", "engine", "expect_extra", "failures", "jobs", "locations", "meter", "read_list", "report",
    "result", "run", "running",
]
# fmt: on
_HOMES = {"Job": "job", "Result": "result", "read_list": "jobs", "run": "running"}
_LIBRARIES = ("dask", "distributed", "fsspec")


def expect_extra() -> None:
    """Raise AvatarError if a library of the extra [batch] is not installed."""
    if any(find_spec(name) is None for name in _LIBRARIES):
        raise AvatarError(f"a batch needs the extra [batch]: {how_to_install('batch')}")


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    expect_extra()
    return getattr(import_module(f"{__name__}.{_HOMES[name]}"), name)
