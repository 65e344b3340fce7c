"""Rules and settings of Gaussian Blendshapes."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

from avatar_runtime import rules as runtime_rules
from avatar_trainer.parameters.densify import DensitySettings
from avatar_trainer.settings import ABOVE_ZERO, MOST, MOST_ITERATIONS, Rule, expect_ranges, rule_defaults

BACKGROUNDS = {"black": 0.0, "white": 1.0}
COLOURS = ("frames", "grey")
MOST_START = 250_000  # Gaussians: spacing them takes 20 s; a run may grow beyond
MOST_EXPRESSIONS = 10_000
SETTLED_EVERY = 10  # iterations: how often learned differences decay
LEAST_MOUTH = 1e-3  # metres: radius and half height of a mouth

RULES: dict[str, Rule] = {
    "mask": Rule(
        ("fixed", "per_blendshape"), "fixed", "per_blendshape", "fixed",
        "what displacement of the mesh is 1 in Eq. 2: 5.7 mm, or the largest of each expression",
    ),
    "init_position": Rule(
        ("affine", "rotation"), "affine", "rotation", "affine",
        "how a triangle carries a Gaussian's place to an expression: all of its deformation, or the turn",
    ),
    "init_sh": Rule(
        ("zero", "rotated"), "zero", "rotated", "zero",
        "whether an expression turns the neutral SH with the triangle",
    ),
    "weights": Rule(
        ("nearest_triangle",), "grid", "grid", "nearest_triangle",
        "where skin weights and masks come from: a grid of 256^3 (3.7 GB to blur) in both; here the triangle "
        "that each point was sampled on, copied along by density control",
    ),
    "anchor": Rule(
        runtime_rules.ANCHOR_RULES, "repeats", "left open", "repeats",
        "how often a vertex counts in the fit that carries the upper teeth; the paper: rigidly bound to the "
        "back of the head",
    ),
    "lower_teeth": Rule(
        ("mix", "jaw"), "mix", "mix", "mix",
        "what carries the lower teeth: the joints of the vertex that the jaw holds most, or the jaw alone",
    ),
    "consistency": Rule(
        ("all", "position", "none"), "all", "all", "all",
        "which learned differences the mask scales (ablation, Fig. 4)",
    ),
    "deltas": Rule(
        ("trained", "fixed"), "trained", "trained", "trained",
        "whether differences are learned beyond their init terms (ablation, Fig. 9)",
    ),
    "mouth": Rule(("on", "off"), "on", "on", "on", "Gaussians for the inside of the mouth (ablation, Fig. 10)"),
}  # fmt: skip


@dataclass(frozen=True)
class Rates:
    """Learning rates of Adam; positions in metres, times `Settings.extent`.

    Some are higher than the paper's, for runs of thousands instead of ten thousands of iterations.
    """

    mean: float = 3.2e-4
    mean_final: float = 1.6e-6  # at the last iteration; exponentially between
    sh_dc: float = 2.5e-3
    sh_rest: float = 1.25e-4
    opacity_logit: float = 0.05
    log_scale: float = 0.015
    quat_wxyz: float = 1e-3
    # Of the learned differences, Eq. 2.
    delta_mean: float = 3.2e-6
    delta_opacity_logit: float = 5e-4
    delta_log_scale: float = 5e-3
    delta_quat_wxyz: float = 1e-3
    delta_sh: float = 2.5e-3

    def __post_init__(self) -> None:
        falling = dict.fromkeys(("mean", "mean_final"), (ABOVE_ZERO, math.inf))  # by a logarithm
        expect_ranges(self, {**dict.fromkeys(vars(self), (0, math.inf)), **falling})


@dataclass(frozen=True)
class Weights:
    """Of the terms of the loss, Eq. 3 to 6."""

    dssim: float = 0.2  # lambda; 1 - lambda is that of L1
    alpha: float = 10.0
    mouth: float = 100.0
    lpips: float = 0.0  # 0.05 in the paper's comparison with NeRFBlendShape; needs the package lpips

    def __post_init__(self) -> None:
        expect_ranges(self, {**dict.fromkeys(vars(self), (0, math.inf)), "dssim": (0, 1)})


@dataclass(frozen=True)
class Settings:
    """What the system trains with; the defaults are made for minutes on a CPU, `PAPER` holds those of the paper."""

    iterations: int = 6000
    gaussians: int = 20_000  # on the face at the start
    mouth_gaussians: int = 1000  # in each set of teeth at the start
    expressions: int = 50  # that get Gaussian blendshapes: the body model's first
    sh_degree: int = 1
    delta_sh_degree: int = 0  # of the learned differences
    # Root mean square of an expression's weights over the training frames: where it is smaller, the mask of what is
    # learned of that expression is smaller in proportion; 0: the paper.
    supported: float = 0.25
    decay: float = 1e-3  # of the learned differences, share an iteration; 0: the paper
    # Largest ratio of a Gaussian's longest axis to its middle one in the neutral face; 0: the paper.
    longest: float = 5.0
    least_mask: float = 0.01  # nothing is learned where the mask of Eq. 2 is at most this; 0: the paper
    sh_every: int = 500  # iterations until the next degree is used
    # Metres: of what 3DGS calls the scene; scales rates and density control. A choice of ours.
    extent: float = 1.0
    # Density of the first Gaussians where no frame shows the mesh, 1 elsewhere; 1: the paper.
    unseen: float = 0.25
    # Share of the mean gradient of the colours: Gaussians below it, which a frame hardly shows, stay as they are in its
    # iteration; 0: the paper.
    hidden: float = 0.05
    background: str = "black"  # or white
    colours: str = "frames"  # where the first ones come from: frames, or grey (the paper)
    # File of vertex indices whose motion no mask counts; "": those that the root joint holds most.
    neck_vertices: str = ""
    # Centre x, y, z, radius, half height, metres; radius 0: fitted to the mesh.
    mouth_cylinder: tuple[float, float, float, float, float] = (0.0, 0.0, 0.0, 0.0, 0.0)
    rates: Rates = Rates()
    weights: Weights = Weights()
    density: DensitySettings = field(
        default_factory=lambda: DensitySettings(
            densify_from=500, densify_until=3000, densify_every=300, max_gaussians=30_000
        )
    )
    opacity_resets: bool = False
    rules: Mapping[str, str] = field(default_factory=lambda: rule_defaults(RULES))

    def __post_init__(self) -> None:
        expect_ranges(
            self,
            {
                "iterations": (1, MOST_ITERATIONS),
                "gaussians": (4, MOST_START),
                "mouth_gaussians": (1, MOST_START),
                "expressions": (0, MOST_EXPRESSIONS),
                "sh_every": (1, MOST),
                "least_mask": (0, 1),
                "supported": (0, 1),
                "hidden": (0, 1),
                "decay": (0, 1 / SETTLED_EVERY),
                "extent": (ABOVE_ZERO, math.inf),
                "longest": (0, MOST),
            },
        )
        if not 0 <= self.delta_sh_degree <= self.sh_degree <= 3:
            raise ValueError(
                f"sh_degree is {self.sh_degree}, delta_sh_degree {self.delta_sh_degree}; 0 to 3, the latter no larger"
            )
        if self.background not in BACKGROUNDS or self.colours not in COLOURS:
            raise ValueError("background is black or white; colours is frames or grey")
        if not 0 < self.unseen <= 1:
            raise ValueError(f"unseen is {self.unseen}; above 0, at most 1")
        radius, half_height = self.mouth_cylinder[3:]
        if radius != 0 and not min(radius, half_height) >= LEAST_MOUTH:
            raise ValueError(
                f"mouth_cylinder has radius {radius} and half height {half_height}; at least {LEAST_MOUTH}, "
                "or radius 0 to fit it"
            )


# Sections 3.2 to 4.1 and, where the paper is silent, the released code's cfg_args; but `weights` and `extent` are ours.
PAPER = Settings(
    iterations=40_000, gaussians=50_000, mouth_gaussians=7000, sh_degree=3, delta_sh_degree=3, sh_every=1000,
    supported=0.0, decay=0.0, longest=0.0, least_mask=0.0, hidden=0.0, colours="grey", unseen=1.0,
    rates=Rates(
        mean=1.6e-4, log_scale=5e-3, delta_mean=3.2e-7, delta_opacity_logit=5e-5, delta_log_scale=5e-4,
        delta_quat_wxyz=1e-4, delta_sh=1.25e-3,
    ),
    density=DensitySettings(),
    opacity_resets=True,
    rules=rule_defaults(RULES)
    | {"mask": "per_blendshape", "init_position": "rotation", "init_sh": "rotated"},
)  # fmt: skip
