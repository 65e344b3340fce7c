"""TensorBoard's scalars of a run."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from torch.utils.tensorboard import SummaryWriter


class Logs:
    """Event files in a folder; entries after the iteration from which a run resumes are discarded."""

    def __init__(self, folder: Path, first: int) -> None:
        self._writer = SummaryWriter(str(folder), purge_step=first)

    def __enter__(self) -> Logs:
        return self

    def __exit__(self, *_: object) -> None:
        self._writer.close()

    def scalars(self, group: str, values: Mapping[str, float], iteration: int) -> None:
        """Several curves, named `group/name`."""
        for name, value in values.items():
            self._writer.add_scalar(f"{group}/{name}", value, iteration)
