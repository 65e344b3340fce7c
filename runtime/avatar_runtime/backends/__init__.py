"""The backends that play the stages: one row each in BACKENDS, one interface, results equal up to rounding."""

from __future__ import annotations

import importlib
import importlib.util
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy.typing as npt

from avatar_runtime.avatar import F32, Avatar
from avatar_runtime.camera import Camera
from avatar_runtime.checks import arguments
from avatar_runtime.io.errors import AvatarError
from avatar_runtime.posed import Clock, Posed
from avatar_runtime.program.chunks import BUFFER_LIMIT
from avatar_runtime.stages.activate import Splats
from avatar_runtime.stages.raster import Image
from avatar_schema.extras import how_to_install

# fmt: off
__all__ = [
    "BACKENDS", "Arrays", "Backend", "Row", "SplatBackend", "Stages", "default_backend", "make_backend",
]
# fmt: on
Arrays = Mapping[str, npt.NDArray[Any]]


class Stages(Protocol):
    """Plays each stage of one avatar alone."""

    def stage(self, name: str, inputs: Arrays, camera: Camera | None, profile: str) -> dict[str, Any]:
        """One stage, from the inputs that `conformance.STAGE_ARRAYS` names to its outputs."""
        ...


class Backend(Stages, Protocol):
    """Plays one avatar. Stage `joints` always runs in NumPy and gives `Posed`; the backend runs the other stages."""

    profiles: tuple[str, ...]  # raster profiles that it draws

    def mesh(self, posed: Posed, clock: Clock) -> F32:
        """Stages morph and skin: posed vertices [V, 3] of the rig, mesh space."""
        ...

    def animate(self, posed: Posed, clock: Clock) -> Splats:
        """Stages up to activate: Gaussians in world space."""
        ...

    def frame(self, posed: Posed, camera: Camera, background: F32, profile: str, clock: Clock) -> Image:
        """All stages: the image over `background` [3]. Raises ValueError for one larger than it can draw."""
        ...

    def release(self) -> None:
        """Frees what it holds outside Python's memory; nothing can be played afterwards."""
        ...


class SplatBackend(Backend, Protocol):
    """A backend that draws what its `animate` gave: several cameras share one deformation."""

    def draw(self, splats: Splats, camera: Camera, background: F32, profile: str, clock: Clock) -> Image:
        """Stages from `project` on. Raises as `frame`."""
        ...


@dataclass(frozen=True)
class Row:
    """The module of a backend, and what must be installed to run it."""

    module: str
    library: str | None  # the library that it needs besides NumPy
    extra: str  # the extra of this package that installs it
    options: Mapping[str, Any] = field(default_factory=dict)  # of Player, with their defaults


BACKENDS: Mapping[str, Row] = {
    "reference": Row("avatar_runtime.backends.reference", None, ""),
    "cpu": Row("avatar_runtime.backends.cpu", "numba", "fast", {"threads": None}),
    "gl": Row(
        "avatar_runtime.backends.gl",
        "moderngl",
        "gl",
        {
            "context": None,
            "es": False,
            "buffer_limit": BUFFER_LIMIT,
            "shaders": None,
            "target": "rgba32f",
            "order": "back_to_front",
            "timed": False,
        },
    ),
}


def default_backend() -> str:
    """The backend that Player takes by default: `cpu` if Numba is installed, else `reference`."""
    return "cpu" if importlib.util.find_spec("numba") else "reference"


def make_backend(name: str | None, avatar: Avatar, **options: Any) -> Backend:
    """The backend of that name for `avatar`; None takes the default. `options` are named in BACKENDS.

    Raises ValueError for an unknown name, and for an option of another backend that is not at its default; AvatarError
    where the backend's library is not installed.
    """
    name = arguments.text("backend", default_backend() if name is None else name, BACKENDS)
    row = BACKENDS[name]
    own = {option: value for option, value in options.items() if option in row.options}
    for option in options.keys() - own:
        have = {other: one.options[option] for other, one in BACKENDS.items() if option in one.options}
        if options[option] not in have.values():
            raise ValueError(f"{option} is an option of backend {' and '.join(have)}, not of {name}")
    if row.library and importlib.util.find_spec(row.library) is None:
        raise AvatarError(f"needs {row.library}: {how_to_install(row.extra)}", field=f"backend {name}")
    backend: Backend = importlib.import_module(row.module).make(avatar, **own)
    return backend
