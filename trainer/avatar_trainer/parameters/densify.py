"""Adaptive density control: where Gaussians are added and removed (Kerbl et al. 2023, section 5.2).

A system asks for a plan, rearranges its rows by it, and then treats the new rows as its embedding needs.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import torch
from torch import Tensor

from avatar_trainer.parameters import stored
from avatar_trainer.settings import ABOVE_ZERO, MOST, expect_ranges

SPLIT_COPIES = 2
SPLIT_SHRINK = 0.8 * SPLIT_COPIES  # the scale of a split Gaussian's copies is divided by this
# Of a run, at its end: nothing is added, removed or reset there, since new Gaussians need some hundred steps to settle.
SETTLING = 0.2


@dataclass(frozen=True)
class DensitySettings:
    """When Gaussians are added and removed; the defaults are those of 3D Gaussian Splatting, for 30 000 iterations.

    Its limit of 20 pixels for the radius on the screen is left out: the released code resets the radii before it reads
    them, so the rule never acts there, and its effect depends on the resolution. ValueError for a value out of
    range.
    """

    densify_from: int = 500  # iterations: the first plan comes after this
    densify_until: int = 15_000  # the last before this
    densify_every: int = 100
    opacity_reset_every: int = 3000
    gradient_threshold: float = 2e-4  # mean length of the screen gradient, normalised device units
    percent_dense: float = 0.01  # of the extent: smaller ones are cloned, larger ones split
    min_opacity: float = 0.005
    max_screen_radius: int = 0  # pixels, judged after the first opacity reset; 0: not at all
    max_world_scale: float = 0.1  # of the extent, judged after the first opacity reset
    max_gaussians: int = 0  # 0: no bound

    def __post_init__(self) -> None:
        any_number = dict.fromkeys(
            ("densify_from", "densify_until", "max_screen_radius", "max_gaussians"), (0, MOST)
        )
        every = dict.fromkeys(("densify_every", "opacity_reset_every"), (1, MOST))
        lengths = dict.fromkeys(("gradient_threshold", "percent_dense"), (0, math.inf))
        expect_ranges(
            self,
            {
                **any_number,
                **every,
                **lengths,
                "min_opacity": (0, 1),
                "max_world_scale": (ABOVE_ZERO, math.inf),
            },
        )

    def within(self, iterations: int) -> DensitySettings:
        """These settings for a run of `iterations`: its last fifth is left to settle."""
        last = math.floor((1 - SETTLING) * iterations)
        return replace(self, densify_until=min(self.densify_until, last + 1))

    def observing(self, iteration: int) -> bool:
        """Whether a plan will read the statistics of this iteration."""
        return iteration < self.densify_until

    def due(self, iteration: int) -> bool:
        """Whether a plan is due after this iteration (1 is the first)."""
        return self.densify_from < iteration < self.densify_until and iteration % self.densify_every == 0

    def opacity_reset_due(self, iteration: int) -> bool:
        """Whether opacities are lowered to 0.01 after this iteration."""
        return iteration < self.densify_until and iteration % self.opacity_reset_every == 0

    def judges_size(self, iteration: int) -> bool:
        """Whether large Gaussians are removed too."""
        return iteration > self.opacity_reset_every


@dataclass(frozen=True)
class Plan:
    """The changes of N Gaussians; no index is in two of the three."""

    clone: Tensor  # i64[C] stay and get one copy each
    split: Tensor  # i64[S] are replaced by SPLIT_COPIES smaller ones each
    prune: Tensor  # bool[N] go

    @property
    def kept(self) -> Tensor:
        """i64[] Gaussians that stay, in their order."""
        stays = ~self.prune
        stays[self.split] = False
        return torch.nonzero(stays).squeeze(1)

    def rows(self) -> tuple[Tensor, Tensor]:
        """(index i64[M], fresh bool[M]) for `Table.take`: kept, then clones' copies, then the first copy of each
        split Gaussian, then the second."""
        kept = self.kept
        index = torch.cat([kept, self.clone, self.split.repeat(SPLIT_COPIES)])
        fresh = torch.ones(len(index), dtype=torch.bool)
        fresh[: len(kept)] = False
        return index, fresh


class Density:
    """Statistics of N Gaussians since the last plan."""

    def __init__(self, count: int) -> None:
        self.reset(count)

    def reset(self, count: int) -> None:
        """Start again with `count` Gaussians; called after every plan."""
        self.gradient_sum = torch.zeros(count, dtype=torch.float32)
        self.seen = torch.zeros(count, dtype=torch.float32)
        self.largest_radius = torch.zeros(count, dtype=torch.int32)

    def observe(self, radius: Tensor, screen_gradient: Tensor) -> None:
        """Add an iteration: radius i32[N] pixels (0: not drawn), screen_gradient [N, 2] normalised device units."""
        drawn = radius > 0
        length = torch.linalg.vector_norm(screen_gradient.detach().to(torch.float32), dim=1)
        self.gradient_sum += torch.where(drawn, length, torch.zeros_like(length))
        self.seen += drawn
        self.largest_radius = torch.maximum(self.largest_radius, radius.to(torch.int32))

    def plan(
        self,
        settings: DensitySettings,
        log_scale: Tensor,
        opacity_logit: Tensor,
        extent: float,
        *,
        judge_size: bool = False,
    ) -> Plan:
        """Which Gaussians to clone, split and remove.

        log_scale [N, 3] and extent in one unit, opacity_logit [N]. `judge_size`: remove by size too. If the
        bound `max_gaussians` leaves room for fewer, those with the largest gradient grow, ties by the lower index.
        """
        gradient = self.gradient_sum / self.seen.clamp(min=1)
        scale = log_scale.detach().exp().amax(dim=1)
        large = scale > settings.percent_dense * extent
        grows = gradient >= settings.gradient_threshold
        prune = torch.sigmoid(opacity_logit.detach().reshape(-1)) < settings.min_opacity
        if judge_size:
            splits = grows & large
            after = torch.where(splits, scale / SPLIT_SHRINK, scale)
            if settings.max_screen_radius:
                prune |= (self.largest_radius > settings.max_screen_radius) & ~splits
            prune |= after > settings.max_world_scale * extent
        grows &= ~prune
        if settings.max_gaussians:
            grows &= self._within(grows, gradient, settings.max_gaussians - int((~prune).sum()))
        return Plan(
            clone=torch.nonzero(grows & ~large).squeeze(1),
            split=torch.nonzero(grows & large).squeeze(1),
            prune=prune,
        )

    @staticmethod
    def _within(grows: Tensor, gradient: Tensor, room: int) -> Tensor:
        """bool[N]: the `room` Gaussians of the largest gradient among those that would each add one."""
        rank = torch.sort(torch.where(grows, gradient, -1.0), descending=True, stable=True).indices
        chosen = torch.zeros_like(grows)
        chosen[rank[: max(room, 0)]] = True
        return chosen

    def state(self) -> dict[str, Any]:
        """For a checkpoint."""
        return {"gradient_sum": self.gradient_sum, "seen": self.seen, "largest_radius": self.largest_radius}

    def load_state(self, state: dict[str, Any], count: int) -> None:
        """Continue from `state`, of `count` Gaussians. ValueError or KeyError for anything else."""
        self.reset(count)
        for name, own in self.state().items():
            setattr(self, name, stored.tensor(state[name], name, (count,), own.dtype).clone())
