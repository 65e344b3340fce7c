"""Every trainable tensor of a system, and its optimiser: rows can be taken, repeated and dropped."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import torch
from torch import Tensor, nn

from avatar_trainer.parameters import stored

EPSILON = 1e-15  # of Adam, as in 3D Gaussian Splatting: gradients of a splat can be this small
MOMENTS = ("exp_avg", "exp_avg_sq")


class Table:
    """Named tensors, each in a row set; tensors of one row set have one row for each of its Gaussians.

    `table[name]` is the present parameter: `take` and `set` may replace it, so look it up each time. The optimiser is
    torch's Adam with one learning rate per tensor.
    """

    def __init__(self) -> None:
        self._rows: dict[str, str] = {}
        self._parameters: dict[str, nn.Parameter] = {}
        self._adam: torch.optim.Adam | None = None

    def add(self, name: str, tensor: Tensor, learning_rate: float, rows: str) -> None:
        """A tensor [M, ...] of the row set `rows`, copied. ValueError for a duplicate name or another M."""
        if name in self._parameters:
            raise ValueError(f"{name!r} is in the table already")
        if rows in self._rows.values() and len(tensor) != self.count(rows):
            raise ValueError(f"{name!r} has {len(tensor)} rows, {rows!r} has {self.count(rows)}")
        parameter = nn.Parameter(tensor.detach().clone(memory_format=torch.contiguous_format))
        group = {"params": [parameter], "lr": float(learning_rate), "name": name}
        if self._adam is None:
            self._adam = torch.optim.Adam([group], eps=EPSILON, fused=True)
        else:
            self._adam.add_param_group(group)
        self._rows[name] = rows
        self._parameters[name] = parameter
        self._optimiser.state[parameter] = {
            "step": torch.zeros((), dtype=torch.float32),
            **{moment: torch.zeros_like(parameter) for moment in MOMENTS},
        }

    def __getitem__(self, name: str) -> nn.Parameter:
        return self._parameters[name]

    def __contains__(self, name: object) -> bool:
        return name in self._parameters

    def __iter__(self) -> Iterator[str]:
        return iter(self._parameters)

    def rows(self, name: str) -> str:
        """The row set of a tensor."""
        return self._rows[name]

    def count(self, rows: str) -> int:
        """The number of rows of a row set. KeyError for a row set without tensors."""
        return len(self._parameters[next(iter(self.names(rows)))])

    def names(self, rows: str) -> list[str]:
        """The tensors of a row set. KeyError if there are none."""
        found = [name for name, of in self._rows.items() if of == rows]
        if not found:
            raise KeyError(rows)
        return found

    def take(self, rows: str, index: Tensor, fresh: Tensor) -> None:
        """Row m of every tensor of `rows` becomes the former row index[m]; its Adam moments too, 0 where fresh[m].

        index i64[M], fresh bool[M]. The step count of Adam is per tensor and stays, as in 3D Gaussian Splatting.
        """
        for name in self.names(rows):
            moments = self._moments(name)
            self._replace(name, self._parameters[name].detach()[index])
            state = self._optimiser.state[self._parameters[name]]
            for moment in MOMENTS:
                state[moment] = moments[moment][index]
                state[moment][fresh] = 0

    def set(self, name: str, tensor: Tensor) -> None:
        """Replace the values of a tensor, in the same shape; its moments become 0. ValueError for another shape."""
        parameter = self._parameters[name]
        if tensor.shape != parameter.shape:
            raise ValueError(f"{name!r} is {tuple(parameter.shape)}, not {tuple(tensor.shape)}")
        with torch.no_grad():
            parameter.copy_(tensor)
        self.reset(name)

    def reset(self, name: str, index: Tensor | None = None) -> None:
        """Set the Adam moments of a tensor to 0, of the rows `index` (i64 or bool) or all."""
        for moment in self._moments(name).values():
            moment[slice(None) if index is None else index] = 0

    def step(self) -> None:
        """One step of Adam; tensors without a gradient stay."""
        self._optimiser.step()

    def zero_grad(self) -> None:
        """Clear the gradients."""
        self._optimiser.zero_grad(set_to_none=True)

    def learning_rate(self, name: str, value: float) -> None:
        """Set the learning rate of a tensor."""
        self._group(name)["lr"] = float(value)

    def learning_rates(self) -> dict[str, float]:
        """The present learning rate of every tensor."""
        return {name: float(self._group(name)["lr"]) for name in self._parameters}

    def state(self) -> dict[str, Any]:
        """Everything that `load_state` needs: values, moments, step counts, learning rates."""
        return {
            name: {
                "value": parameter.detach(),
                "rows": self._rows[name],
                "learning_rate": float(self._group(name)["lr"]),
                "step": float(self._optimiser.state[parameter]["step"]),
                **self._moments(name),
            }
            for name, parameter in self._parameters.items()
        }

    def load_state(self, state: dict[str, Any]) -> None:
        """Continue from `state`, of a table with the same tensors; row counts may differ.

        ValueError for another table, and for values from which Adam cannot continue; KeyError if some are missing.
        """
        self._check(state)
        for name, entry in state.items():
            self._replace(name, entry["value"].detach().clone())
            self.learning_rate(name, entry["learning_rate"])
            kept = self._optimiser.state[self._parameters[name]]
            kept["step"] = torch.tensor(float(entry["step"]), dtype=torch.float32)
            for moment in MOMENTS:
                kept[moment] = entry[moment].clone()

    def _check(self, state: dict[str, Any]) -> None:
        if set(state) != set(self._parameters):
            raise ValueError(
                f"a table of {sorted(self._parameters)} cannot go on from one of {sorted(state)}"
            )
        counts: dict[str, int] = {}
        for name, entry in state.items():
            own, rows = self._parameters[name], self._rows[name]
            shape = (counts.setdefault(rows, len(entry["value"])), *own.shape[1:])
            for part in ("value", *MOMENTS):
                stored.tensor(entry[part], f"{part} of {name}", shape, own.dtype)
            if (entry["exp_avg_sq"] < 0).any():
                raise ValueError(f"exp_avg_sq of {name} has values below 0")
            for part in ("step", "learning_rate"):
                stored.number(entry[part], f"{part} of {name}")

    @property
    def _optimiser(self) -> torch.optim.Adam:
        if self._adam is None:
            raise ValueError("the table is empty")
        return self._adam

    def _group(self, name: str) -> dict[str, Any]:
        return next(group for group in self._optimiser.param_groups if group["name"] == name)

    def _moments(self, name: str) -> dict[str, Tensor]:
        state = self._optimiser.state[self._parameters[name]]
        return {moment: state[moment] for moment in MOMENTS}

    def _replace(self, name: str, values: Tensor) -> None:
        parameter = nn.Parameter(values)
        self._optimiser.state[parameter] = self._optimiser.state.pop(self._parameters[name])
        self._group(name)["params"] = [parameter]
        self._parameters[name] = parameter
