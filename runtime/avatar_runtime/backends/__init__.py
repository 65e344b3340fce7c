"""The backends that play the stages: one row each in BACKENDS, one interface, results equal up to rounding."""

from __future__ import annotations

import importlib
import importlib.util
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Protocol

import numpy.typing as npt

from avatar_runtime.avatar import F32, Avatar
from avatar_runtime.camera import Camera
from avatar_runtime.checks import arguments
from avatar_runtime.io.errors import AvatarError
from avatar_runtime.posed import Clock, Posed
from avatar_runtime.stages.activate import Splats
from avatar_runtime.stages.raster import Image
from avatar_schema.extras import how_to_install

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


BACKENDS: Mapping[str, Row] = {
    "reference": Row("avatar_runtime.backends.reference", None, ""),
    "cpu": Row("avatar_runtime.backends.cpu", "numba", "fast"),
    "gl": Row("avatar_runtime.backends.gl", "moderngl", "gl"),
}


def default_backend() -> str:
    """The backend that Player takes by default: `cpu` if Numba is installed, else `reference`."""
    return "cpu" if importlib.util.find_spec("numba") else "reference"


def make_backend(name: str | None, avatar: Avatar, **options: Any) -> Backend:
    """The backend of that name for `avatar`; None takes the default.

    Raises ValueError for an unknown name, AvatarError where its library is not installed.
    """
    name = arguments.text("backend", default_backend() if name is None else name, BACKENDS)
    row = BACKENDS[name]
    if row.library and importlib.util.find_spec(row.library) is None:
        raise AvatarError(f"needs {row.library}: {how_to_install(row.extra)}", field=f"backend {name}")
    backend: Backend = importlib.import_module(row.module).make(avatar, **options)
    return backend
