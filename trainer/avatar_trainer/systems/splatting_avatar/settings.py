"""Rules and settings of SplattingAvatar, and the schedule that follows from them."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from avatar_runtime import F32, Rules
from avatar_runtime import rules as runtime_rules
from avatar_trainer.parameters.densify import DensitySettings
from avatar_trainer.settings import (
    ABOVE_ZERO,
    MOST,
    MOST_GAUSSIANS,
    MOST_ITERATIONS,
    Rule,
    expect_ranges,
    rule_defaults,
)
from avatar_trainer.systems.common.first_points import INIT_COLOURS, SAMPLING

PAPER_ITERATIONS = 30_000  # of the release's schedule
LEAST_RESET_EVERY = 1000
BY_SUBJECT = "by_subject"


@dataclass(frozen=True)
class Subject:
    """The release's settings for one kind of data set, and our rule `scale` for it."""

    units: float  # training units in a metre
    frameset_type: str  # as config.yaml says it
    scale: str


SUBJECTS = {"head": Subject(4.0, "imavatar", "linear_area"), "body": Subject(1.0, "instant_avatar", "none")}
HEAD_HEIGHT = 1.0  # metres: a mesh below is a head, for subject `auto`

RULES: Mapping[str, Rule] = {
    "embedding": Rule(
        ("walking", "clamped", "fixed", "released"), "released", "walking", "walking",
        "(u, v) trained and walking on triangles; held in its triangle; a shift in space instead; not trained",
        trainer_only=("fixed",),
    ),
    "position": Rule(
        runtime_rules.NORMAL_POSITIONS, "normal", "interpolated_normal", "normal",
        "displacement along the interpolated normal made unit, or as it is (Eq. 2)",
    ),
    "rotation": Rule(
        runtime_rules.VERTEX_ROTATIONS, "vertex_quaternion", "vertex_quaternion_mean",
        "vertex_quaternion", "vertex quaternions made unit, or the mean by area (Eq. 5)",
    ),
    "scale": Rule(
        (BY_SUBJECT, *runtime_rules.AREA_SCALES), "log_area for heads, none for bodies", "linear_area", BY_SUBJECT,
        "how the mesh stretches Gaussians; by_subject: linear_area for heads, as log_area shrinks them where triangles "
        "grow (eyes show through closed lids), none for bodies",
    ),
    "sh_direction": Rule(
        runtime_rules.SH_DIRECTIONS, "world", "degree 0 only", "inverse_rotation",
        "how colours beyond SH degree 0 are seen: turned with the mesh (the release's option convert_SHs_python, off "
        "by default; the gradient of (u, v) leaves the turn out), or not",
    ),
}  # fmt: skip


@dataclass(frozen=True)
class LearningRates:
    """Of Adam; 3DGS's. `position` is that of the embedding, times the extent, and falls exponentially."""

    position: float = 1.6e-4
    position_final: float = 1.6e-6
    rotation: float = 1e-3
    log_scale: float = 5e-3
    opacity_logit: float = 5e-2
    sh: float = 2.5e-3  # beyond degree 0 a twentieth of it

    def __post_init__(self) -> None:
        falling = dict.fromkeys(("position", "position_final"), (ABOVE_ZERO, math.inf))  # by a power
        expect_ranges(self, {**dict.fromkeys(vars(self), (0, math.inf)), **falling})


@dataclass(frozen=True)
class Settings:
    """Settings of training; the defaults are the paper's (section 3, appendix B) if it states one.

    `density` is for 30 000 iterations: its times are scaled with `iterations` (see `scheduled`).
    ValueError for a value out of range.
    """

    iterations: int = PAPER_ITERATIONS
    gaussians: int = 10_000  # at the start
    sh_degree: int = 0  # the paper; above it the gradient of (u, v) is incomplete (see system.py)
    rules: Mapping[str, str] = field(default_factory=lambda: rule_defaults(RULES))
    subject: str = "auto"  # head | body | auto: by the height of the mesh
    sampling: str = "uniform"  # uniform: every triangle alike (the paper); area
    init_colour: str = "frames"  # frames | grey
    walk_decay: float = 1.0  # what an edge leaves of the rest of a walk; the released code has 0.9
    dssim: float = 0.2  # weight of 1 - SSIM, in place of the paper's LPIPS
    lpips: float = 0.0  # the paper: 0.01; needs the package lpips
    scaling: float = 1.0  # weight of Eq. 14
    long: float = 0.008  # training units: T_s and T_r of Eq. 14, which appendix B prints the other way round
    thin_ratio: float = 10.0
    sh_degree_every: int = 1000  # iterations between active degrees
    learning_rates: LearningRates = field(default_factory=LearningRates)
    density: DensitySettings = field(default_factory=lambda: DensitySettings(densify_from=600))

    def __post_init__(self) -> None:
        if self.subject not in ("auto", *SUBJECTS):
            raise ValueError(f"subject is {self.subject!r}; auto, {', '.join(SUBJECTS)}")
        expect_ranges(
            self,
            {
                "gaussians": (1, MOST_GAUSSIANS),
                "iterations": (1, MOST_ITERATIONS),
                "sh_degree": (0, 3),
                "sh_degree_every": (1, MOST),
                "walk_decay": (0, 1),
                "thin_ratio": (ABOVE_ZERO, math.inf),
                **dict.fromkeys(("dssim", "lpips", "scaling", "long"), (0, math.inf)),
            },
        )
        if self.sampling not in SAMPLING or self.init_colour not in INIT_COLOURS:
            raise ValueError(
                f"sampling is one of {', '.join(SAMPLING)}, init_colour of {', '.join(INIT_COLOURS)}"
            )


def scheduled(settings: Settings) -> DensitySettings:
    """`settings.density` with its times in proportion to the run's length.

    Recovery from an opacity reset takes some hundred steps, so resets are at least `LEAST_RESET_EVERY` apart.
    """
    share = settings.iterations / PAPER_ITERATIONS
    density = settings.density
    scaled = replace(
        density,
        densify_from=round(density.densify_from * share),
        densify_until=round(density.densify_until * share),
        opacity_reset_every=max(round(density.opacity_reset_every * share), LEAST_RESET_EVERY),
    )
    return scaled.within(settings.iterations)


def subject_of(settings: Settings, vertices: F32) -> Subject:
    """The kind of data set; for subject `auto`, `vertices` [V, 3] in metres decide."""
    if settings.subject != "auto":
        return SUBJECTS[settings.subject]
    return SUBJECTS["head" if np.ptp(vertices[:, 1]) < HEAD_HEIGHT else "body"]


def surface_rules(settings: Settings, subject: Subject) -> Rules:
    """The rules that the avatar is played by."""
    chosen = settings.rules
    return Rules(
        position=chosen["position"],
        rotation=chosen["rotation"],
        scale=subject.scale if chosen["scale"] == BY_SUBJECT else chosen["scale"],
        sh_direction=chosen["sh_direction"],
        quaternion_sign="w_positive",
    )
