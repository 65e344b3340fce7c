"""Rules and settings of PSAvatar."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from avatar_runtime import Rules
from avatar_trainer.settings import (
    ABOVE_ZERO,
    MOST,
    MOST_GAUSSIANS,
    MOST_ITERATIONS,
    Rule,
    expect_ranges,
    rule_defaults,
)
from avatar_trainer.systems.psavatar.initial import REGIONS

# Training units in a metre: the trackers whose captures the paper uses take FLAME times 4. The near plane, the floor of
# vertex normals and r_max are in such units.
UNITS = 4.0
PAPER_OFFSET = 0.30  # r_max, training units
SETTLED_EVERY = 10  # iterations: how often bases are smoothed and decay
CLEARED = 0.75  # share of the iterations after which what `thin` made invisible is removed
MOST_SHARE = 1 / SETTLED_EVERY
MOST_RATE, MOST_WEIGHT = 1e3, 1e6  # largest learning rates and weights of losses; larger ones are mistakes

RULES: Mapping[str, Rule] = {
    "acquisition": Rule(
        ("points", "gaussians"), "not released", "points", "points",
        "what acquires the shape: discs that face the camera (Eq. 3), or Gaussians at once (section 4.3)",
    ),
    "order": Rule(
        ("mesh_first", "as_printed"), "not released", "as_printed", "mesh_first",
        "a Gaussian's rotation: R = R^j R', its own and then the mesh's, or R = R' R^j as Eq. 10 prints it, which no "
        "Gaussian that turns with the mesh has",
        trainer_only=("as_printed",),
    ),
    "displacement": Rule(
        ("off_mesh", "all"), "not released", "off_mesh", "all",
        "whose offset along the normal is trained: of the points sampled off the mesh alone, or of all",
    ),
}  # fmt: skip


@dataclass(frozen=True)
class LearningRates:
    """Of Adam. Those in metres a step fall exponentially over the run, to `falls_to` of the start; the
    enhancer's do so over the iterations in which it is trained.
    """

    displacement: float = 1e-4  # metres
    bases: float = 1e-5  # metres, P' and E'
    falls_to: float = 0.01
    log_radius: float = 1e-2
    rotation: float = 1e-3
    log_scale: float = 5e-3
    opacity_logit: float = 5e-2
    rgb: float = 1e-2  # of the SH's DC while points acquire the shape
    sh: float = 2.5e-3  # beyond degree 0 a twentieth of it
    enhancer: float = 1e-3

    def __post_init__(self) -> None:
        expect_ranges(self, {**dict.fromkeys(vars(self), (0, MOST_RATE)), "falls_to": (ABOVE_ZERO, 1)})


@dataclass(frozen=True)
class Settings:
    """Settings of training. The paper states r_max and the weights of its losses; counts and times are ours.

    ValueError for a value out of range.
    """

    iterations: int = 10_000
    gaussians: int = 20_000  # points at the start, on and off the mesh
    sh_degree: int = 1
    rules: Mapping[str, str] = field(default_factory=lambda: rule_defaults(RULES))
    # Where points are sampled: all; head, without the shoulders; face, also without the back of the head.
    region: str = "all"
    off_mesh: float = 0.3  # share of the points that are sampled off the mesh; 0: none
    r_max: float = PAPER_OFFSET / UNITS  # metres, the largest offset at the start (Eq. 8)
    acquiring: float = 0.15  # share of the iterations in which points acquire the shape; 0: none
    removals: int = 3  # of points that are hardly seen, evenly spaced until the shape is acquired
    least_visibility: float = 0.02  # compositing weight that a point reaches in some image, or it is removed
    dssim: float = 0.2  # weight of 1 - SSIM, if VGG's weights are not available
    vgg: float = 0.0  # lambda_1 of Eq. 15; the paper: 0.1
    vgg_weights: str = ""  # .safetensors with features.0 and features.2 (weight, bias) of VGG
    scale: float = 0.1  # lambda_2 of Eq. 15
    thin: float = 0.03  # weight of the mean opacity off the mesh; 0: the paper
    # Against motion that no image shows (`steady.py`); 0: as in the paper, which has no such terms.
    # swing: metres that the captured motion may move a point off the mesh, or half as far again as at the start.
    # smoothing, decay: of the learned bases, an iteration: a share of the way to their neighbours' mean, and metres
    # towards 0; both fall as the bases' learning rate does.
    # longest: the largest ratio of a Gaussian's longest axis to its middle one.
    swing: float = 3e-3
    longest: float = 5.0
    smoothing: float = 0.005
    decay: float = 4e-6
    enhancer: bool = False  # whether a U-Net that improves images is trained too (section 3.3)
    enhancing: float = 0.2  # share of the iterations, the last, in which it is
    sh_degree_every: int = 1000  # iterations between active degrees, once the shape is acquired
    learning_rates: LearningRates = field(default_factory=LearningRates)

    def __post_init__(self) -> None:
        expect_ranges(
            self,
            {
                "gaussians": (1, MOST_GAUSSIANS),
                "iterations": (1, MOST_ITERATIONS),
                "sh_degree": (0, 3),
                "sh_degree_every": (1, MOST),
                "removals": (0, MOST),
                "acquiring": (0, 0.9),
                **dict.fromkeys(("off_mesh", "least_visibility", "enhancing"), (0, 1)),
                "smoothing": (0, MOST_SHARE),
                **dict.fromkeys(("r_max", "swing", "decay"), (0, 1)),
                "longest": (0, MOST),
                **dict.fromkeys(("dssim", "vgg", "scale", "thin"), (0, MOST_WEIGHT)),
            },
        )
        if self.region not in REGIONS:
            raise ValueError(f"region is {self.region!r}; one of {', '.join(REGIONS)}")
        if self.vgg and not self.vgg_weights:
            raise ValueError(
                "vgg needs vgg_weights, a .safetensors of VGG's first layers, which is not included"
            )

    @property
    def acquired_after(self) -> int:
        """The last iteration of shape acquisition."""
        return round(self.acquiring * self.iterations)

    @property
    def cleared_at(self) -> int:
        """The iteration after which Gaussians that have become invisible are removed; 0: none."""
        return round(CLEARED * self.iterations) if self.thin else 0

    def enhances(self, iteration: int) -> bool:
        """Whether the enhancer is trained in this iteration."""
        return self.enhancer and iteration > self.iterations - round(self.enhancing * self.iterations)

    def settles(self, iteration: int) -> float:
        """For how many iterations bases are smoothed and decay after this one, fewer as their learning rate falls."""
        if iteration % SETTLED_EVERY or not (self.smoothing or self.decay):
            return 0.0
        rate: float = self.learning_rates.falls_to ** min(iteration / self.iterations, 1.0)
        return SETTLED_EVERY * rate

    def removal_due(self, iteration: int) -> bool:
        """Whether hardly seen points are removed after this iteration."""
        last, n = self.acquired_after, self.removals
        return iteration <= last and n > 0 and (iteration * n) // last > ((iteration - 1) * n) // last


def played_rules() -> Rules:
    """The rules that the avatar is played by (Eqs. 8 to 11)."""
    return Rules(
        position="interpolated_normal",
        rotation="bary_vertex_lbs",
        scale="none",
        sh_direction="inverse_rotation",
    )
