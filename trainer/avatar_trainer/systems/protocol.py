"""The interface of a system for the training loop; each system is a folder of `systems` with such a class."""

from __future__ import annotations

from pathlib import Path
from typing import Any, ClassVar, Protocol

from torch import Generator, Tensor

from avatar_runtime import PoseArrays
from avatar_trainer.captures.model import Capture
from avatar_trainer.parameters.table import Table
from avatar_trainer.tensors import Points, Rendered, Splats


class System(Protocol):
    """A trainable avatar of one system.

    A system with an enhancer may also have `enhanced(colour [H, W, 3]) -> Tensor | None`, None while it is untrained:
    evaluation then measures it.
    """

    name: ClassVar[str]  # the name of the exporter's reader
    capture: Capture
    table: Table  # every trainable tensor, and its optimiser
    training_per_bundle: float  # training units in a metre
    sh_degree: int  # active now

    def splats(self, pose: PoseArrays) -> Splats | Points:
        """The avatar in one pose, metres, differentiable with respect to the table; points while acquiring."""

    def background(self, generator: Generator) -> Tensor:
        """[3] the background of this iteration's image, for prediction and target."""

    def losses(self, rendered: Rendered, target: Tensor, mask: Tensor, iteration: int) -> dict[str, Tensor]:
        """Weighted terms whose sum is minimised; target [H, W, 3] is over the background, mask [H, W] 0..1."""

    def observe(self, rendered: Rendered, screen_gradient: Tensor) -> None:
        """Statistics for density control, after backward; screen_gradient [N, 2] in normalised device units."""

    def before_step(self, iteration: int) -> None:
        """Learning rates of this iteration."""

    def after_step(self, iteration: int, generator: Generator) -> None:
        """After an optimiser step: density control, opacity reset, walking on triangles, SH degree."""

    def state(self) -> dict[str, Any]:
        """Everything that `load_state` needs to continue bit by bit: tensors, numbers, strings, dicts and lists."""

    def load_state(self, state: dict[str, Any]) -> None:
        """Continue from `state`."""

    def save(self, folder: Path, iteration: int) -> None:
        """Write the released code's layout, and rules.json, into `folder`."""
